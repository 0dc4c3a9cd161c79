"""The judge: marks, factors and digits, in each precision and frame."""

import functools
import math

import numpy as np
import pytest

from twolink.conformance.judge import judged
from twolink.conformance.suites import suite
from twolink.engines.marks import Mark


@functools.cache
def general():
    """Return the group, whose values take a while, and its tests by quantity."""
    group = next(group for group in suite("evaluation") if group.id == "evaluation/general")
    return group, {test.quantity: test for test in group.tests}


def truth(name):
    return np.array(general()[1][name].values, dtype=float)


def bound(name):
    return np.array(general()[1][name].bound)


def found(name, values, **how):
    group, tests = general()
    return judged(tests[name], group, np.asarray(values, dtype=float), from_urdf=False, **how)


@pytest.mark.parametrize("name", ["mass_matrix", "forward_dynamics", "kinetic_energy"])
def test_certified_values_pass_with_all_digits(name):
    judgement = found(name, truth(name))
    assert judgement.mark is Mark.PASS
    assert judgement.factor < 0.01
    assert judgement.digits > 15.5


@pytest.mark.parametrize(
    ("times", "mark"), [(0.9, Mark.PASS), (1.2, Mark.MISSED), (9, Mark.MISSED), (11, Mark.SILENT)]
)
def test_marks_follow_the_bound(times, mark):
    values = truth("mass_matrix")
    values[2, 1, 1] += times * bound("mass_matrix")[2, 1, 1]
    judgement = found("mass_matrix", values)
    assert judgement.mark is mark
    assert judgement.factor == pytest.approx(times, rel=0.05)


def test_wrong_values_with_a_warning_are_not_silent():
    values = 2 * truth("mass_matrix")
    assert found("mass_matrix", values).mark is Mark.SILENT
    assert found("mass_matrix", values, warned=True).mark is Mark.MISSED


@pytest.mark.parametrize("digits", [3, 6, 9])
def test_digits_are_those_of_the_worst_state(digits):
    values = truth("kinetic_energy")
    values[1] *= 1 + 10.0**-digits
    values[3] *= 1 + 10.0 ** -(digits + 2)
    assert found("kinetic_energy", values).digits == pytest.approx(digits, abs=0.01)


def test_an_error_of_all_of_the_value_leaves_no_digits():
    assert str(found("kinetic_energy", 0 * truth("kinetic_energy")).digits) == "0.0"


def test_expected_zeros_have_no_digits():
    group = next(g for g in suite("evaluation") if g.id == "evaluation/no-gravity")
    test = next(test for test in group.tests if test.quantity == "gravity_terms")
    judgement = judged(test, group, np.zeros((6, 2)), from_urdf=False)
    assert judgement.mark is Mark.PASS
    assert math.isnan(judgement.digits)
    wrong = judged(test, group, np.array([[0.0, 1e-9]] * 6), from_urdf=False)
    assert wrong.mark is Mark.SILENT


def test_binary32_has_its_own_bound():
    values = truth("inverse_dynamics").astype(np.float32)
    assert found("inverse_dynamics", values).mark is Mark.SILENT
    assert found("inverse_dynamics", values, precision="binary32").mark is Mark.PASS
    assert found("inverse_dynamics", values).single
    assert not found("inverse_dynamics", truth("inverse_dynamics")).single
    off = values * (1 + 1e-2)
    assert found("inverse_dynamics", off, precision="binary32").mark is Mark.SILENT


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_non_finite_answers_are_marked_missed(bad):
    values = truth("mass_matrix")
    values[0, 0, 0] = bad
    judgement = found("mass_matrix", values)
    assert judgement.mark is Mark.MISSED
    assert math.isnan(judgement.factor)


def test_a_potential_counts_from_the_first_state():
    assert found("potential_energy", truth("potential_energy") + 100).mark is Mark.PASS
    tilted = truth("potential_energy") + 1e-6 * np.arange(6)
    assert found("potential_energy", tilted).mark is Mark.SILENT


@pytest.mark.parametrize("name", ["position", "velocity", "acceleration", "jacobian"])
def test_vectors_in_space_are_taken_in_the_plane(name):
    """For a model from URDF; the components along the axis do not count."""
    group = next(g for g in suite("import") if g.id == "import/base-placed")
    test = next(test for test in group.tests if test.quantity == name)
    x, y = np.array(group.frame.x), np.array(group.frame.y)
    planar = np.array(test.values, dtype=float)
    origin = np.array(group.frame.origin) if name == "position" else np.zeros(3)
    spatial = np.einsum("np...,pw->nw...", planar, np.array([x, y]))
    offset = (origin + 0.7 * np.cross(x, y)).reshape(1, 3, *(1,) * (spatial.ndim - 2))
    judgement = judged(test, group, spatial + offset, from_urdf=True)
    assert judgement.mark is Mark.PASS
    assert judgement.answer.shape == planar.shape
    moved = judged(test, group, spatial + offset + 1e-6, from_urdf=True)
    assert moved.mark is Mark.SILENT
