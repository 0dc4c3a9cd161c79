"""Pinocchio under the contract of engines: it passes the vectors, and refuses other models."""

import numpy as np
import pytest

from tests.urdf.drawing import arm, at, joint, link
from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.engines.attach import attach
from twolink.engines.faults import ModelRefusedError
from twolink.engines.marks import Mark
from twolink.engines.messages import Model
from twolink.engines.pinocchio_engine import PinocchioEngine
from twolink.engines.quantities import QUANTITIES

NAMES = ("import/plain", "import/revolute", "import/two-half-bars")


def test_pinocchio_passes_the_vectors():
    groups = tuple(group for group in suite("import") if group.id in NAMES)
    found = conform("pinocchio", attach("pinocchio", in_process=True), {"import": groups})
    assert len(found.results) > 20
    assert {result.mark for result in found.results} == {Mark.PASS}


def test_it_answers_all_quantities():
    assert PinocchioEngine().answers == tuple(QUANTITIES)
    assert PinocchioEngine().version[0].isdigit()


@pytest.mark.parametrize(
    ("urdf", "joints", "words"),
    [
        ("<robot>", None, "XML"),
        ("plain", ("shoulder", "wrist"), "2 degrees of freedom"),
        ("plain", ("elbow", "shoulder"), "shoulder does not follow elbow"),
    ],
)
def test_models_that_are_refused(urdf, joints, words):
    (plain,) = (group for group in suite("import") if group.id == "import/plain")
    text = plain.urdf if urdf == "plain" else urdf
    with pytest.raises(ModelRefusedError, match=words):
        PinocchioEngine().load(Model(id="x", urdf=text, gravity=(0.0, 0.0, -9.81), joints=joints))


SAME_NAMES = {
    "a tip and its joint": (
        "hand",
        arm(wrist=joint("hand", "lower", "hand", "fixed", at("1 0 0"))),
    ),
    "D and its joint": (
        "D",
        arm(hand=link("D", ""), wrist=joint("D", "lower", "D", "fixed", at("1 0 0"))),
    ),
    "a tip and the world": (
        "universe",
        arm(
            hand=link("universe", ""),
            wrist=joint("wrist", "lower", "universe", "fixed", at("1 0 0")),
        ),
    ),
    "a joint and the world": ("hand", arm(shoulder=joint("universe", "ground", "upper"))),
}


@pytest.mark.parametrize(("tip", "urdf"), SAME_NAMES.values(), ids=SAME_NAMES)
def test_a_link_and_a_joint_may_have_one_name(tip, urdf):
    engine = PinocchioEngine()
    first = "universe" if 'joint name="universe"' in urdf else "shoulder"
    joints = (first, "elbow")
    engine.load(Model(id="x", urdf=urdf, gravity=(0.0, 0.0, -9.81), joints=joints, tip=tip))
    assert engine.position(np.zeros((1, 2))) == pytest.approx(np.array([[2.0, 0.0, 0.0]]))
    engine.load(Model(id="x", urdf=urdf, gravity=(0.0, 0.0, -9.81), joints=joints))
    assert engine.position(np.zeros((1, 2))) == pytest.approx(np.zeros((1, 3)))
