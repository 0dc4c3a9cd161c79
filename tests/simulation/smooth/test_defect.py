"""The defects of steps in all precisions, against each other and against deviations put in."""

import math

import numpy as np
import pytest

from tests.simulation.smooth.test_linear import taken
from tests.simulation.smooth.test_measure import HARD
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth.defect import evaluation_of
from twolink.simulation.smooth.quadrature import gauss_rule
from twolink.simulation.smooth.taylor import Steps, taylor_run

PAIRS = [
    ("double", "double"),
    ("double", "long double"),
    ("long double", "long double"),
    ("long double", "quadruple"),
]


def test_the_nodes_are_enough_for_the_precision():
    """Gauss's error (e⁻²/4)^(2 m) is below a rounding, and that of one node less is not."""
    for precision, nodes in (("double", 6), ("long double", 8)):
        rule = evaluation_of(HARD["reference"], "momenta", precision, precision).rule
        assert len(rule.nodes) == nodes
        ratio = math.exp(-2) / 4
        assert ratio ** (2 * nodes) < PRECISIONS[precision].rounding
    # In a longer precision, no round-off hides it.
    longer = evaluation_of(HARD["reference"], "momenta", "double", "long double")
    assert len(longer.rule.nodes) == 7


@pytest.mark.parametrize("precision", ["double", "long double"])
def test_an_evaluation_in_a_longer_precision_finds_the_same_defects(precision):
    """At a low order the truncation is far above the round-off of both."""
    found = []
    scene = HARD["reference"]
    taylor_run(
        scene, [0.0, 1.0], formulation="momenta", precision=precision, order=9,
        observe=found.append,
    )  # fmt: skip
    (steps,) = found
    longer = "long double" if precision == "double" else "quadruple"
    own, other = (
        evaluation_of(scene, "momenta", precision, name).of(steps) for name in (precision, longer)
    )
    size = np.abs(own.defects).max()
    assert size > 1e3 * PRECISIONS[precision].rounding
    assert other.defects == pytest.approx(own.defects, rel=1e-3, abs=1e-3 * size)
    assert other.moments == pytest.approx(own.moments, rel=1e-3, abs=1e-3 * size)
    # A mean over seven nodes, or six.
    assert other.rates == pytest.approx(own.rates, rel=0.05)


@pytest.mark.parametrize(("precision", "evaluated_in"), PAIRS)
def test_a_deviation_of_the_next_start_is_found(precision, evaluated_in):
    """A start that is moved by ten roundings has a defect of ten roundings, and the next another.

    The other defects are round-off, and remain below that.
    """
    scene = HARD["reference"]
    found = []
    taylor_run(scene, [0.0, 2.0], formulation="momenta", precision=precision, observe=found.append)
    (steps,) = found
    moved = steps.coefficients.copy()
    own = PRECISIONS[precision]
    away = own.number(1000 * own.rounding)
    moved[5, 2, 0] = moved[5, 2, 0] + away
    evaluation = evaluation_of(scene, "momenta", precision, evaluated_in)
    before = evaluation.of(steps).defects
    after = evaluation.of(Steps(steps.starts, steps.lengths, moved, steps.end)).defects
    change = after - before
    assert change[4, 2] == pytest.approx(-float(away), rel=1e-2)
    # Only to first order in the length of the step.
    assert change[5, 2] == pytest.approx(float(away), rel=0.3)
    assert not change[7:].any()


def test_the_round_off_of_an_evaluation_in_a_longer_precision_is_small():
    """Defects of a run at round-off, in long doubles and in quadruple numbers, are the same."""
    scene = HARD["reference"]
    steps = taken(scene, "momenta")
    own, longer, longest = (
        evaluation_of(scene, "momenta", "double", name).of(steps).defects
        for name in ("double", "long double", "quadruple")
    )
    size = np.abs(longest).max()
    assert np.abs(longer - longest).max() < 1e-2 * size
    assert np.abs(own - longest).max() > 5e-2 * size


def test_too_few_nodes_are_seen_on_the_slopes():
    scene = HARD["reference"]
    steps = taken(scene, "momenta")
    enough = evaluation_of(scene, "momenta", "double", "double")
    assert enough.of(steps).quadrature.max() < 1e-15
    few = type(enough)(enough.name, enough.rates, gauss_rule(2, "double"))
    found = few.of(steps)
    assert found.quadrature.max() > 1e-6
    # The defect that these nodes give is an error of the rule, of the same size.
    ratio = np.abs(found.defects).max() / found.quadrature.max()
    assert 0.1 < ratio < 10
