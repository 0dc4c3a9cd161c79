"""Measures of errors in lanes: each bound is the sum of its three parts, worked out by hand."""

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.ensembles.blocks import Lanes
from twolink.ensembles.compiled import FORMULATION
from twolink.ensembles.error import SoFar, states_at_ends, states_of
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.judging import MARGIN_OF_ORDERS, truncation
from twolink.simulation.smooth.round_off import A_VALUE, MOST_ROUND_OFF

ORDER = 9
ROUNDING = 2.0**-52

# The mass centre of link 2 is at B, so that its speed is its momentum, and there is no other term.
CHAIN = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (1 / 12, 1.0))


def at_rest(width):
    return Lanes(CHAIN, (), np.zeros((2, width)), np.zeros((2, width)), 1.0)


def states(*rows):
    """Return q and u, shape (4, m, n), of which the last speed has the given rows."""
    found = np.zeros((4, *np.shape(rows)))
    found[3] = rows
    return found


def test_measures_are_the_largest_so_far():
    """Two lanes at three times; in the second lane the motions agree at first."""
    kept = states([1.0, 2.0], [-4.0, 2.5], [3.0, 1.0])
    apart = states([1e-7, 0.0], [1e-9, 0.0], [2e-7, -3e-6])
    found = SoFar.at_the_start(at_rest(2)).with_states(CHAIN, kept, kept + apart, ORDER)
    assert found.differences == pytest.approx(
        np.array([[1e-7, 0], [1e-7, 0], [2e-7, 3e-6]]), rel=1e-8, abs=0
    )
    assert found.sizes.tolist() == [[1, 2], [4, 2.5], [4, 2.5]]
    assert found.growths == pytest.approx(found.differences / truncation(ORDER), rel=1e-15, abs=0)


def test_measures_in_parts_are_those_of_the_whole(random):
    kept = random.normal(size=(4, 12, 3))
    judged = kept + 1e-8 * random.normal(size=kept.shape)
    begun = SoFar.at_the_start(at_rest(3))._replace(growths=np.array([0.0, 1e9, 3.0]))
    whole = begun.with_states(CHAIN, kept, judged, ORDER).of(-1)
    first = begun.with_states(CHAIN, kept[:, :5], judged[:, :5], ORDER).of(-1)
    second = first.with_states(CHAIN, kept[:, 5:], judged[:, 5:], ORDER).of(-1)
    np.testing.assert_array_equal(second, whole)
    assert whole.growths[1] == 1e9


def test_the_growth_from_the_start_counts_where_it_is_larger():
    """It is unknown, and so is the error, from where the runs are far apart or not finite."""
    begun = SoFar.at_the_start(at_rest(4))._replace(growths=np.array([0.0, 1e9, 0.0, 0.0]))
    part = 4096 * ROUNDING
    apart = np.array([[1e-9, 1e-9, 1e-9, 1e-9], [1e-10, 1e-9, 0.02, np.nan], [0.0, 0.0, 0.0, 0.0]])
    found = begun._replace(sizes=np.ones(4)).with_growth(apart)
    grown = 4 * 1e-9 / part
    assert found.growths == pytest.approx(
        np.array(
            [[grown, 1e9, grown, grown], *[[grown, 1e9, np.inf, np.inf]] * 2],
        )
    )
    # Those of later steps count where they grow by more.
    later = np.array([[0.0], [1e8], [1e12]]) * np.ones(4)
    more = begun._replace(sizes=np.ones(4)).with_growth(apart, later)
    assert more.growths[:, 0] == pytest.approx([grown, 1e8, 1e12])
    assert np.isinf(found.bounds(np.ones(4))[1:, 2:]).all()
    assert np.isfinite(found.bounds(np.ones(4))[:, :2]).all()


def test_states_after_the_end_of_a_run_do_not_count():
    kept = states([1.0, 1.0], [9.0, 9.0])
    judged = kept + states([0.0, 0.0], [1.0, np.nan])
    moves = np.array([[True, True], [False, True]])
    found = SoFar.at_the_start(at_rest(2)).with_states(CHAIN, kept, judged, ORDER, moves).of(-1)
    assert found.differences.tolist() == [0.0, np.inf]
    assert found.sizes.tolist() == [1.0, 9.0]


def test_a_bound_is_the_sum_of_truncation_sums_and_growth():
    measured = SoFar(np.array([1e-9]), np.array([5.0]), np.array([1e4]))
    expected = (
        MARGIN_OF_ORDERS * 1e-9 + (A_VALUE + 70) * ROUNDING * 5 + MOST_ROUND_OFF * ROUNDING * 1e4
    )
    assert measured.bounds(np.array([70.0])) == pytest.approx([expected], rel=1e-15, abs=0)


@pytest.mark.parametrize("difference", [0.0101, 1.0, np.inf])
def test_a_difference_that_is_not_small_bounds_nothing(difference):
    measured = SoFar(np.array([difference, 0.0099]), np.ones(2), np.ones(2))
    first, second = measured.bounds(np.array([1.0, 1.0]))
    assert first == np.inf
    assert second == pytest.approx(MARGIN_OF_ORDERS * 0.0099, rel=1e-6)


def test_states_of_variables_are_those_that_they_come_from(random):
    chain = Chain.uniform_bars()
    q, u = random.normal(size=(2, 2, 5, 3))
    variables = np.array([*q, *EQUATIONS[FORMULATION].from_speeds(chain, tuple(q), tuple(u))])
    found = states_of(chain, variables)
    np.testing.assert_allclose(found, [*q, *u], rtol=1e-12, atol=1e-14)
    np.testing.assert_array_equal(states_at_ends(chain, variables.transpose(1, 0, 2)), found)


def test_the_round_off_of_the_first_speeds_moves_the_angles_in_proportion_to_the_time():
    """Link 1 has little mass, and link 2 is a point: speeds are differences of larger terms."""
    chain = Chain((1e-5, 1.0), (1.0, 1.0), ((0.0, 0.0), (1.0, 0.0)), (1e-5, 1e-5))
    lanes = Lanes(chain, (), np.zeros((2, 1)), np.array([[0.5], [0.25]]), 30.0)
    begun = SoFar.at_the_start(lanes)
    # M = [[1 + d, 1], [1, 1 + d]] with d = 1e-5, and M^-1 is that of 1 + d and -1 by 2 d.
    assert begun.sizes == pytest.approx(1.5 / 2e-5, rel=1e-4)
    (known,) = begun.bounds(np.zeros(1))
    assert known == pytest.approx((A_VALUE + 30) * ROUNDING * 1.5 / 2e-5, rel=1e-4)
