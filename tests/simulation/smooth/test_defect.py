"""The defects of steps in all precisions, against each other and against deviations put in."""

import math

import numpy as np
import pytest

from tests.simulation.smooth.test_linear import taken
from tests.simulation.smooth.test_measure import HARD
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth import defect
from twolink.simulation.smooth.defect import evaluation_of
from twolink.simulation.smooth.linear import scaled_polynomials
from twolink.simulation.smooth.quadrature import ResidualRule
from twolink.simulation.smooth.taylor import taylor_run


def defects_of(evaluation, steps):
    return evaluation.of(steps, scaled_polynomials(steps))


PAIRS = [
    ("double", "double"),
    ("double", "long double"),
    ("long double", "long double"),
    ("long double", "quadruple"),
]


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
        defects_of(evaluation_of(scene, "momenta", name), steps) for name in (precision, longer)
    )
    size = np.abs(own.defects).max()
    assert size > 1e3 * PRECISIONS[precision].rounding
    assert other.defects == pytest.approx(own.defects, rel=1e-3, abs=1e-3 * size)
    assert other.truncated == pytest.approx(own.truncated, rel=1e-3, abs=1e-3 * size)
    assert other.firsts == pytest.approx(own.firsts, rel=1e-3, abs=1e-3 * size)
    assert other.moments == pytest.approx(own.moments, rel=1e-3, abs=1e-3 * size)
    assert other.rates == pytest.approx(own.rates)


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
    evaluation = evaluation_of(scene, "momenta", evaluated_in)
    before = defects_of(evaluation, steps).defects
    changed = steps._replace(coefficients=moved)
    after = defects_of(evaluation, changed).defects
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
        defects_of(evaluation_of(scene, "momenta", name), steps).defects
        for name in ("double", "long double", "quadruple")
    )
    size = np.abs(longest).max()
    assert np.abs(longer - longest).max() < 1e-2 * size
    assert np.abs(own - longest).max() > 5e-2 * size


@pytest.mark.parametrize("order", [9, 13, 17])
def test_four_nodes_give_the_truncation_of_a_step(order, monkeypatch):
    """Ten of Gauss's nodes, exact up to the nineteenth power, give the same to one percent."""
    scene = HARD["chaotic"]
    steps = taken(scene, "momenta", order)
    evaluation = evaluation_of(scene, "momenta", "quadruple")
    few = defects_of(evaluation, steps)
    x, weights = np.polynomial.legendre.leggauss(10)
    nodes, k = (x + 1) / 2, np.arange(9)
    factors = (1 - nodes[:, None]) ** k / np.array([math.factorial(each) for each in k])
    all_of_it = weights[:, None] / 2 * factors
    # All of the integral is truncation, and the first moment is not divided.
    integral, firsts = all_of_it[:, [0, 0]], np.repeat(all_of_it[:, 1:2] / 3, 3, axis=1)
    many = ResidualRule(nodes, integral, firsts, all_of_it[:, 2:])
    monkeypatch.setattr(defect, "residual_rule", lambda order: many)
    enough = defects_of(evaluation, steps)
    assert np.abs(few.defects - enough.defects).max() < 1e-2 * np.abs(enough.defects).max()
    # The integral has round-off as well.
    apart = np.abs(few.truncated - enough.truncated).max()
    assert apart < 5e-2 * np.abs(enough.truncated).max() + 2**-51
    first, exact = few.firsts.sum(axis=0), enough.firsts.sum(axis=0)
    for one, other in ((first, exact), *zip(few.moments[:2], enough.moments[:2], strict=True)):
        assert np.abs(one - other).max() < 5e-2 * np.abs(other).max()


@pytest.mark.parametrize(
    ("large", "count"), [((), 5), ((3,), 5), ((5,), 6), ((5, 8), 9), ((11,), 12)]
)
def test_terms_up_to_the_last_large_one_are_computed_in_long_numbers(large, count):
    sizes = np.exp(-2.0 * np.arange(12)) * np.array([1.0, 1e-3, 0.0, 30.0])[:, None]
    sizes[:, list(large)] = 2e-4 * sizes[:, :1]
    assert defect._until_small(sizes, 5) == count
