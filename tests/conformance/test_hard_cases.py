"""The hard cases as a suite: the marks of `hardcases`, through the messages of the protocol."""

import math

import numpy as np
import pytest

from tests.conformance.mover import Mover
from tests.simulators import simulator_named
from twolink.conformance.contract import CannotError
from twolink.conformance.runner import conform
from twolink.conformance.suites import HARD_CASES, SUITES, VERIFY, items
from twolink.engines.attach import attach
from twolink.engines.in_process import InProcess
from twolink.engines.marks import Mark
from twolink.engines.quantities import QUANTITIES
from twolink.errors import ParameterError
from twolink.hardcases import Column
from twolink.hardcases.catalogue import CASES, case_named
from twolink.hardcases.run import outcome


class Sound(Mover):
    """Closed forms, which refuse angles and speeds that are not finite."""

    effects = ("joint_damping",)

    def forward_dynamics(self, angles, speeds, torques):
        if not np.isfinite([angles, speeds]).all() or np.abs(speeds).max() > 1e150:
            raise ValueError("angles and speeds must be finite, and their squares")
        return super().forward_dynamics(angles, speeds, torques)


def results(engine, *names):
    cases = tuple(case_named(name) for name in names)
    found = conform("engine", lambda: InProcess(engine), {HARD_CASES: cases})
    assert [result.id for result in found.results] == [f"{HARD_CASES}/{name}" for name in names]
    return [found.results[index] for index in range(len(names))]


def test_accelerations_at_hard_states():
    first, second = results(Sound(), "heavy-second-link", "folded")
    assert (first.mark, second.mark) == (Mark.PASS, Mark.PASS)
    assert first.quantity == "evaluation"


def test_a_wrong_engine_is_silently_wrong():
    class Half(Sound):
        def forward_dynamics(self, angles, speeds, torques):
            return super().forward_dynamics(angles, speeds, torques) / 2

    (found,) = results(Half(), "centre-off-the-axis")
    assert found.mark is Mark.SILENT
    assert found.factor > 1e6
    assert "expected" in found.said


def test_input_that_must_be_refused():
    (refused, other) = results(Sound(), "nan-angle", "scene-noise")
    assert refused.mark is Mark.PASS
    assert (other.mark, other.said) == (Mark.CANNOT, "scene files are this library's own")

    class Credulous(Mover):
        def forward_dynamics(self, angles, speeds, torques):
            return np.zeros_like(angles)

    (found,) = results(Credulous(), "nan-angle")
    assert found.mark is Mark.SILENT
    assert found.factor == math.inf


def test_a_motion_by_the_best_method():
    class Fine(Sound):
        """It is asked for a step of 0.1 ms; this is enough."""

        def move(self, request):
            return super().move(request.model_copy(update={"parameter": 2e-3}))

    (found,) = results(Fine(), "natural-start")
    assert found.quantity == "smooth"
    assert found.mark is Mark.PASS, found.said

    class Coarse(Sound):
        def move(self, request):
            return super().move(request.model_copy(update={"parameter": 5e-2}))

    (found,) = results(Coarse(), "natural-start")
    assert found.mark is Mark.SILENT
    assert "q or u is off by" in found.said


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("restitution-1", "the engine does not have surface"),
        ("coarsely-sampled-torque", "the protocol has no SampledTorque"),
    ],
)
def test_scenes_that_an_engine_cannot_express(name, words):
    (found,) = results(Sound(), name)
    assert (found.mark, found.said) == (Mark.CANNOT, words)


def test_a_question_that_is_skipped():
    class Shy(Sound):
        def forward_dynamics(self, angles, speeds, torques):
            raise CannotError("not today")

    (found,) = results(Shy(), "folded")
    assert (found.mark, found.said) == (Mark.CANNOT, "not today")


def test_an_answer_of_another_length_is_invalid():
    class Short(Sound):
        def forward_dynamics(self, angles, speeds, torques):
            return np.zeros(1)

    (found,) = results(Short(), "folded")
    assert found.mark is Mark.INVALID
    assert "must be 1 × 2 numbers; got 1" in found.said


def test_the_suite_runs_only_if_it_is_named():
    assert tuple(items(None)) == SUITES
    assert items([HARD_CASES]) == {HARD_CASES: CASES}
    assert items([VERIFY]) == {VERIFY: tuple(QUANTITIES)}
    with pytest.raises(ParameterError, match=r"suite must be one of .*hardcases, verify; got 'x'"):
        items(["x"])


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["heavy-second-link", "aligned", "tiny-chain", "denormal-state", "nan-angle"]
)
def test_marks_are_those_of_the_command_hardcases(name):
    """SciPy over Pinocchio, by the command and as a child that speaks the protocol."""
    engine = simulator_named("scipy")
    expected = outcome(case_named(name), Column(engine.name, engine))
    found = conform("scipy", attach("scipy"), {HARD_CASES: (case_named(name),)})
    assert found.results[0].mark is expected.mark
