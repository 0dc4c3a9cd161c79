"""The checks can fail: each formula is broken in turn, and `verify` detects it.

Every sign, sine, cosine, factor, and every u1, q1, m1, C1, … of the texts of Kane, Lagrange and the
kinematics is changed, one at a time, for a general chain. A few changes have no effect; each is
listed with its reason.
"""

from dataclasses import replace

import numpy as np
import pytest

from tests.mutants import Mutant, mutants
from tests.verification.chains import GENERAL
from twolink import kane, kinematics, lagrange
from twolink.chain import Rotor
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.formulations import Formulation
from twolink.urdf import parse_planar_urdf
from twolink.verification import verify
from twolink.verification.jointspace import PlanarModel, PointMotion

STATES = 5

# Not part of an engine's answers; tests/test_proof.py derives them from T by SymPy.
PROVEN_INSTEAD = {"momenta"}

# Changes that change nothing: a sign before a zero, since ω2 does not depend on u1, nor ω1
# and v_C1 on u2.
EQUIVALENT = {
    ("generalized_inertia_force", "Add to Sub before omega1[1] * T_in1"),
    ("generalized_inertia_force", "Add to Sub before omega2[0] * T_in2"),
}


@pytest.fixture(scope="module")
def urdf():
    return parse_planar_urdf(GENERAL.to_urdf())


@pytest.fixture(scope="module")
def engine(urdf):
    return PinocchioChain(urdf)


def survivors(found, judge) -> list[str]:
    """Return the mutants that pass; one that cannot be evaluated counts as detected."""
    alive = []
    count = 0
    for mutant in found:
        count += 1
        try:
            with np.errstate(all="ignore"):
                passed = judge(mutant)
        except (NameError, AttributeError, ZeroDivisionError, TypeError):
            passed = False
        if passed:
            alive.append(str(mutant))
    assert count > 20, count
    return alive


def skip(function: str, line: str, change: str) -> bool:
    return function in PROVEN_INSTEAD or (function, change) in EQUIVALENT


WITH_ROTORS = replace(GENERAL, rotors=(Rotor(0.7, (1.2, 0.4)), Rotor(0.9, (-1.3, 2.1))))


def agree_with_rotors(broken, other) -> bool:
    """Whether two texts agree on a chain with rotors, which a URDF and so `verify` cannot hold."""
    chain = WITH_ROTORS
    states = np.random.default_rng(3).uniform(-2, 2, (5, 3, 2)).tolist()
    for q, u, du in states:
        (M11, M12), (M21, M22) = other.mass_matrix(chain, q)
        pairs = [
            (broken.mass_matrix(chain, q), ((M11, M12), (M21, M22))),
            (broken.determinant(chain, q), M11 * M22 - M12 * M21),
            (broken.kinetic_energy(chain, q, u), other.kinetic_energy(chain, q, u)),
            (
                broken.inverse_dynamics(chain, q, u, du, ()),
                other.inverse_dynamics(chain, q, u, du, ()),
            ),
            (
                broken.forward_dynamics(chain, q, u, ()),
                other.forward_dynamics(chain, q, u, ()),
            ),
        ]
        if not all(np.allclose(ours, theirs, rtol=1e-10, atol=1e-10) for ours, theirs in pairs):
            return False
    return True


@pytest.mark.slow
def test_every_mutant_of_kane_is_detected(urdf, engine):
    def judge(mutant: Mutant) -> bool:
        formulation = Formulation("Kane", mutant.module, mutant.module.partial_velocities)
        broken = {"kane": formulation}
        # The cheaper of the two comes first: most mutants fail both.
        return (
            agree_with_rotors(mutant.module, lagrange)
            and verify(urdf, states=STATES, formulations=broken, engine=engine).passed
        )

    assert survivors(mutants(kane, skip), judge) == []


@pytest.mark.slow
def test_every_mutant_of_lagrange_is_detected(urdf, engine):
    def judge(mutant: Mutant) -> bool:
        formulation = Formulation("Lagrange", mutant.module, mutant.module.position_gradients)
        broken = {"lagrange": formulation}
        # The cheaper of the two comes first: most mutants fail both.
        return (
            agree_with_rotors(mutant.module, kane)
            and verify(urdf, states=STATES, formulations=broken, engine=engine).passed
        )

    assert survivors(mutants(lagrange, skip), judge) == []


@pytest.mark.slow
def test_every_mutant_of_the_kinematics_is_detected(urdf, engine):
    model = PlanarModel(GENERAL, urdf.joints, urdf.gravity)

    def judge(mutant: Mutant) -> bool:
        motion = PointMotion(model, mutant.module)
        return verify(urdf, states=STATES, formulations={}, engine=engine, motion=motion).passed

    assert survivors(mutants(kinematics, skip), judge) == []


def printed_slip(chain, q, u):
    """T2 as printed in the textbook, with ω1 where ω2 is meant."""
    T1, T2 = lagrange.kinetic_energies(chain, q, u)
    return T1 + T2 + chain.I_C2 * (u[0] * u[0] - u[1] * u[1]) / 2


def test_the_printed_slip_is_detected(urdf, engine, monkeypatch):
    monkeypatch.setattr(lagrange, "kinetic_energy", printed_slip)
    verdict = verify(urdf, states=STATES, engine=engine)
    failed = {(c.quantity, c.source) for c in verdict.comparisons if not c.passed}
    assert failed == {("kinetic energy", "Lagrange"), ("kinetic energy", "Kane")}
    assert not verdict.passed
    assert "disagree" in verdict.sentence


@pytest.mark.slow_but_first
@pytest.mark.parametrize("factor", [1 + 1e-10, -1, 0.5])
def test_a_factor_on_the_mass_matrix_is_detected(urdf, engine, monkeypatch, factor):
    right = kane.mass_matrix

    def wrong(chain, q):
        (M11, M12), (M21, M22) = right(chain, q)
        return (M11, M12 * factor), (M21 * factor, M22)

    monkeypatch.setattr(kane, "mass_matrix", wrong)
    verdict = verify(urdf, states=STATES, engine=engine)
    failed = {c.quantity for c in verdict.comparisons if not c.passed}
    assert {"mass matrix", "forward dynamics", "kinetic energy"} <= failed


def test_a_wrong_gravity_is_detected(urdf, engine):
    """9.81 against 9.80665."""
    other = parse_planar_urdf(GENERAL.to_urdf(), gravity=(0, 0, -9.80665))
    verdict = verify(other, states=STATES, engine=engine)
    failed = {c.quantity for c in verdict.comparisons if not c.passed}
    assert {"gravity terms", "inverse dynamics", "forward dynamics", "potential energy"} <= failed
    assert "mass matrix" not in failed


def test_nan_is_detected(urdf, engine, monkeypatch):
    monkeypatch.setattr(kane, "kinetic_energy", lambda chain, q, u: u[0] / (u[0] - u[0]))
    with pytest.warns(RuntimeWarning):
        assert not verify(urdf, states=STATES, engine=engine).passed


def test_infinity_is_detected(urdf, engine, monkeypatch):
    """The tolerance of accelerations grows with those found: infinite ones are not within it."""
    monkeypatch.setattr(
        kane, "forward_dynamics", lambda chain, q, u, loads: (q[0] / (q[0] - q[0]), q[1])
    )
    with pytest.warns(RuntimeWarning):
        verdict = verify(urdf, states=STATES, engine=engine)
    failed = {(c.quantity, c.against) for c in verdict.comparisons if not c.passed}
    assert {("forward dynamics", engine.name), ("forward dynamics", "Lagrange")} <= failed
