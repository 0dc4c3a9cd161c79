"""The order of a bundle, and the size of the state of its first lane."""

import math

import pytest

from twolink.simulation.smooth.bundle_plan import (
    BundlePlan,
    Known,
    Start,
    bounds,
    bundle_plan,
    finest_plan,
    growth_of,
    missed_by_step,
)
from twolink.simulation.smooth.bundles import RATIOS, SECOND
from twolink.simulation.smooth.judging import truncation

START = Start(2.0, 1.0)


def expected_estimate(plan, growth, largest):
    """Return the estimate of the first lane that a plan is expected to give."""
    part = truncation(plan.order) * plan.size / largest
    return growth / growth_of(1.0, part)


@pytest.mark.parametrize("digits", range(3, 11))
def test_the_second_lane_is_expected_to_have_the_accuracy(digits):
    accuracy, growth = 10.0**-digits, 300.0
    plan = bundle_plan(accuracy, START, Known(growth, 10.0))
    estimate = expected_estimate(plan, growth, 10.0)
    found = bounds(
        estimate, RATIOS[SECOND] * estimate, growth, missed_by_step(plan.order, plan.size)
    )
    assert 0.02 * accuracy < found.second < 1.01 * accuracy
    assert found.first < accuracy / 15


def test_a_step_alone_has_the_accuracy_where_errors_do_not_grow():
    plan = bundle_plan(1e-6, START._replace(speed=100.0), Known(1e-9, 10.0))
    assert 0.01e-6 < RATIOS[SECOND] * 100.0 * missed_by_step(plan.order, plan.size) < 1e-6


def test_a_finer_accuracy_takes_a_higher_order():
    known = Known(1e3, 10.0)
    orders = [bundle_plan(10.0**-digits, START, known).order for digits in range(2, 11)]
    assert orders == sorted(orders)
    assert len(set(orders)) > 3


def test_the_first_lane_is_to_have_an_accuracy_near_round_off():
    """Its bound is a fortieth of that of the second, whose order would be too high."""
    growth = 3e4
    near = 100 * growth * 2.0**-52
    plan = bundle_plan(near, START, Known(growth, 10.0))
    estimate = expected_estimate(plan, growth, 10.0)
    found = bounds(
        estimate, RATIOS[SECOND] * estimate, growth, missed_by_step(plan.order, plan.size)
    )
    assert found.first < 1.01 * near < found.second


def test_the_size_exceeds_the_variables():
    assert bundle_plan(1e-6, START).size >= 8 * 2.0
    assert bundle_plan(1e-6, START, Known(1e3, 300.0)).size >= 2 * 300.0
    assert bundle_plan(1e-6, START, Known(None, 300.0)).size >= 2 * 300.0


@pytest.mark.parametrize("accuracy", [1e-3, 1e3, math.inf])
def test_steps_are_not_much_longer_than_those_of_the_order(accuracy):
    """The estimate is too small where steps come near to the radius of convergence."""
    for growth in (1.0, 1e3, 1e6):
        plan = bundle_plan(accuracy, START, Known(growth, 10.0))
        assert plan.size <= 10.0 * math.exp(0.3 * plan.order) + 1e-9


def test_there_is_no_plan_where_round_off_leaves_no_room():
    assert bundle_plan(1e-9, START, Known(1e6, 10.0)) is None
    assert bundle_plan(5e-324, START, Known(1e3, 10.0)) is None
    assert bundle_plan(1e-9, START, Known(1e2, 10.0)) is not None


@pytest.mark.parametrize("accuracy", [2e-9, 1e-9, 3e-10])
def test_a_smaller_growth_is_expected_where_no_order_serves_the_larger(accuracy):
    """A second bundle would cost as much as the one for the growth."""
    plan = bundle_plan(accuracy, START)
    assert plan.order == 19
    assert bundle_plan(accuracy, START, Known(3e5, 2.0)) is None
    # The motion has its size at the start, eight times as large.
    assert plan.size >= 8 * 2.0


def test_a_low_order_shows_the_growth_near_round_off():
    assert bundle_plan(1e-14, START).order == 11


def test_the_finest_plan_has_smaller_errors_than_others():
    finest = finest_plan(Known(1e9, 10.0))
    assert finest.order == 19
    assert finest.size == 20.0
    for accuracy in (1e-6, 1e-10):
        plan = bundle_plan(accuracy, START, Known(1.0, 10.0))
        assert finest.size * truncation(finest.order) <= plan.size * truncation(plan.order)


def test_the_bounds_have_margins_round_off_and_a_step():
    assert bounds(1e-6, 0.0, 1.0, 0.0).first == pytest.approx(2e-5)
    assert bounds(0.0, 0.0, 1e6, 0.0).first == pytest.approx(32e6 * 2.0**-52)
    assert bounds(0.0, 0.0, 0.0, 0.0).first == 32 * 2.0**-52
    assert bounds(0.0, 1e-6, 0.0, 0.0) == pytest.approx((0.0, 2e-6), abs=1e-14)
    assert bounds(0.0, 0.0, 0.0, 1e-6) == pytest.approx((1e-6, 301e-6))
    assert missed_by_step(11, 20.0) == pytest.approx(20 * math.exp(-22))


def test_the_start_is_moved_by_far_more_than_round_off():
    """And by less where steps have smaller errors."""
    offsets = [BundlePlan(order, 10.0).offset for order in range(7, 22, 2)]
    assert offsets == sorted(offsets, reverse=True)
    assert offsets[0] == 1e-4
    assert offsets[-1] == 1024 * 2.0**-52
    assert offsets[3] == pytest.approx(12 * 300 * truncation(13))


def test_round_off_that_grows_by_more_than_truncation_leaves_no_room():
    start = Start(1.0, 1.0)
    assert bundle_plan(1e-6, start, Known(1e3, 1.0)) is not None
    assert bundle_plan(1e-6, start, Known(1e3, 1.0, 1e7)) is not None
    assert bundle_plan(1e-6, start, Known(1e3, 1.0, 1e10)) is None
