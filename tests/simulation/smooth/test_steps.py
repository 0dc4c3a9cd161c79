"""The steps of runs, as they are taken: their ends, and an observer."""

from itertools import pairwise

import numpy as np
import pytest

from tests.simulation.smooth.test_taylor import TIMES, check_often, run
from twolink.simulation.smooth import steps as module


def test_of_very_many_steps_some_ends_are_kept(monkeypatch):
    check_often(monkeypatch, "double")
    monkeypatch.setattr(module, "_MOST_ENDS", 20)
    found = run(visit=TIMES)
    ends = found.visited.ends
    every = found.step_times()[1:]
    assert len(every) > 80
    assert 10 <= len(ends) <= 20
    # The starts of parts are rounded.
    nearest = np.abs(ends[:, None] - every).min(axis=1)
    assert nearest.max() < 1e-12
    assert np.diff(ends).max() < 12 * np.diff(every).max()


@pytest.mark.parametrize("ends", [True, False])
def test_an_observer_receives_all_steps_whether_their_ends_are_kept_or_not(monkeypatch, ends):
    check_often(monkeypatch, "double")
    monkeypatch.setattr(module, "_OBSERVED_AT_ONCE", 3)
    seen = []
    found = run(observe=seen.append, visit=TIMES if ends else None)
    starts = np.concatenate([steps.starts for steps in seen])
    assert len(starts) == found.steps
    assert max(len(steps.lengths) for steps in seen) <= 3
    for before, after in pairwise(seen):
        assert np.array_equal(before.end, after.coefficients[0, :, 0])
    if ends:
        assert np.array_equal(found.visited.ends, starts)
