"""Curves of methods, by scene and by the kind of their setting."""

from dataclasses import replace

from tests.conformance.board import RIGHT, WRONG, result
from twolink.conformance.curves import by_parameter, curves_by_scene

MOTION = RIGHT[3]
OTHER = replace(MOTION, id="motion/springs/motion/bdf", quantity="motion: bdf")
COARSE = replace(OTHER, curve=replace(MOTION.curve, parameter="tolerance"))


def test_each_scene_has_the_curves_of_all_engines_and_methods():
    found = curves_by_scene([("one", [*WRONG, MOTION, OTHER]), ("two", [OTHER])])
    names = {scene: [each.name for each in curves] for scene, curves in found.items()}
    assert names == {"general": ["one, rk4"], "springs": ["one, bdf", "two, bdf"]}


def test_engines_and_methods_have_one_number_in_all_scenes():
    found = curves_by_scene([("none", WRONG), ("one", [MOTION, OTHER]), ("two", [OTHER])])
    numbers = [(each.number, each.method_number) for each in found["springs"]]
    assert numbers == [(0, 1), (1, 0)]


def test_engines_without_motions_have_no_curves():
    assert curves_by_scene([("wrong", [*WRONG, result("motion/general/motion")])]) == {}


def test_steps_and_tolerances_are_apart():
    (curves,) = curves_by_scene([("one", [OTHER]), ("two", [COARSE])]).values()
    found = by_parameter(curves)
    assert {kind: [each.engine for each in own] for kind, own in found.items()} == {
        "step": ["one"],
        "tolerance": ["two"],
    }
    assert list(by_parameter(curves[:1])) == ["step"]
