from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

from tests.conftest import SEED
from tests.strategies import chains
from tests.verification.chains import GENERAL
from twolink import limits
from twolink.chain import Chain
from twolink.data import data_path
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.errors import ParameterError, TooMuchError, UrdfError
from twolink.formulations import FORMULATIONS
from twolink.urdf import parse_planar_urdf, read_planar_urdf
from twolink.verification import verify
from twolink.verification.contact import verify_contact
from twolink.verification.quantities import DYNAMICS, MOTION
from twolink.verification.states import random_states

SHIPPED = read_planar_urdf(data_path("twolink.urdf"))


@pytest.mark.slow
def test_the_shipped_urdf_agrees_on_ten_thousand_states():
    shares = []
    verdict = verify(SHIPPED, states=10_000, seed=SEED, progress=shares.append)
    assert verdict.passed, verdict.sentence
    assert len(verdict.comparisons) == 3 * len(DYNAMICS) + len(MOTION)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1)


@pytest.mark.slow
@given(chain=chains())
@settings(max_examples=25)
def test_random_chains_agree_through_a_urdf(chain):
    """Written to URDF and read back, by us and by Pinocchio; ratios from 1e-6 to 1e6."""
    verdict = verify(parse_planar_urdf(chain.to_urdf()), states=400, seed=SEED)
    assert verdict.passed, verdict.sentence


@pytest.mark.slow
def test_random_chains_agree_on_ten_thousand_states(random):
    for _ in range(5):
        chain = Chain(
            mass=tuple(random.uniform(0.1, 10, 2)),
            length=tuple(random.uniform(0.1, 3, 2)),
            centre=tuple((float(a), float(b)) for a, b in random.uniform(-1, 1, (2, 2))),
            inertia=tuple(random.uniform(0.01, 2, 2)),
        )
        verdict = verify(parse_planar_urdf(chain.to_urdf()), states=10_000, seed=SEED)
        assert verdict.passed, verdict.sentence


@pytest.mark.slow
def test_an_ill_conditioned_chain_drawn_bent_and_turning_backwards():
    """Its condition is that of the elbow angle, not of the URDF's joint angle."""
    text = Chain((1e-5, 1.0), (1.0, 1.0), ((1.0, 0.0), (1.0, 0.0)), (0.0, 0.0)).to_urdf()
    second = text.index('<joint name="joint2"')
    bent = text[second:].replace('xyz="1.0 0 0.0"', 'xyz="1.0 0 0.0" rpy="0 1.3 0"', 1)
    bent = bent.replace('xyz="0 1 0"', 'xyz="0 -1 0"', 1)
    drawn = parse_planar_urdf(text[:second] + bent)
    assert drawn.joints.sign == (1, -1)
    assert drawn.joints.offset[1] == pytest.approx(1.3)
    verdict = verify(drawn, states=20_000, seed=SEED)
    assert verdict.passed, verdict.sentence


def test_a_revolute_model_agrees_with_a_continuous_one():
    """`continuous` has nq = 2 a joint in Pinocchio, `revolute` 1: both load, and agree."""
    limit = '<limit lower="-7" upper="7" effort="1" velocity="1"/>'
    text = SHIPPED.xml.replace('type="continuous">', f'type="revolute">{limit}')
    revolute = parse_planar_urdf(text)
    assert PinocchioChain(revolute).model.nq == 2
    assert PinocchioChain(SHIPPED).model.nq == 4
    verdict = verify(revolute, states=1000, seed=SEED)
    assert verdict.passed, verdict.sentence


def test_damping_in_the_file_is_not_applied():
    """Pinocchio reads <dynamics> and its RNEA leaves it out; so do we, unless a scene asks."""
    text = SHIPPED.xml.replace(
        '<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><dynamics damping="5" friction="3"/>'
    )
    damped = parse_planar_urdf(text)
    assert list(PinocchioChain(damped).model.damping) == [5, 5]
    assert verify(damped, states=100, seed=SEED).passed


def test_the_worst_state_reproduces_the_difference():
    verdict = verify(SHIPPED, states=300, seed=SEED)
    worst = next(c for c in verdict.comparisons if c.quantity == "mass matrix")
    angles = np.array(worst.state["angles"])[:, None]
    theirs = PinocchioChain(SHIPPED).evaluate("mass_matrix", angles=angles)
    from twolink import kane

    q = SHIPPED.joints.absolute_angles(tuple(map(float, angles[:, 0])))
    M = kane.mass_matrix(Chain.from_links(SHIPPED.links), q)
    ours = np.array(SHIPPED.joints.joint_matrix(M))
    difference = np.abs(ours - theirs[..., 0]).max()
    # One state is computed with the C library's sine, many with NumPy's tangent.
    assert difference == pytest.approx(worst.difference, abs=4 * np.finfo(float).eps)


def test_one_formulation_alone():
    verdict = verify(SHIPPED, states=10, formulations={"kane": FORMULATIONS["kane"]})
    assert {c.source for c in verdict.comparisons} == {"Kane", "twolink's kinematics"}


@pytest.mark.slow
def test_the_same_seed_gives_the_same_verdict():
    first, second = (verify(SHIPPED, states=50, seed=7) for _ in range(2))
    assert first == second
    assert verify(SHIPPED, states=50, seed=8).comparisons != first.comparisons


@pytest.mark.parametrize("states", [0, -5])
def test_no_states_are_refused(states):
    with pytest.raises(ParameterError, match="states must be a whole number of 1 or more; got"):
        verify(SHIPPED, states=states)


@pytest.mark.parametrize("compare", [verify, verify_contact])
def test_too_many_states_are_refused_on_the_way(compare, monkeypatch):
    monkeypatch.setattr(limits, "_WINDOW", 0.01)
    monkeypatch.setattr(limits, "_READING", 0.0)
    with pytest.raises(TooMuchError, match=r"comparing at 10{15} states would take .* years"):
        compare(SHIPPED, states=10**15)


def test_states_are_general():
    states = random_states(10_000, seed=SEED)
    for field in (states.angles, states.speeds, states.accelerations, states.torques):
        assert field.shape == (2, 10_000)
        assert np.all(field != 0)
        assert np.all(field[0] != field[1])


@pytest.mark.slow
def test_the_shipped_urdf_is_the_default_and_a_path_will_do(tmp_path):
    by_default = verify(states=50, seed=SEED)
    assert by_default.comparisons == verify(SHIPPED, states=50, seed=SEED).comparisons
    file = tmp_path / "arm.urdf"
    GENERAL.to_urdf(file)
    for path in (file, str(file)):
        verdict = verify(path, states=50, seed=SEED)
        assert verdict.passed
        assert verdict.urdf == str(file)
    with pytest.raises(UrdfError, match="there is no file of this name"):
        verify(tmp_path / "nowhere.urdf")


def test_three_formulations_are_compared_with_each_other():
    three = {**FORMULATIONS, "third": replace(FORMULATIONS["kane"], name="Third")}
    verdict = verify(SHIPPED, states=3, formulations=three)
    dynamics = [c for c in verdict.comparisons if c.quantity == "mass matrix"]
    assert verdict.passed
    assert len(dynamics) == 3 + 3
