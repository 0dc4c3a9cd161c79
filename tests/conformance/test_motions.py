"""Motions of engines: their limits, and how they fail."""

import numpy as np
import pytest

from tests.conformance.arm import Arm
from tests.conformance.mover import (
    Exploding,
    Mover,
    Noisy,
    OtherGravity,
    Short,
    Unable,
    Undamped,
)
from twolink.conformance.in_process import InProcess
from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.hardcases import Mark


def results(engine, name="chrono-double-pendulum"):
    groups = tuple(group for group in suite("motion") if group.id == f"motion/{name}")
    found = conform("mover", lambda: InProcess(engine()), {"motion": groups})
    return {result.quantity: result for result in found.results}


def test_the_right_engine_converges_to_the_truth():
    found = results(Mover)
    assert found["motion: rk4"].mark is Mark.PASS
    assert found["motion: rk4"].said.startswith("converges to the truth, order 4.")
    assert found["motion: euler"].mark is Mark.PASS
    assert found["motion: euler"].said.startswith("converges to the truth, order 1.")
    assert found["motion: euler"].id == "motion/chrono-double-pendulum/motion/euler"


@pytest.mark.parametrize("name", ["general", "modelica-double-pendulum"])
def test_the_references_are_right(name):
    assert results(Mover, name)["motion: rk4"].mark is Mark.PASS


@pytest.mark.parametrize(
    ("engine", "name"),
    [(OtherGravity, "modelica-double-pendulum"), (Undamped, "modelica-double-pendulum")],
)
def test_another_model_is_told_apart(engine, name):
    found = results(engine, name)["motion: rk4"]
    assert found.mark is Mark.SILENT
    assert found.said.startswith("converges to another model, order ")


@pytest.mark.parametrize(
    ("engine", "mark", "words"),
    [
        (Noisy, Mark.MISSED, "does not converge"),
        (Exploding, Mark.MISSED, "does not converge"),
        (Short, Mark.INVALID, "wrong length: angles must be 6 rows; got 1"),
        (Unable, Mark.REFUSED, "only on weekdays"),
    ],
)
def test_failures(engine, mark, words):
    with np.errstate(all="ignore"):
        found = results(engine)["motion: rk4"]
    assert found.mark is mark
    assert words in found.said


def test_an_engine_without_methods_is_not_asked():
    found = results(Arm)
    assert {result.mark for result in found.values()} == {Mark.CANNOT}


def test_a_damped_motion_needs_damping():
    class Rigid(Mover):
        effects = ()

    found = results(Rigid, "modelica-double-pendulum")
    assert found["motion"].mark is Mark.CANNOT
    assert found["motion"].said == "the engine does not have joint_damping"
