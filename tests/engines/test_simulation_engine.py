"""Simulators under test: forward dynamics and motions, through the same messages as any engine."""

import pytest

from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.engines.attach import attach, python_engine
from twolink.engines.marks import Mark
from twolink.engines.registry import SIMULATORS
from twolink.engines.scipy_pinocchio import ScipyOverPinocchio
from twolink.errors import EngineError

GROUPS = {
    "evaluation": tuple(
        g for g in suite("evaluation") if g.id in ("evaluation/general", "evaluation/damped")
    ),
    "motion": suite("motion")[1:2],
}


def results(name):
    found = conform(name, attach(name, memory=2**33, in_process=True), GROUPS, seconds=120.0)
    return {result.id: result for result in found.results}


def check(found):
    """Rigid accelerations and all motions agree, and damping is not asked for."""
    assert found["evaluation/general/forward-dynamics"].mark is Mark.PASS
    assert found["evaluation/damped/forward-dynamics"].mark is Mark.CANNOT
    motions = [result for result in found.values() if result.quantity.startswith("motion: ")]
    assert motions
    assert [(each.id, each.said) for each in motions if not each.passed] == []


def test_scipy_over_pinocchio():
    check(results("scipy"))


@pytest.mark.engines
@pytest.mark.parametrize("name", ["mujoco", "pybullet"])
def test_other_simulators(name):
    check(results(name))


def test_a_simulator_whose_package_is_missing(monkeypatch):
    monkeypatch.setattr(ScipyOverPinocchio, "packages", (("no-such-package", "no_such_package"),))
    with pytest.raises(EngineError, match="which is not installed"):
        python_engine("twolink.engines.scipy_pinocchio:ScipyOverPinocchio")


def test_capabilities_are_those_of_the_simulator():
    engine = ScipyOverPinocchio()
    assert engine.reads == ("parameters", "scene", "urdf")
    assert engine.answers == ("mass_matrix", "forward_dynamics")
    assert engine.effects == ("joint_damping", "joint_spring")
    assert {method.name for method in engine.methods} >= {"DOP853"}
    assert {method.parameter for method in engine.methods} == {"tolerance"}


@pytest.mark.parametrize("engine", SIMULATORS, ids=lambda engine: engine.name)
def test_each_simulator_has_damping(engine):
    from twolink.scene import Scene
    from twolink.scene.names import scene_file

    assert engine.unsupported(Scene.load(scene_file("modelica_double_pendulum"))) is None
