"""P on the end point; the rule of friction's sign is in tests/test_slips.py."""

import math

import mpmath
import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink import kane, lagrange
from twolink.effects.end_force import EndForce
from twolink.errors import ParameterError
from twolink.kinematics import velocity
from twolink.loads import Force

Q, U = (0.3, -0.4), (1.1, -0.7)


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_the_generalized_force_gives_the_power_of_the_force(formulation):
    loads = EndForce(-3.0, 0.4).loads(GENERAL, Q, U)
    Fx, Fy = loads[0].components
    Q1, Q2 = formulation.generalized_active_force(GENERAL, Q, loads)
    vx, vy = velocity(GENERAL, Q, U, GENERAL.D)
    assert Q1 * U[0] + Q2 * U[1] == pytest.approx(Fx * vx + Fy * vy)


def test_friction_takes_energy_over_many_states(random):
    states = random.uniform(-3, 3, (2, 2, 1000))
    q, u = tuple(states[0]), tuple(states[1])
    (load,) = EndForce(-3.0, 0.4).loads(GENERAL, q, u)
    vx, _ = velocity(GENERAL, q, u, GENERAL.D)
    assert np.all(load.components[0] * vx < 0)
    assert np.all(np.abs(load.components[0]) == 0.4 * 3.0)


def test_one_sticking_state_among_many_is_refused():
    u = (np.array([1.0, 0.0]), np.array([1.0, 0.0]))
    q = (np.array([0.3, 0.3]), np.array([-0.4, -0.4]))
    with pytest.raises(ParameterError, match="does not slide"):
        EndForce(-3.0, 0.4).loads(GENERAL, q, u)


def test_without_friction_the_only_load_is_the_normal_force():
    assert EndForce(2.5).loads(GENERAL, Q, U) == (Force(GENERAL.D, (0, 2.5)),)


@pytest.mark.parametrize("friction", [-0.1, math.nan, math.inf])
def test_bad_friction_is_refused(friction):
    with pytest.raises(ParameterError, match=r"friction must be zero or positive and finite; got"):
        EndForce(1.0, friction)


@pytest.mark.parametrize("sliding", [0, 2, "left"])
def test_bad_direction_is_refused(sliding):
    with pytest.raises(ParameterError, match=r"sliding must be (\+1 or -1|a number)"):
        EndForce(1.0, 0.5, sliding)


def test_friction_has_the_precision_of_the_chain():
    """0.1 times 0.3 N is rounded in float64."""
    with mpmath.workdps(50):
        chain, zero = GENERAL.convert(mpmath.mpf), mpmath.mpf(0)
        (load,) = EndForce(0.3, 0.1, sliding=1).loads(chain, (zero, zero), (zero, zero))
        assert abs(load.components[0] + mpmath.mpf(0.1) * mpmath.mpf(0.3)) < 1e-45


def test_the_limit_of_friction_has_the_digits_of_the_chain():
    """μ |F| = 0.1 · 0.3 in float64 would be wrong after the 16th digit."""
    with mpmath.workdps(60):
        (element,) = EndForce(-0.3, 0.1).contact_elements(GENERAL.convert(mpmath.mpf))
        assert abs(element.kinetic - mpmath.mpf(0.1) * mpmath.mpf(0.3)) < mpmath.mpf(10) ** -59
