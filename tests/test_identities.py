"""Identities in float64, and derivatives against finite differences."""

import numpy as np
import pytest
from hypothesis import given

from tests.strategies import chains, states
from twolink import kane, kinematics, lagrange
from twolink.compilation import Compiled
from twolink.effects.gravity import Gravity
from twolink.loads import Force, Torque
from twolink.verification.states import States
from twolink.verification.tolerance import Problem, Scale, tolerance

GRAVITY = Gravity(9.81)

both = pytest.mark.parametrize("formulation", [kane, lagrange], ids=["kane", "lagrange"])
ordinary = chains(ratio=1.0)


def slopes(function, x, step=1e-6):
    """Central differences of a function of a pair: rows are outputs, columns inputs."""
    columns = []
    for k in (0, 1):
        h = np.zeros(2)
        h[k] = step
        ahead, behind = (np.array(function(tuple(np.array(x) + s * h))) for s in (1, -1))
        columns.append((ahead - behind) / (2 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.slow
@both
@given(chain=chains(), state=states())
def test_half_u_M_u_is_the_kinetic_energy(formulation, chain, state):
    M = np.array(formulation.mass_matrix(chain, state.q))
    T = formulation.kinetic_energy(chain, state.q, state.u)
    size = np.abs(state.u) @ np.abs(M) @ np.abs(state.u)
    assert abs(np.array(state.u) @ M @ state.u / 2 - T) <= 8 * np.finfo(float).eps * size


@pytest.mark.slow_but_first
@both
@given(chain=chains(), state=states())
def test_mass_matrix_is_symmetric_and_positive_definite(formulation, chain, state):
    (M11, M12), (M21, M22) = formulation.mass_matrix(chain, state.q)
    assert M12 == M21
    assert M11 > 0
    assert M22 > 0
    # M11 M22 − M12² would lose all digits here; the determinant does not.
    assert formulation.determinant(chain, state.q) > 0


@pytest.mark.slow
@both
@given(chain=chains(), state=states())
def test_inverse_and_forward_dynamics_undo_each_other(formulation, chain, state):
    def torques(q, u, du):
        loads = (*GRAVITY.loads(chain, q, u), Force(chain.D, state.force))
        return formulation.inverse_dynamics(chain, q, u, du, loads)

    def accelerations(q, u, tau):
        motors = (Torque(1, tau[0]), Torque(2, tau[1]))
        loads = (*GRAVITY.loads(chain, q, u), Force(chain.D, state.force), *motors)
        return formulation.forward_dynamics(chain, q, u, loads)

    tau = torques(state.q, state.u, state.du)
    du = accelerations(state.q, state.u, tau)
    # The forward dynamics' own rounding, and that of τ, which it passes on as it does its own.
    moment = Scale.of(chain, joint=False).levers(2, chain.L2)[:, 0] * np.abs(state.force).sum()
    problem = Problem(
        chain,
        Scale.of(chain, joint=False, gravity=GRAVITY.g),
        States(
            *(np.array(pair)[:, None] for pair in (state.q, state.u, state.du)),
            torques=(np.abs(tau) + moment)[:, None],
            end_force=np.zeros((2, 1)),
        ),
        roundings=Compiled(torques).depth + Compiled(accelerations).depth,
    )
    allowed = tolerance("forward dynamics", problem)[:, 0]
    assert np.all(np.abs(np.array(du) - state.du) <= allowed)


@pytest.mark.slow_but_first
@both
@given(chain=ordinary, state=states())
def test_generalized_gravity_is_the_slope_of_the_potential(formulation, chain, state):
    loads = GRAVITY.loads(chain, state.q, state.u)
    Q = np.array(formulation.generalized_active_force(chain, state.q, loads))
    slope = slopes(lambda q: GRAVITY.potential_energy(chain, q), state.q)
    scale = 9.81 * sum(chain.mass) * (sum(chain.length) + 10)
    assert slope == pytest.approx(-Q, abs=1e-8 * scale)


@pytest.mark.slow_but_first
@both
@given(chain=ordinary, state=states())
def test_jacobians_are_slopes_of_positions(formulation, chain, state):
    jacobian = {"kane": kane.partial_velocities, "lagrange": lagrange.position_gradients}[
        formulation.__name__.rpartition(".")[2]
    ]
    for point in (chain.C1, chain.C2, chain.B, chain.D):
        columns = np.array(jacobian(chain, state.q, point), dtype=float).T
        slope = slopes(lambda q, p=point: kinematics.position(chain, q, p), state.q)
        assert slope == pytest.approx(columns, abs=1e-8 * (sum(chain.length) * 3))


@pytest.mark.slow
@both
@given(chain=ordinary, state=states())
def test_mass_matrix_rate_less_twice_coriolis_is_skew(formulation, chain, state):
    u = np.array(state.u)
    rate = slopes(lambda q: formulation.mass_matrix(chain, q), state.q) @ u
    C = np.array(formulation.coriolis_matrix(chain, state.q, state.u))
    skew = rate - 2 * C
    assert skew + skew.T == pytest.approx(np.zeros((2, 2)), abs=1e-7 * (1 + np.abs(C).max()))
    terms = formulation.velocity_terms(chain, state.q, state.u)
    assert C @ u == pytest.approx(np.array(terms), rel=1e-9, abs=1e-12 * np.abs(C).max() * 20)


@pytest.mark.slow_but_first
@both
@given(chain=ordinary, state=states())
def test_energy_changes_by_the_power_of_nonconservative_loads(formulation, chain, state):
    """d(T + V)/dt = power of the end force and the torques: gravity is in V."""
    q, u = state.q, state.u
    others = (Force(chain.D, state.force), Torque(1, state.torque[0]), Torque(2, state.torque[1]))
    du = formulation.forward_dynamics(chain, q, u, (*GRAVITY.loads(chain, q, u), *others))

    def energy(q, u):
        return formulation.kinetic_energy(chain, q, u) + GRAVITY.potential_energy(chain, q)

    def rate(dq, du):
        """The derivative of the energy along a direction, by a complex step: exact."""
        q_stepped, u_stepped = (
            tuple(complex(x, dx * 1e-100) for x, dx in zip(pair, rates, strict=True))
            for pair, rates in ((q, dq), (u, du))
        )
        return energy(q_stepped, u_stepped).imag * 1e100

    parts = [rate((u[0], 0), (0, 0)), rate((0, u[1]), (0, 0)), rate((0, 0), du)]
    vx, vy = kinematics.velocity(chain, q, u, chain.D)
    powers = [state.force[0] * vx, state.force[1] * vy, *np.multiply(state.torque, u)]
    size = np.abs(parts).sum() + np.abs(powers).sum() + formulation.kinetic_energy(chain, q, u) * 20
    assert sum(parts) == pytest.approx(sum(powers), abs=1e-11 * size)
