"""A remote engine is the engine itself: values, capabilities, refusals, warnings and faults."""

import warnings

import numpy as np
import pytest

from tests.conformance.mover import Mover, Stuck, Unable
from twolink.conformance.suites import suite
from twolink.engines.contract import Engine
from twolink.engines.faults import CannotError, EngineFault, ModelRefusedError
from twolink.engines.in_process import InProcess
from twolink.engines.messages import Move
from twolink.engines.quantities import QUANTITIES
from twolink.engines.remote_engine import RemoteEngine
from twolink.engines.session import Session
from twolink.errors import EngineError

(GENERAL,) = (group for group in suite("evaluation") if group.id == "evaluation/general")
MODEL = GENERAL.request(("parameters",))
STATES = {
    "angles": np.array([[0.3, -0.7], [1.1, 0.2]]),
    "speeds": np.array([[0.1, 0.4], [-2.0, 1.0]]),
    "accelerations": np.array([[1.0, 2.0], [3.0, -4.0]]),
    "torques": np.array([[0.5, -0.5], [0.0, 1.5]]),
}
MOVE = Move(
    seq=0, test="x", angles=(0.3, -0.7), speeds=(0.0, 0.0), method="rk4", parameter=0.01,
    times=(0.0, 0.1),
)  # fmt: skip


def remote(engine):
    return RemoteEngine(Session(lambda: InProcess(engine), 60.0), "x")


def test_a_remote_engine_gives_the_answers_of_the_engine():
    here, there = Mover(), remote(Mover())
    assert (there.name, there.version, there.precision) == (here.name, here.version, "binary64")
    assert (there.reads, there.effects, there.methods) == (here.reads, here.effects, here.methods)
    assert there.answers == here.answers
    for engine in (here, there):
        engine.load(MODEL)
    for name in there.answers:
        ours, theirs = (engine.evaluate(name, STATES) for engine in (here, there))
        assert theirs.shape == QUANTITIES[name].shape_of_answer(2, from_urdf=False)
        assert (ours == theirs).all()
    assert here.move(MOVE).angles == there.move(MOVE).angles


def test_refusals_and_failures():
    class Fussy(Mover):
        def load(self, model):
            raise ModelRefusedError("not this one")

    with pytest.raises(ModelRefusedError, match="not this one"):
        remote(Fussy()).load(MODEL)
    stuck = remote(Stuck())
    stuck.load(MODEL)
    with pytest.raises(EngineError, match="RuntimeError: stuck") as caught:
        stuck.move(MOVE)
    assert "Traceback" in "".join(caught.value.__notes__)
    unable = remote(Unable())
    unable.load(MODEL)
    with pytest.raises(CannotError, match="only on weekdays"):
        unable.move(MOVE)
    with pytest.raises(CannotError, match="does not answer phase_of_the_moon"):
        unable.evaluate("phase_of_the_moon", STATES)


def test_warnings_are_kept_and_values_of_another_shape_are_refused():
    class Loud(Mover):
        def forward_dynamics(self, angles, speeds, torques):
            warnings.warn("overflow", RuntimeWarning, stacklevel=1)
            return super().forward_dynamics(angles, speeds, torques)

        def mass_matrix(self, angles):
            return np.zeros(3)

    engine = remote(Loud())
    engine.load(MODEL)
    engine.evaluate("forward_dynamics", STATES)
    assert engine.captured_warnings == ["RuntimeWarning: overflow"]
    with pytest.raises(EngineFault, match="must be 2 × 2 × 2 numbers; got 3"):
        engine.evaluate("mass_matrix", STATES)


def test_capabilities_decide_on_a_scene():
    from twolink.scene import Scene, scene_file

    drop, springs = (Scene.load(scene_file(name)) for name in ("drop", "modelica_double_pendulum"))

    class Plain(Engine):
        name, version, reads = "plain", "1", ("parameters",)

        def load(self, model):
            pass

    class Whole(Plain):
        reads = ("scene",)

    assert Plain().unsupported(drop) == "the engine has no motions of parameters"
    assert "the engine does not have surface" in (Mover().unsupported(drop) or "")
    assert Whole().unsupported(drop) is None
    damped = Mover()
    damped.effects = ("joint_damping",)
    assert damped.unsupported(springs) is None
