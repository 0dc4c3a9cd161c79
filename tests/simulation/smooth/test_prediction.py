"""Predictions of orders and round-off from the growth of errors."""

import math

import numpy as np
import pytest

from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth.judging import GROWTH, MARGIN_OF_JUDGES, truncation
from twolink.simulation.smooth.prediction import Prediction
from twolink.simulation.smooth.round_off import MOST_ROUND_OFF

ROUNDING = PRECISIONS["double"].rounding


def grown(*values):
    return Prediction(np.array(values))


def test_a_growth_is_assumed_before_the_first_measurement():
    assert Prediction().growth == GROWTH
    assert Prediction().shared_round_off(ROUNDING) == 0
    assert Prediction().learned(np.zeros(2)).growth == GROWTH


def test_the_largest_growth_at_each_time_is_kept():
    found = grown(1.0, 5.0).learned(np.array([2.0, 4.0])).learned(np.array([math.inf, math.nan]))
    assert found.grown.tolist() == [2.0, 5.0]
    assert found.growth == 5.0
    assert found.shared_round_off(ROUNDING) == pytest.approx(
        MOST_ROUND_OFF * ROUNDING * found.grown
    )


@pytest.mark.parametrize("accuracy", [1e-4, 1e-8, 1e-10])
def test_the_judge_of_a_pair_has_half_the_room_beside_round_off(accuracy):
    """The lowest order: two less would not do."""
    known = grown(10.0, 1e3)
    order = known.order_of_pair(accuracy, "double")
    room = accuracy - MOST_ROUND_OFF * 1e3 * ROUNDING
    error = [MARGIN_OF_JUDGES * 1e3 * truncation(each) for each in (order, order - 2)]
    assert error[0] <= room / 2
    assert error[1] > room / 2 or order == 7


def test_no_order_is_high_enough_if_round_off_exceeds_the_accuracy():
    known = grown(1e6)
    assert known.order_of_pair(1e-8, "double") < 20
    assert known.order_of_pair(1e-9, "double") > 300
    assert known.order_of_pair(1e-9, "long double") < 20
    for shared in (1e8, math.inf, math.nan):
        beside = Prediction(np.array([1.0]), shared=shared)
        assert beside.order_of_pair(1e-8, "double") > 300


def test_an_order_by_defect_leaves_four_fifths_of_the_accuracy():
    known = grown(1e4)
    order = known.order_by_defect(1e-10)
    assert 1e4 * truncation(order) <= 0.2e-10 < 1e4 * truncation(order - 2)


def test_the_expected_round_off_grows_with_the_errors():
    one, other = (grown(each).left_by_round_off("double") for each in (1e3, 1e5))
    assert other == pytest.approx(100 * one)
    assert 0.01 * ROUNDING * 1e3 < one < ROUNDING * 1e3
