"""Starts nearby."""

import numpy as np
import pytest

from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth.moved_start import growth_of_moved, moved_start


def test_a_start_is_moved_by_a_part_of_the_largest_angle_and_speed():
    q, u = moved_start((0.5, -4.0), (0.0, 3.0), 1e-3)
    assert q == pytest.approx((0.5 + 4e-3, -4.0 - 2.8e-3))
    assert u == pytest.approx((-2.4e-3, 3.0 + 2.7e-3))


def test_small_angles_are_moved_by_a_part_of_one_radian():
    """Speeds of zero stay: all else would depend on a unit of time."""
    q, u = moved_start((0.0, 1e-9), (0.0, 0.0), 1e-6)
    assert q == pytest.approx((1e-6, 1e-9 - 7e-7))
    assert u == (0.0, 0.0)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_starts_of_all_precisions_are_moved_by_roundings_of_their_own(precision):
    own = PRECISIONS[precision]
    q, u = (tuple(map(own.number, pair)) for pair in ((0.5, 1.0), (2.0, -2.0)))
    part = 64 * own.rounding
    found, speeds = moved_start(q, u, part)
    assert [float((a - b) / own.rounding) for a, b in zip(found, q, strict=True)] == pytest.approx(
        [64.0, -44.8], abs=1
    )
    assert [float((a - b) / own.rounding) for a, b in zip(speeds, u, strict=True)] == pytest.approx(
        [-102.4, 115.2], abs=2
    )


def test_each_start_of_several_is_moved_by_its_own_part():
    q, u = np.array([[0.5, 7.0], [1.0, -2.0]]), np.array([[1.0, 0.0], [0.0, -5.0]])
    found, speeds = (np.array(pair) for pair in moved_start(tuple(q), tuple(u), 1e-3))
    for k in (0, 1):
        alone = moved_start(tuple(q[:, k]), tuple(u[:, k]), 1e-3)
        assert tuple(found[:, k]) == alone[0]
        assert tuple(speeds[:, k]) == alone[1]


def test_the_growth_is_unknown_where_it_is_not_in_proportion_any_more():
    apart = np.array([0.0, 1e-6, 0.1, 0.2, np.inf, np.nan])
    found = growth_of_moved(apart, 1e-9, 0.1)
    assert found == pytest.approx([0.0, 1e3, 1e8, np.inf, np.inf, np.inf])
