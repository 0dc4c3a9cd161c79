"""The variables of the equations of motion, and the size of the round-off of their speeds."""

import math

import mpmath
import numpy as np
import pytest

from twolink import lagrange
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.effects.motor_inertia import MotorInertia
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.round_off import A_VALUE

GENERAL = Chain((1.3, 0.8), (1.1, 0.7), ((0.6, 0.1), (0.3, -0.08)), (0.12, 0.03))
LIGHT_ON_HEAVY = Chain.uniform_bars((0.05, 20.0), (1.0, 0.3))
RANDOM = np.random.default_rng(1)
Q, U = RANDOM.uniform(-3, 3, (2, 2, 50))


@pytest.mark.parametrize("name", EQUATIONS)
def test_variables_give_the_speeds_they_were_made_from(name):
    second = EQUATIONS[name].from_speeds(GENERAL, tuple(Q), tuple(U))
    np.testing.assert_allclose(EQUATIONS[name].to_speeds(GENERAL, Q, second), U, rtol=1e-13)


@pytest.mark.parametrize("name", EQUATIONS)
def test_all_variables_describe_one_motion(name):
    q, u = (0.3, -0.4), (1.0, -2.0)
    effects, equations = (Gravity(),), EQUATIONS[name]
    rates = equations.rates(GENERAL, effects, q, equations.from_speeds(GENERAL, q, u), 0.0)
    kane = EQUATIONS["kane"].rates(GENERAL, effects, q, u, 0.0)
    np.testing.assert_allclose(rates[0], u, rtol=1e-14)
    # The acceleration, by a central difference of the speeds along the rates.
    h = 1e-6
    second, (first, slopes) = np.array(equations.from_speeds(GENERAL, q, u)), np.array(rates)
    ahead, behind = (
        np.array(equations.to_speeds(GENERAL, q + s * first, second + s * slopes)) for s in (h, -h)
    )
    np.testing.assert_allclose((ahead - behind) / (2 * h), kane[1], rtol=1e-8)


def rounded_mass(chain, q):
    """Return the sizes of M with that of M12 where the angle between the links is rounded."""
    mass = np.abs(np.array(lagrange.mass_matrix(chain, tuple(q)), float))
    _, a, b = chain.C2
    across = chain.m2 * chain.L1 * math.hypot(a, b) * abs(q[1] - q[0])
    return mass + across * np.array([[0, 1], [1, 0]])


@pytest.mark.parametrize("chain", [GENERAL, LIGHT_ON_HEAVY])
def test_the_rounding_of_speeds_of_momenta_is_that_of_all_terms(chain):
    sizes = EQUATIONS["momenta"].rounded_speeds(chain, Q, U)
    for k, (q, u) in enumerate(zip(Q.T, U.T, strict=True)):
        mass = np.array(lagrange.mass_matrix(chain, tuple(q)), float)
        expected = np.abs(np.linalg.inv(mass)) @ rounded_mass(chain, q) @ np.abs(u)
        np.testing.assert_allclose(sizes[:, k], expected, rtol=1e-9)


@pytest.mark.parametrize("chain", [GENERAL, LIGHT_ON_HEAVY])
def test_the_rounding_of_momenta_is_that_of_all_terms(chain):
    sizes = EQUATIONS["momenta"].rounded_starts(chain, Q, U)
    for k, (q, u) in enumerate(zip(Q.T, U.T, strict=True)):
        np.testing.assert_allclose(sizes[:, k], rounded_mass(chain, q) @ np.abs(u), rtol=1e-12)


def test_the_rounding_of_speeds_is_bounded_where_the_links_are_across(random):
    """M12 is small there, and has the rounding of a large difference of angles."""
    chain, equations = Chain.uniform_bars((1.0, 1.4), (1.0, 0.1)), EQUATIONS["momenta"]
    q = np.array([[0.0], [1.5 * math.pi]]) + random.normal(size=(2, 500)) * [[1.0], [0.0]]
    q[1] = q[0] + 1.5 * math.pi + 1e-4 * random.normal(size=500)
    u = random.normal(size=(2, 500)) * [[30.0], [3.0]]
    p = np.array(equations.from_speeds(chain, tuple(q), tuple(u)))
    back = np.array(equations.to_speeds(chain, tuple(q), tuple(p)))
    longer = chain.convert(np.longdouble)
    exact = equations.to_speeds(longer, *(tuple(x.astype(np.longdouble)) for x in (q, p)))
    missed = np.abs(back - np.array(exact)).astype(float).max()
    roundings = np.finfo(float).eps * equations.rounded_speeds(chain, q, u).max()
    assert 0.05 * roundings < missed < A_VALUE * roundings
    of_values = np.finfo(float).eps * np.abs(u).max()
    assert missed > 5 * A_VALUE * of_values


def test_the_rounding_of_speeds_that_are_variables_is_their_own():
    np.testing.assert_array_equal(EQUATIONS["kane"].rounded_speeds(GENERAL, Q, U), np.abs(U))
    np.testing.assert_array_equal(EQUATIONS["kane"].rounded_starts(GENERAL, Q, U), 0 * U)


@pytest.mark.parametrize("name", EQUATIONS)
def test_constant_torques_add_up_in_the_precision_of_the_chain(name):
    """In float64, 23 N m and 0.88 N m have a rounded sum, which no longer precision would see."""
    zero = mpmath.mpf(0)
    with mpmath.workdps(50):
        chain, equations = GENERAL.convert(mpmath.mpf), EQUATIONS[name]
        effects = (JointTorque((-23.0, 0.88)), JointTorque((0.1, 0.2)))
        _, rates = equations.rates(chain, effects, (zero, zero), (zero, zero), zero)
        du = rates if name != "momenta" else equations.to_speeds(chain, (zero, zero), rates)
        sum1 = mpmath.mpf(-23.0) - mpmath.mpf(0.88) + mpmath.mpf(0.1) - mpmath.mpf(0.2)
        (M11, M12), _ = lagrange.mass_matrix(chain, (zero, zero))
        assert abs(M11 * du[0] + M12 * du[1] - sum1) < 1e-45


@pytest.mark.parametrize("rotors", [False, True])
def test_the_largest_speed_of_momenta_of_size_1_is_bounded(rotors, random):
    chain = Chain((1.3, 0.02), (1.1, 0.7), ((0.6, 0.1), (0.3, -0.2)), (0.12, 0.003))
    if rotors:
        chain = MotorInertia((0.1, 0.02), (10.0, -20.0)).with_rotors(chain)
    bound = EQUATIONS["momenta"].largest_speed(chain)
    seen = 0.0
    for q in random.uniform(-3, 3, (500, 2)):
        inverse = np.linalg.inv(np.array(lagrange.mass_matrix(chain, tuple(q)), float))
        seen = max(seen, np.abs(inverse).sum(axis=1).max())
    assert 0.8 * bound < seen < bound
    assert EQUATIONS["lagrange"].largest_speed(chain) == 1.0


@pytest.mark.parametrize("name", EQUATIONS)
@pytest.mark.parametrize("chain", [GENERAL, LIGHT_ON_HEAVY])
def test_the_sizes_of_rounded_speeds_are_bounded_in_all_poses(chain, name, random):
    equations, turns, fastest = EQUATIONS[name], 40.0, 3.0
    q = random.uniform(-turns, turns, (2, 2000))
    u = random.uniform(-fastest, fastest, (2, 2000))
    seen = float(np.max(equations.rounded_speeds(chain, q, u)))
    bound = equations.largest_rounded_speed(chain, turns, fastest)
    assert seen < bound * (1 + 1e-12)
    assert bound < 30 * seen


@pytest.mark.parametrize("across", [0.0, 0.05, -0.3])
def test_the_inverse_of_a_mass_matrix_is_bounded_in_a_narrow_range_of_poses(across, random):
    """Its determinant is least where the centre of link 2 is in line with link 1."""
    chain = Chain((1e-8, 0.3), (0.7, 1.1), ((0.7, 0.0), (1.1, across)), (0.0, 0.0))
    in_line = -math.atan2(across, 1.1)
    seen = 0.0
    for elbow in in_line + np.pi * np.arange(2):
        inverse = np.linalg.inv(np.array(lagrange.mass_matrix(chain, (0.0, elbow)), float))
        seen = max(seen, np.abs(inverse).sum(axis=1).max())
    assert 0.8 * EQUATIONS["momenta"].largest_speed(chain) < seen
    assert seen < EQUATIONS["momenta"].largest_speed(chain)
