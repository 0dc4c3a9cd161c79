"""The motion at the ends of steps: where it is known, its sizes, and the comparison of two runs."""

import numpy as np
import pytest

from twolink.simulation.smooth.visited import Visited, compared, largest_until, with_middles


def visited(times, ends, *, exact=True, of=lambda t: t):
    """Return a run whose angles and speeds are functions of time, alike for all."""
    values, at_ends = (np.tile(of(np.array(each, float)), (4, 1)) for each in (times, ends))
    return Visited(np.array(times, float), values, np.array(ends, float), at_ends, exact)


def test_the_largest_size_counts_samples_and_ends_of_steps():
    run = visited([0.0, 1.0, 2.0], [0.5, 1.5], exact=False, of=lambda t: np.where(t == 0.5, -7, t))
    found = run.largest(np.array([0.0, 0.4, 0.5, 2.0]), np.abs)
    assert found.tolist() == [0.0, 0.0, 7.0, 7.0]


def test_the_largest_value_until_a_time_counts_all_places_before_it():
    places, values = np.array([0.5, 1.0, 2.0]), np.array([7.0, 3.0, 9.0])
    found = largest_until(np.array([0.0, 0.4, 0.5, 1.5, 2.0]), places, values)
    assert found.tolist() == [0.0, 0.0, 7.0, 7.0, 9.0]
    assert largest_until(np.array([1.0]), np.zeros(0), np.zeros(0)).tolist() == [0.0]


def test_runs_are_compared_where_both_are_known():
    """A peak between two samples is at the end of a step of the first run."""

    def peak(t):
        return np.where(t == 0.5, t + 1.0, t)

    first = visited([0.0, 1.0, 2.0], [0.5, 1.5, 1.75], of=peak)
    second = visited([0.0, 0.5, 1.0, 1.5, 2.0], [0.75])
    common = compared(first, second)
    assert common.times.tolist() == [0.0, 1.0, 2.0]
    assert common.ends.tolist() == [0.5, 1.5]
    assert common.apart_at_ends.tolist() == [1.0, 0.0]
    assert common.until(np.array([0.0, 0.4, 0.9, 2.0])).tolist() == [0.0, 0.0, 1.0, 1.0]


def test_ends_that_are_rounded_are_not_compared():
    first, second = (visited([0.0, 0.5, 1.0], [0.5], exact=False, of=f) for f in (np.sin, np.cos))
    common = compared(first, second)
    assert common.times.tolist() == [0.0, 0.5, 1.0]
    assert len(common.ends) == 0


@pytest.mark.parametrize(
    ("times", "resolved"),
    [([0.0, 1.5, 2.5, 3.0], True), ([0.0, 1.0, 2.0, 3.0], True), ([0.0, 0.5, 3.0], False)],
)
def test_a_comparison_resolves_a_run_with_a_time_in_each_step(times, resolved):
    run = visited(times, [0.0, 1.0, 2.0, 3.0], exact=False)
    assert compared(run, run).resolves(run) == resolved


def test_a_comparison_at_the_ends_of_all_steps_resolves_a_run():
    first, second = visited([0.0, 3.0], [1.0, 2.0]), visited([0.0, 1.0, 2.0, 3.0], [0.5])
    assert compared(first, second).resolves(first)
    assert not compared(second, first).resolves(visited([0.0, 3.0], [0.0, 0.5, 0.75, 3.0]))


def test_middles_lie_between_the_ends():
    assert with_middles(np.array([0.0, 1.0, 3.0])).tolist() == [0.0, 0.5, 1.0, 2.0, 3.0]
    assert with_middles(np.zeros(0)).tolist() == []
