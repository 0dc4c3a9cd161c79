"""Motions of engines: their limits, and how they fail."""

import numpy as np
import pytest

from tests.conformance.arm import Arm
from tests.conformance.mover import (
    Exploding,
    Mover,
    Noisy,
    NoStaticFriction,
    OtherGravity,
    OtherRestitution,
    Ours,
    Short,
    StepTooMany,
    Stiff,
    Stuck,
    Unable,
    Undamped,
    Unsprung,
    Warning,
    WarningOnModel,
)
from twolink.conformance.convergence import Limit
from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.engines.in_process import InProcess
from twolink.engines.marks import Mark


def results(engine, name="motion/chrono-double-pendulum"):
    kind = name.partition("/")[0]
    groups = tuple(group for group in suite(kind) if group.id == name)
    found = conform("mover", lambda: InProcess(engine()), {kind: groups})
    return {result.quantity: result for result in found.results}


def test_the_right_engine_converges_to_the_truth():
    found = results(Mover)
    assert found["motion: rk4"].mark is Mark.PASS
    assert found["motion: rk4"].said.startswith("converges to the truth, order 4.")
    assert found["motion: euler"].mark is Mark.PASS
    assert found["motion: euler"].said.startswith("converges to the truth, order 1.")
    assert found["motion: euler"].id == "motion/chrono-double-pendulum/motion/euler"


def test_a_step_too_many_shows_by_the_order_that_the_engine_names():
    found = results(StepTooMany)
    assert found["motion: rk4"].mark is Mark.MISSED
    assert found["motion: rk4"].said.startswith("converges to the truth, order 1.")
    assert found["motion: rk4"].said.endswith("; the engine names order 4")
    # With this order it is not told apart from a right method.
    assert found["motion: euler"].mark is Mark.PASS


def test_a_motion_keeps_its_settings_and_errors():
    curve = results(Mover)["motion: euler"].curve
    assert curve.parameter == "step"
    assert curve.settings == (0.01, 0.005, 0.0025, 0.00125, 0.000625, 0.0003125)
    assert curve.verdict.errors[0] > 20 * curve.verdict.errors[-1]
    assert curve.verdict.limit is Limit.TRUTH


@pytest.mark.slow
def test_a_method_of_first_order_has_more_steps_where_six_do_not_show_where_it_goes():
    found = results(Mover, "motion/modelica-double-pendulum")["motion: euler"]
    assert found.mark is Mark.PASS
    assert len(found.curve.settings) == 7
    assert found.said.startswith("converges to the truth, order 0.9")


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", ["motion/general", "motion/modelica-double-pendulum"])
def test_the_references_are_right(name):
    assert results(Mover, name)["motion: rk4"].mark is Mark.PASS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "name"),
    [
        (OtherGravity, "motion/modelica-double-pendulum"),
        (Undamped, "motion/modelica-double-pendulum"),
    ],
)
def test_convergence_to_another_model_is_reported(engine, name):
    found = results(engine, name)["motion: rk4"]
    assert found.mark is Mark.SILENT
    assert found.said.startswith("converges to another model, order ")


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("engine", "mark", "words"),
    [
        (Noisy, Mark.MISSED, "does not converge"),
        (Exploding, Mark.MISSED, "does not converge"),
        (Short, Mark.INVALID, "wrong length: angles must be 6 rows; got 1"),
        (Stuck, Mark.REFUSED, "RuntimeError: stuck"),
    ],
)
def test_each_failure_of_a_motion_has_its_mark(engine, mark, words):
    with np.errstate(all="ignore"):
        found = results(engine)["motion: rk4"]
    assert found.mark is mark
    assert words in found.said


def test_a_skipped_motion_is_marked_as_unsupported():
    found = results(Unable)["motion: rk4"]
    assert found.mark is Mark.CANNOT
    assert found.said == "only on weekdays"


def test_instability_at_coarse_steps_does_not_count():
    with np.errstate(all="ignore"):
        found = results(Stiff)["motion: rk4"]
    assert not np.isfinite(found.curve.verdict.errors[:2]).any()
    assert found.mark is Mark.PASS
    assert found.said.startswith("converges to the truth, order 4.")


def test_motions_of_an_engine_without_methods_are_skipped():
    found = results(Arm)
    assert {result.mark for result in found.values()} == {Mark.CANNOT}


def test_a_damped_motion_needs_damping():
    class Rigid(Mover):
        effects = ()

    found = results(Rigid, "motion/modelica-double-pendulum")
    assert found["motion"].mark is Mark.CANNOT
    assert found["motion"].said == "the engine does not have joint_damping"


QUICK = ("motion/springs", "impact/floor")
REST = [
    pytest.param(group.id, marks=pytest.mark.slow)
    for name in ("friction", "impact")
    for group in suite(name)
    if group.id not in QUICK
]


@pytest.mark.parametrize("name", [*QUICK, *REST])
def test_the_library_agrees_with_references_of_springs_friction_and_impacts(name):
    """By another precision and order than the references."""
    found = results(Ours, name)["motion: taylor"]
    assert found.mark is Mark.PASS, found.said


@pytest.mark.parametrize(
    ("engine", "name"),
    [
        (OtherRestitution, "impact/floor"),
        pytest.param(OtherRestitution, "impact/rough-floor", marks=pytest.mark.slow),
        pytest.param(OtherRestitution, "friction/stops", marks=pytest.mark.slow),
        pytest.param(NoStaticFriction, "friction/stick-slip", marks=pytest.mark.slow),
        pytest.param(Unsprung, "motion/springs", marks=pytest.mark.slow),
    ],
)
def test_another_law_of_contact_is_another_model(engine, name):
    found = results(engine, name)["motion: taylor"]
    assert found.mark is Mark.SILENT
    assert found.said.startswith("converges to another model")


def test_a_law_that_the_engine_names_is_not_silent():
    found = results(Warning, "impact/floor")["motion: taylor"]
    assert found.mark is Mark.MISSED
    assert found.warnings == ("another law",)


def test_a_warning_on_the_model_keeps_its_motions_from_being_silent():
    found = results(WarningOnModel, "impact/floor")["motion: taylor"]
    assert found.mark is Mark.MISSED
    assert found.warnings == ("UserWarning: another law",)


def test_parameters_of_effects_are_sent_only_to_engines_that_have_them():
    loaded = []

    class Rigid(Mover):
        def load(self, model):
            loaded.append(model.id)
            return super().load(model)

    found = results(Rigid, "impact/floor")
    assert loaded == []
    assert {result.mark for result in found.values()} == {Mark.CANNOT}
    assert found["motion"].said == "the engine does not have surface"
