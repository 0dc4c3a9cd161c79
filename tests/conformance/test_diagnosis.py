"""Each diagnosis fires for the engine that makes just its mistake, and for no right one."""

import numpy as np
import pytest

from tests.conformance.arm import Arm
from tests.conformance.wrong import FILES, USUAL, WRONG
from twolink.conformance.diagnosis import SENTENCES, causes, explanation
from twolink.conformance.runner import conform
from twolink.conformance.suites import SUITES, suite
from twolink.engines.in_process import InProcess
from twolink.engines.marks import Mark


def report(engine, groups):
    return conform(engine.name, lambda: InProcess(engine()), groups)


def few(files=(), usual=USUAL):
    """Return some groups: files of the import suite, and chains of the evaluation suite."""
    names = {f"import/{name}" for name in files} | {f"evaluation/{name}" for name in usual}
    found = {name: tuple(g for g in suite(name) if g.id in names) for name in SUITES}
    assert sum(map(len, found.values())) == len(names)
    return found


def check(name, groups):
    """The mistake explains every wrong number, and nothing else is found."""
    found = report(WRONG[name], groups)
    wrong = [result for result in found.failed if result.quantity != "read"]
    assert wrong
    assert {result.cause for result in wrong} == {name}, [
        (result.id, result.cause, result.said) for result in wrong if result.cause != name
    ]


def test_every_diagnosis_has_its_wrong_engine():
    # These two show in motions alone (`test_motion_diagnosis`).
    assert {*WRONG, "late-output", "springs-dropped"} == set(SENTENCES)
    assert len(WRONG) >= 20


@pytest.mark.slow
@pytest.mark.parametrize("name", WRONG)
def test_the_mistake_is_found(name):
    check(name, few(FILES[name]))


@pytest.mark.slow
@pytest.mark.parametrize("name", WRONG)
def test_the_mistake_is_found_in_all_suites(name):
    found = report(WRONG[name], {each: suite(each) for each in SUITES})
    counts = {cause: len(tests) for cause, tests in found.causes().items()}
    assert max(counts, key=lambda cause: counts[cause]) == name, counts


def test_the_right_engine_has_no_cause():
    found = report(Arm, few(("general", "lumped-several", "oblique-axes", "millimetres")))
    numbers = [result for result in found.results if result.quantity != "read"]
    assert {result.mark for result in numbers} == {Mark.PASS}
    assert found.causes() == {}


def test_random_errors_have_no_cause(random):
    """A random error of any size has no cause, however many mistakes are tried."""
    for group in few(("general",))["import"]:
        for vector in group.tests:
            truth = np.array(vector.values, dtype=float)
            for size in (1e-9, 1e-3, 1.0, 1e3):
                answer = truth + size * random.uniform(-1, 1, truth.shape) * np.abs(truth).max()
                found = causes(vector, group, answer, from_urdf=True, precision="binary64")
                assert found == (), (vector.id, size)


def test_certified_values_have_no_cause():
    for group in few(("plain",))["import"]:
        for vector in group.tests:
            answer = np.array(vector.values, dtype=float)
            assert causes(vector, group, answer, from_urdf=True, precision="binary64") == ()


def test_values_that_are_not_finite_have_no_cause():
    (group,) = few(("plain",), usual=())["import"]
    answer = np.full((6, 2, 2), np.nan)
    assert causes(group.tests[0], group, answer, from_urdf=True, precision="binary64") == ()


class Feather(Arm):
    """A body whose moments are zero weighs 1e-6 kg, as in SAPIEN 3.0.3, in binary32."""

    precision = "binary32"
    answers = ("velocity_terms", "gravity_terms")

    def own(self, mass, centre, tensor):
        return (mass, centre, tensor) if tensor.any() else (1e-6, centre, tensor)

    def rows(self, function, *inputs):
        return np.float32(super().rows(function, *inputs)).astype(float)


def test_answers_near_zero_are_those_of_mistakes_that_give_zero():
    """Angles in degrees give small velocity terms as well, and explain no gravity terms."""
    groups = few(usual=("point-masses",))
    found = report(Feather, groups)
    assert {result.quantity for result in found.failed} == {"read", *Feather.answers}
    assert set(found.causes()) == {"mass-dropped"}
    (group,) = groups["evaluation"]
    for vector in group.tests:
        if vector.quantity in Feather.answers:
            answer = 1e-6 * np.array(vector.values, dtype=float)
            names = causes(vector, group, answer, from_urdf=False, precision="binary32")
            assert set(names) <= {"mass-dropped", "gravity-missing", "velocity-terms-missing"}
            assert "mass-dropped" in names


def test_the_fewest_causes_that_explain_all_tests_are_chosen():
    found = {
        "a": ("factor-half", "gravity-sign"),
        "b": ("gravity-sign",),
        "c": ("negated", "gravity-sign"),
        "d": ("negated",),
        "e": (),
    }
    assert explanation(found) == {
        "a": "gravity-sign",
        "b": "gravity-sign",
        "c": "gravity-sign",
        "d": "negated",
    }
