"""The order of a bundle, and the size of the state of its first lane."""

import math

import pytest

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.scene import Scene
from twolink.simulation.smooth.bundle_plan import (
    bundle_plan,
    error_of_first,
    error_of_second,
    growth_of,
)
from twolink.simulation.smooth.bundles import RATIOS
from twolink.simulation.smooth.judging import truncation

SCENE = Scene(Chain.uniform_bars(), (0.3, -2.0), (0.1, 0.2), 10.0, (Gravity(),))


def expected_estimate(plan, growth, largest):
    """Return the estimate of the first lane that a plan is expected to give."""
    part = truncation(plan.order) * plan.size / largest
    return growth / growth_of(1.0, part)


@pytest.mark.parametrize("digits", range(3, 11))
def test_the_second_lane_is_expected_to_have_the_accuracy(digits):
    accuracy, growth = 10.0**-digits, 300.0
    plan = bundle_plan(accuracy, growth, SCENE, 10.0)
    estimate = expected_estimate(plan, growth, 10.0)
    first = error_of_first(estimate, growth)
    second = error_of_second(RATIOS[1] * estimate, first)
    assert 0.02 * accuracy < second < 1.01 * accuracy
    assert first < accuracy / 20


def test_a_finer_accuracy_takes_a_higher_order():
    orders = [bundle_plan(10.0**-digits, 1e3, SCENE, 10.0).order for digits in range(2, 11)]
    assert orders == sorted(orders)
    assert len(set(orders)) > 3


def test_the_size_exceeds_the_variables():
    assert bundle_plan(1e-6, None, SCENE, None).size >= 8 * 2.0
    assert bundle_plan(1e-6, 1e6, SCENE, 300.0).size >= 2 * 300.0


@pytest.mark.parametrize("accuracy", [1e-3, 1e3, math.inf])
def test_steps_are_not_much_longer_than_those_of_the_order(accuracy):
    """The estimate is too small where steps come near to the radius of convergence."""
    for growth in (1.0, 1e3, 1e6):
        plan = bundle_plan(accuracy, growth, SCENE, 10.0)
        assert plan.size <= 10.0 * math.exp(0.3 * plan.order) + 1e-9


def test_there_is_no_plan_where_round_off_leaves_no_room():
    assert bundle_plan(1e-9, 1e6, SCENE, 10.0) is None
    assert bundle_plan(5e-324, 1e3, SCENE, 10.0) is None
    assert bundle_plan(1e-9, 1e2, SCENE, 10.0) is not None


def test_a_low_order_shows_the_growth_near_round_off():
    plan = bundle_plan(1e-13, None, SCENE, None)
    assert plan.order == 11


def test_the_bound_has_a_margin_and_the_round_off():
    assert error_of_first(1e-6, 1.0) == pytest.approx(1e-5)
    assert error_of_second(1e-6, 1e-7) == pytest.approx(1.6e-6)
    assert error_of_first(0.0, 1e6) == pytest.approx(32e6 * 2.0**-52)
