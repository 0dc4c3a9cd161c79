"""Proof: Kane and Lagrange are the same equations, for every chain and every load.

SymPy reduces each difference to exactly 0, with general parameters, in a general state.
"""

import pytest
import sympy as sp

from tests.symbols import CHAIN, DU, GRAVITY, LOADS, Q, U, vanishes
from twolink import kane, kinematics, lagrange
from twolink.effects.gravity import Gravity

POINTS = {"C1": CHAIN.C1, "C2": CHAIN.C2, "B": CHAIN.B, "D": CHAIN.D}

QUANTITIES = {
    "mass matrix": lambda f: sp.Matrix(f.mass_matrix(CHAIN, Q)),
    "determinant": lambda f: sp.Matrix([f.determinant(CHAIN, Q)]),
    "velocity terms": lambda f: sp.Matrix(f.velocity_terms(CHAIN, Q, U)),
    "Coriolis matrix": lambda f: sp.Matrix(f.coriolis_matrix(CHAIN, Q, U)),
    "generalized active force": lambda f: sp.Matrix(f.generalized_active_force(CHAIN, Q, LOADS)),
    "inverse dynamics": lambda f: sp.Matrix(f.inverse_dynamics(CHAIN, Q, U, DU, LOADS)),
    "kinetic energy": lambda f: sp.Matrix([f.kinetic_energy(CHAIN, Q, U)]),
}


def time_derivative(expression):
    """Differentiate by time: q' = u and u' = du."""
    rates = dict(zip((*Q, *U), (*U, *DU), strict=True))
    return sum(sp.diff(expression, symbol) * rate for symbol, rate in rates.items())


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_kane_minus_lagrange_is_zero(quantity):
    difference = QUANTITIES[quantity](kane) - QUANTITIES[quantity](lagrange)
    assert all(vanishes(entry) for entry in difference)


def test_forward_dynamics_differ_by_zero():
    # du = adj(M) r / det M with equal M, r and det: compare over the common denominator.
    for f, g in zip(
        kane.forward_dynamics(CHAIN, Q, U, LOADS),
        lagrange.forward_dynamics(CHAIN, Q, U, LOADS),
        strict=True,
    ):
        numerator_f, denominator_f = sp.fraction(f)
        numerator_g, denominator_g = sp.fraction(g)
        assert vanishes(denominator_f - denominator_g)
        assert vanishes(numerator_f - numerator_g)


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_determinant_is_that_of_the_mass_matrix(formulation):
    matrix = sp.Matrix(formulation.mass_matrix(CHAIN, Q))
    assert vanishes(matrix.det() - formulation.determinant(CHAIN, Q))


@pytest.mark.slow
@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_forward_dynamics_solves_the_equations(formulation):
    du = formulation.forward_dynamics(CHAIN, Q, U, LOADS)
    matrix = sp.Matrix(formulation.mass_matrix(CHAIN, Q))
    r = sp.Matrix(formulation.generalized_active_force(CHAIN, Q, LOADS)) - sp.Matrix(
        formulation.velocity_terms(CHAIN, Q, U)
    )
    numerators = sp.Matrix([sp.fraction(entry)[0] for entry in du])
    determinant = formulation.determinant(CHAIN, Q)
    assert all(vanishes(entry) for entry in matrix * numerators - determinant * r)


def test_lagranges_equations_follow_from_the_kinetic_energy():
    """Differentiate T by SymPy, and find the formulas of lagrange.py (6.9)."""
    T = lagrange.kinetic_energy(CHAIN, Q, U)
    momenta = lagrange.momenta(CHAIN, Q, U)
    rates = lagrange.momentum_rates(CHAIN, Q, U, DU)
    gradient = lagrange.energy_gradient(CHAIN, Q, U)
    for r in (0, 1):
        assert vanishes(momenta[r] - sp.diff(T, U[r]))
        assert vanishes(rates[r] - time_derivative(sp.diff(T, U[r])))
        assert vanishes(gradient[r] - sp.diff(T, Q[r]))


def test_kinetic_energy_is_that_of_the_moving_masses():
    """T from the mass centres' velocities, as mechanics defines it."""
    v_C1 = kinematics.velocity(CHAIN, Q, U, CHAIN.C1)
    v_C2 = kinematics.velocity(CHAIN, Q, U, CHAIN.C2)
    translation = CHAIN.m1 * sp.Matrix(v_C1).norm() ** 2 + CHAIN.m2 * sp.Matrix(v_C2).norm() ** 2
    rotation = CHAIN.I_C1 * U[0] ** 2 + CHAIN.I_C2 * U[1] ** 2
    half = sp.Rational(1, 2)
    assert vanishes(half * (translation + rotation) - lagrange.kinetic_energy(CHAIN, Q, U))
    assert vanishes(half * (translation + rotation) - kane.kinetic_energy(CHAIN, Q, U))


@pytest.mark.parametrize("point", POINTS)
def test_velocity_and_acceleration_are_derivatives_of_position(point):
    r = kinematics.position(CHAIN, Q, POINTS[point])
    v = kinematics.velocity(CHAIN, Q, U, POINTS[point])
    a = kinematics.acceleration(CHAIN, Q, U, DU, POINTS[point])
    for axis in (0, 1):
        assert vanishes(v[axis] - time_derivative(r[axis]))
        assert vanishes(a[axis] - time_derivative(v[axis]))


@pytest.mark.parametrize("point", POINTS)
def test_partial_velocities_are_position_gradients(point):
    r = kinematics.position(CHAIN, Q, POINTS[point])
    v = kinematics.velocity(CHAIN, Q, U, POINTS[point])
    partial = kane.partial_velocities(CHAIN, Q, POINTS[point])
    gradient = lagrange.position_gradients(CHAIN, Q, POINTS[point])
    for speed in (0, 1):
        for axis in (0, 1):
            assert vanishes(partial[speed][axis] - sp.diff(v[axis], U[speed]))
            assert vanishes(gradient[speed][axis] - sp.diff(r[axis], Q[speed]))


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_mass_matrix_rate_less_twice_coriolis_is_skew(formulation):
    matrix = sp.Matrix(formulation.mass_matrix(CHAIN, Q))
    coriolis = sp.Matrix(formulation.coriolis_matrix(CHAIN, Q, U))
    skew = matrix.applyfunc(time_derivative) - 2 * coriolis
    assert all(vanishes(entry) for entry in skew + skew.T)
    terms = sp.Matrix(formulation.velocity_terms(CHAIN, Q, U))
    assert all(vanishes(entry) for entry in coriolis * sp.Matrix(U) - terms)


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_generalized_gravity_is_the_slope_of_the_potential(formulation):
    gravity = Gravity(GRAVITY[1])
    V = gravity.potential_energy(CHAIN, Q)
    loads = gravity.loads(CHAIN, Q, U)
    for r, active in enumerate(formulation.generalized_active_force(CHAIN, Q, loads)):
        assert vanishes(sp.diff(V, Q[r]) + active)


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_energy_changes_by_the_power_of_the_loads(formulation):
    """dT/dt = Q · u, whatever acts."""
    T = formulation.kinetic_energy(CHAIN, Q, U)
    torques = formulation.inverse_dynamics(CHAIN, Q, U, DU, LOADS)
    active = formulation.generalized_active_force(CHAIN, Q, LOADS)
    power = sum(u * (tau + a) for u, tau, a in zip(U, torques, active, strict=True))
    assert vanishes(time_derivative(T) - power)


def test_wrong_identities_do_not_vanish():
    assert not vanishes(sp.sin(Q[0] - Q[1]) - sp.sin(Q[1] - Q[0]))
    assert not vanishes(lagrange.kinetic_energy(CHAIN, Q, U) - U[0] ** 2)
