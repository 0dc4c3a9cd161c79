"""Motions of wrong engines, by the mistakes that explain them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.conformance.arm import Arm
from tests.conformance.mover import NoStaticFriction, Ours, Unsprung
from tests.conformance.wrong import WRONG, T
from twolink.conformance import motions
from twolink.conformance.motion_diagnosis import MotionDiagnosis
from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.engines.in_process import InProcess
from twolink.engines.marks import Mark
from twolink.engines.messages import Method, Moved

# Mistakes in the accelerations of an engine that show in a damped motion.
SHOWN = [
    "gravity-sign", "gravity-missing", "gravity-default", "gravity-units", "damping-dropped",
    "damping-sign", "damping-exchanged", "absolute-damper", "links-exchanged", "length-of-other",
    "centre-on-other-side", "inertia-about-joint", "inertia-missing",
    "velocity-terms-missing", "velocity-terms-sign", "coriolis-term", "decoupled", "degrees-in",
    "absolute-angles",
]  # fmt: skip


DIAGNOSES = {}


@pytest.fixture(autouse=True)
def shared_diagnoses(monkeypatch):
    """Follow the motion of a mistake once for all tests of a motion."""

    def diagnosis(motion, group):
        return DIAGNOSES.setdefault(motion.id, MotionDiagnosis(motion, group))

    monkeypatch.setattr(motions, "MotionDiagnosis", diagnosis)


def moving(kind):
    """Return an engine whose motions follow the accelerations of another one."""

    class Moving(kind):
        reads = ("parameters",)
        methods = (Method(name="dop853", parameter="tolerance"),)

        def move(self, request):
            tolerance = request.parameter
            found = solve_ivp(
                self.rates, request.times[:: len(request.times) - 1],
                [*request.angles, *request.speeds], "DOP853",
                rtol=tolerance, atol=tolerance / 100, t_eval=request.times,
            )  # fmt: skip
            rows = self.shown(found.y.T).tolist()
            return Moved(
                seq=request.seq,
                angles=tuple((a, b) for a, b, _, _ in rows),
                speeds=tuple((c, d) for _, _, c, d in rows),
            )

        def rates(self, t, x):
            angles, speeds = x[None, :2], x[None, 2:]
            (found,) = self.forward_dynamics(angles, speeds, np.zeros((1, 2)))
            return [*x[2:], *found]

        def shown(self, rows):
            return rows

    return Moving


class Late(moving(Arm)):
    def shown(self, rows):
        return np.vstack([rows[:1], rows[:-1]])


class Absolute(moving(Arm)):
    def shown(self, rows):
        return rows @ np.kron(np.eye(2), np.linalg.inv(T)).T


class Degrees(moving(Arm)):
    def shown(self, rows):
        return np.degrees(rows)


class Exchanged(moving(Arm)):
    def shown(self, rows):
        return rows[:, [1, 0, 3, 2]]


class Negated(moving(Arm)):
    def shown(self, rows):
        return -rows


class Single(moving(Arm)):
    def shown(self, rows):
        return rows.astype(np.float32).astype(float)


class ReadAbsolute(moving(Arm)):
    """Angles and speeds of links are read and shown in place of those of joints."""

    def move(self, request):
        (first, second), (one, two) = request.angles, request.speeds
        given = {"angles": (first, second - first), "speeds": (one, two - one)}
        return super().move(request.model_copy(update=given))

    def shown(self, rows):
        return rows @ np.kron(np.eye(2), np.linalg.inv(T)).T


def result(engine, name="motion/dampers"):
    kind = name.partition("/")[0]
    groups = tuple(group for group in suite(kind) if group.id == name)
    found = conform("mover", lambda: InProcess(engine()), {kind: groups})
    return found.results[-1]


# The first of them finds the answers that each mistake gives, in ten seconds.
@pytest.mark.slow
@pytest.mark.parametrize("name", SHOWN)
def test_a_motion_shows_the_mistake_of_its_engine(name):
    found = result(moving(WRONG[name]))
    assert found.mark is Mark.SILENT
    assert found.cause == name, found.causes


@pytest.mark.parametrize(
    ("engine", "cause"),
    [
        (Late, "late-output"),
        *(
            pytest.param(*one, marks=pytest.mark.slow)
            for one in (
                (Absolute, "absolute-answers"),
                (Degrees, "degrees-out"),
                (Exchanged, "joints-exchanged"),
                (Negated, "negated"),
                (ReadAbsolute, "absolute-angles"),
            )
        ),
    ],
)
def test_a_mistake_in_the_output_is_named(engine, cause):
    found = result(engine)
    assert found.mark is Mark.SILENT
    assert found.cause == cause


@pytest.mark.slow
def test_numbers_of_binary32_are_named():
    assert result(Single, "motion/general").cause == "binary32"


@pytest.mark.slow
def test_springs_that_do_not_act_are_named():
    assert result(Unsprung, "motion/springs").cause == "springs-dropped"


@pytest.mark.parametrize(
    ("change", "cause"), [(Late.shown, "late-output"), (Single.shown, "binary32")]
)
def test_motions_with_events_show_mistakes_in_the_output(change, cause):
    """Those in the forces are not looked for."""
    (group,) = (group for group in suite("impact") if group.id == "impact/floor")
    (motion,) = group.motions
    start = [*motion.angles, *motion.speeds]
    rows = np.vstack([start, np.array(motion.values, dtype=float)])
    shown = change(None, rows)[1:]
    assert MotionDiagnosis(motion, group).causes(shown, 1e-9, "binary64") == (cause,)
    random = rows[1:] + 0.1 * np.sin(np.arange(rows[1:].size)).reshape(rows[1:].shape)
    assert MotionDiagnosis(motion, group).causes(random, 1e-9, "binary64") == ()


@pytest.mark.slow
def test_another_law_of_friction_has_no_cause():
    found = result(NoStaticFriction, "friction/stick-slip")
    assert found.mark is Mark.SILENT
    assert found.causes == ()


def test_right_and_unknown_motions_have_no_cause(random):
    (group,) = (group for group in suite("motion") if group.id == "motion/dampers")
    (motion,) = group.motions
    truth = np.array(motion.values, dtype=float)
    diagnosis = motions.MotionDiagnosis(motion, group)
    assert diagnosis.causes(truth, 0.0, "binary64") == ()
    assert diagnosis.causes(truth * np.nan, 0.0, "binary64") == ()
    for size in (1e-6, 0.01, 1.0):
        wrong = truth + size * random.uniform(-1, 1, truth.shape)
        assert diagnosis.causes(wrong, 0.0, "binary64") == ()


def test_a_motion_that_still_changes_has_no_cause():
    """Its error may be that of its step."""
    (group,) = (group for group in suite("motion") if group.id == "motion/dampers")
    (motion,) = group.motions
    wrong = -np.array(motion.values, dtype=float)
    diagnosis = motions.MotionDiagnosis(motion, group)
    assert diagnosis.causes(wrong, 1e-3, "binary64") == ("negated",)
    assert diagnosis.causes(wrong, np.abs(2 * wrong).max() / 5, "binary64") == ()


def test_the_right_motion_passes():
    found = result(moving(Arm))
    assert found.mark is Mark.PASS
    assert result(Ours, "motion/dampers").mark is Mark.PASS
