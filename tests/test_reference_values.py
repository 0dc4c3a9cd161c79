"""Formulas in float64 against the same formulas at 50 digits, within the derived tolerance.

Chains have ratios of masses, lengths and inertias from 1e-6 to 1e6; states are general. The
parameters and states are the float64 numbers they are, also at 50 digits.
"""

import mpmath
import numpy as np
import pytest
from hypothesis import given

from tests.strategies import State, chains, states
from twolink import kane, kinematics, lagrange
from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.compilation import Compiled
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.loads import Force
from twolink.verification.states import States
from twolink.verification.tolerance import Problem, Scale, tolerance

G = 9.81


def inverse_dynamics(f, chain: Chain, q: Pair, u: Pair, du: Pair, force: Pair) -> Pair:
    loads = (*Gravity(G).loads(chain, q, u), Force(chain.D, force))
    return f.inverse_dynamics(chain, q, u, du, loads)


def forward_dynamics(f, chain: Chain, q: Pair, u: Pair, torque: Pair) -> Pair:
    loads = (*Gravity(G).loads(chain, q, u), *JointTorque(torque).loads(chain, q, u))
    return f.forward_dynamics(chain, q, u, loads)


# Name in `tolerance`, the formula, and the fields of the state it takes.
QUANTITIES = {
    "mass matrix": (lambda f, chain, q: f.mass_matrix(chain, q), ("q",)),
    "velocity terms": (lambda f, chain, q, u: f.velocity_terms(chain, q, u), ("q", "u")),
    "Coriolis matrix": (lambda f, chain, q, u: f.coriolis_matrix(chain, q, u), ("q", "u")),
    "kinetic energy": (lambda f, chain, q, u: f.kinetic_energy(chain, q, u), ("q", "u")),
    "inverse dynamics, force on D": (inverse_dynamics, ("q", "u", "du", "force")),
    "forward dynamics": (forward_dynamics, ("q", "u", "torque")),
}


def as_states(state: State, accelerations: np.ndarray) -> States:
    # JointTorque's reaction doubles the torque on link 1.
    torque = np.array([[abs(state.torque[0]) + 2 * abs(state.torque[1])], [abs(state.torque[1])]])
    return States(
        angles=np.array(state.q)[:, None],
        speeds=np.array(state.u)[:, None],
        accelerations=accelerations,
        torques=torque,
        end_force=np.array(state.force)[:, None],
    )


def share_of_tolerance(name: str, formulation, chain: Chain, state: State) -> float:
    """Return |float64 − 50 digits| in units of the tolerance, the largest entry."""
    formula, inputs = QUANTITIES[name]
    arguments = [getattr(state, field) for field in inputs]
    computed = np.array(formula(formulation, chain, *arguments), dtype=float)
    with mpmath.workdps(50):
        exact = np.array(
            formula(
                formulation,
                chain.convert(mpmath.mpf),
                *(tuple(map(mpmath.mpf, pair)) for pair in arguments),
            ),
            dtype=object,
        )
        error = np.array(np.abs(computed - exact), dtype=float)
    text = {
        1: lambda q: formula(formulation, chain, q),
        2: lambda q, u: formula(formulation, chain, q, u),
        3: lambda q, u, torque: formula(formulation, chain, q, u, torque),
        4: lambda q, u, du, force: formula(formulation, chain, q, u, du, force),
    }[len(inputs)]
    found = np.array(exact, dtype=float)[:, None] if name == "forward dynamics" else None
    problem = Problem(
        chain,
        Scale.of(chain, joint=False, gravity=G),
        as_states(state, np.array(state.du)[:, None] if found is None else found),
        roundings=Compiled(text).depth,
    )
    return float((error[..., None] / tolerance(name, problem)).max())


@pytest.mark.slow
@pytest.mark.parametrize("name", QUANTITIES)
@pytest.mark.parametrize("formulation", [kane, lagrange], ids=["kane", "lagrange"])
@given(chain=chains(), state=states())
def test_error_is_below_the_tolerance(name, formulation, chain, state):
    assert share_of_tolerance(name, formulation, chain, state) <= 1


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", QUANTITIES)
def test_the_tolerance_is_not_generous(name, random):
    """For ordinary chains it is below a thousand times the real loss."""
    worst = 0.0
    for _ in range(100):
        chain = Chain.uniform_bars(
            mass=tuple(random.uniform(0.5, 2, 2)), length=tuple(random.uniform(0.5, 2, 2))
        )
        pairs = (tuple(random.uniform(-5, 5, 2)) for _ in range(5))
        worst = max(worst, share_of_tolerance(name, kane, chain, State(*pairs)))
    assert worst > 1e-3


@given(chain=chains(), state=states())
def test_kinematics_error(chain, state):
    for name, point in (("C1", chain.C1), ("C2", chain.C2), ("D", chain.D)):
        computed = kinematics.acceleration(chain, state.q, state.u, state.du, point)
        with mpmath.workdps(50):
            exact = kinematics.acceleration(
                chain.convert(mpmath.mpf),
                *(tuple(map(mpmath.mpf, pair)) for pair in (state.q, state.u, state.du)),
                point,
            )
            errors = [float(abs(c - e)) for c, e in zip(computed, exact, strict=True)]
        problem = Problem(
            chain,
            Scale.of(chain, joint=False),
            as_states(state, np.array(state.du)[:, None]),
            roundings=8,
        )
        assert max(errors) <= tolerance(f"acceleration of {name}", problem).max()


def test_reference_mass_matrix_of_the_source():
    """The hand figures for m = L = 1: M = [[4/3, cos(q2−q1)/2], [·, 1/3]]."""
    with mpmath.workdps(50):
        chain = Chain.uniform_bars().convert(mpmath.mpf)
        q = (mpmath.mpf("0.3"), mpmath.mpf("-0.4"))
        half_cosine = mpmath.cos(mpmath.mpf("0.7")) / 2
        determinant = mpmath.mpf(7) / 36 + mpmath.sin(mpmath.mpf("0.7")) ** 2 / 4
        for f in (kane, lagrange):
            (M11, M12), (M21, M22) = f.mass_matrix(chain, q)
            for value, expected in (
                (M11, mpmath.mpf(4) / 3),
                (M12, half_cosine),
                (M21, half_cosine),
                (M22, mpmath.mpf(1) / 3),
                (f.determinant(chain, q), determinant),
            ):
                assert abs(value - expected) < mpmath.mpf("1e-48")
