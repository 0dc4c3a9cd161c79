"""Starts nearby."""

import math

import numpy as np
import pytest

from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth.moved_start import (
    ACROSS,
    FORWARD,
    Move,
    growth_of_moved,
    moved_start,
)


def test_a_start_is_moved_by_a_part_of_the_largest_angle_and_speed():
    q, u = moved_start((0.5, -4.0), (0.0, 3.0), Move(1e-3))
    assert q == pytest.approx((0.5 + 4e-3, -4.0 - 2.8e-3))
    assert u == pytest.approx((2.1e-3, 3.0 + 3e-3))


def test_small_angles_are_moved_by_a_part_of_one_radian():
    """Speeds of zero stay: all else would depend on a unit of time."""
    q, u = moved_start((0.0, 1e-9), (0.0, 0.0), Move(1e-6))
    assert q == pytest.approx((1e-6, 1e-9 - 7e-7))
    assert u == (0.0, 0.0)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_starts_of_all_precisions_are_moved_by_roundings_of_their_own(precision):
    own = PRECISIONS[precision]
    q, u = (tuple(map(own.number, pair)) for pair in ((0.5, 1.0), (2.0, -2.0)))
    part = 64 * own.rounding
    found, speeds = moved_start(q, u, Move(part))
    assert [float((a - b) / own.rounding) for a, b in zip(found, q, strict=True)] == pytest.approx(
        [64.0, -44.8], abs=1
    )
    assert [float((a - b) / own.rounding) for a, b in zip(speeds, u, strict=True)] == pytest.approx(
        [89.6, 128.0], abs=2
    )


def test_no_growing_part_of_a_linear_motion_is_missed_in_both_directions():
    """It is p · Δq + p · Δu/λ, for momenta p of a mode and a rate λ of any size."""
    u = 1.0, -1.0
    starts = [np.array(moved_start((0.0, 0.0), u, Move(1.0, each))) for each in (FORWARD, ACROSS)]
    changes = [(q, speeds - u) for q, speeds in starts]
    least = math.inf
    for turn in np.linspace(0.0, math.pi, 41):
        p = np.array([math.cos(turn), math.sin(turn)])
        for ratio in (0.0, 1e-3, 0.1, 0.3, 0.7, 1.0, 1.4, 3.0, 1e3):
            parts = [abs(p @ dq + ratio * (p @ du)) / math.hypot(1.0, ratio) for dq, du in changes]
            least = min(least, max(parts))
            assert math.hypot(*parts) == pytest.approx(math.hypot(1.0, 0.7))
    assert least > 0.8


def test_each_start_of_several_is_moved_by_its_own_part():
    q, u = np.array([[0.5, 7.0], [1.0, -2.0]]), np.array([[1.0, 0.0], [0.0, -5.0]])
    found, speeds = (np.array(pair) for pair in moved_start(tuple(q), tuple(u), Move(1e-3)))
    for k in (0, 1):
        alone = moved_start(tuple(q[:, k]), tuple(u[:, k]), Move(1e-3))
        assert tuple(found[:, k]) == alone[0]
        assert tuple(speeds[:, k]) == alone[1]


def test_the_growth_is_unknown_where_it_is_not_in_proportion_any_more():
    apart = np.array([0.0, 1e-6, 0.1, 0.2, np.inf, np.nan])
    found = growth_of_moved(apart, 1e-9, 0.1)
    assert found == pytest.approx([0.0, 1e3, 1e8, np.inf, np.inf, np.inf])
