"""The misprints of the textbook, each with a test that settles it."""

import math

import pytest
import sympy as sp

from tests.symbols import CHAIN, DU, LOADS, Q, U, vanishes
from twolink import kane, lagrange
from twolink.chain import Chain
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.errors import ParameterError
from twolink.kinematics import velocity

BARS = Chain.uniform_bars()


def test_1_kinetic_energy_of_link_2_turns_with_omega_2():
    """T2 is printed with I_C2 ω1·ω1; with it, Lagrange's equations would not be Kane's."""
    _, T2 = lagrange.kinetic_energies(CHAIN, Q, U)
    assert vanishes(sp.diff(T2, CHAIN.I_C2) - U[1] ** 2 / 2)
    printed = T2 + CHAIN.I_C2 * (U[0] ** 2 - U[1] ** 2) / 2
    slope = sp.diff(printed, U[1], U[1])
    assert not vanishes(slope - kane.mass_matrix(CHAIN, Q)[1][1])


def test_2_equation_6_9_is_lagranges():
    """The label (6.9) is also printed at T2; here it names d/dt(∂T/∂q̇) − ∂T/∂q = Q."""
    rate = lagrange.momentum_rates(CHAIN, Q, U, DU)
    gradient = lagrange.energy_gradient(CHAIN, Q, U)
    active = lagrange.generalized_active_force(CHAIN, Q, LOADS)
    remainder = lagrange.inverse_dynamics(CHAIN, Q, U, DU, LOADS)
    for r in (0, 1):
        assert vanishes(rate[r] - gradient[r] - active[r] - remainder[r])


def test_3_unit_vectors_of_gravity_and_of_the_end_force():
    """`1` and `J` are i and j: gravity has a y component only, P has both."""
    for load, mass in zip(Gravity(9.81).loads(BARS, (0.3, -0.4), (0, 0)), BARS.mass, strict=True):
        assert load.components == (0, mass * 9.81)
    (end,) = EndForce(normal=2.0, friction=0.5, sliding=1).loads(BARS, (0.3, -0.4), (0, 0))
    assert end.components == (-1.0, 2.0)


@pytest.mark.parametrize("normal", [3.0, -3.0], ids=["surface above", "floor below"])
@pytest.mark.parametrize("u", [(0.1, 0.2), (-0.1, -0.2)])
def test_4_friction_opposes_sliding_on_either_side(normal, u):
    """As printed, −sign(v) μ F drives the sliding for F < 0, that is on a floor below D."""
    q, mu = (0.3, -0.4), 0.5
    vx, _ = velocity(BARS, q, u, BARS.D)
    (end,) = EndForce(normal, mu).loads(BARS, q, u)
    Fx, Fy = end.components
    assert Fx * vx < 0
    assert abs(Fx) == mu * abs(normal)
    assert Fy == normal
    printed = -math.copysign(1, vx) * mu * normal
    assert (printed == Fx) == (normal >= 0)


def test_5_friction_without_sliding_is_a_set():
    """sign(0) is no force: a direction must be named, or there is no single answer."""
    at_rest = ((0.3, -0.4), (0.0, 0.0))
    with pytest.raises(ParameterError, match="does not slide"):
        EndForce(-3.0, 0.5).loads(BARS, *at_rest)
    (frictionless,) = EndForce(-3.0).loads(BARS, *at_rest)
    assert frictionless.components == (0, -3.0)
    for direction in (1, -1):
        (end,) = EndForce(-3.0, 0.5, sliding=direction).loads(BARS, *at_rest)
        assert end.components == (-direction * 1.5, -3.0)


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_6_an_impulse_changes_speeds_without_gravity_or_velocity_terms(formulation):
    """The limit of a force F/h that acts for h: M Δu = Jᵀ Λ, and nothing else counts."""
    q, u, impulse = (0.3, -0.4), (1.1, -0.7), (0.4, -2.0)
    J = formulation.generalized_active_force
    change = None
    for h in (1e-6, 1e-9):
        force = tuple(component / h for component in impulse)
        loads = (*Gravity(9.81).loads(BARS, q, u), *_end(force))
        du = formulation.forward_dynamics(BARS, q, u, loads)
        change = tuple(h * rate for rate in du)
    (M11, M12), (M21, M22) = formulation.mass_matrix(BARS, q)
    left = (M11 * change[0] + M12 * change[1], M21 * change[0] + M22 * change[1])
    assert left == pytest.approx(J(BARS, q, _end(impulse)), rel=1e-7)


def test_7_inertia_torque_of_link_1_and_unequal_lengths():
    """α_10 is α_1; and T, printed for equal bars, holds for L1 ≠ L2 with kinematics' lengths."""
    assert kane.inertia_torques(CHAIN, DU)[0] == -CHAIN.I_C1 * DU[0]
    m, L = sp.symbols("m L", positive=True)
    equal = Chain.uniform_bars((m, m), (L, L))
    q1, q2 = Q
    u1, u2 = U
    printed = m * L**2 / 6 * (4 * u1**2 + 3 * u1 * u2 * sp.cos(q2 - q1) + u2**2)
    assert vanishes(lagrange.kinetic_energy(equal, Q, U) - printed)
    assert vanishes(kane.kinetic_energy(equal, Q, U) - printed)


def _end(force):
    from twolink.loads import Force

    return (Force(BARS.D, force),)
