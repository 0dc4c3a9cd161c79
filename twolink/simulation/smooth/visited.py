"""The motion of a run at the ends of its steps, between which it changes little.

The time in which a motion changes may become far shorter than at its start: the tip of a whip turns
back within a thousandth of a swing. Errors peak there, and no times that are chosen before the run
show it. A step is as short as a seventh of the radius of convergence of the series.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from twolink.simulation.run import Array
from twolink.simulation.smooth.judging import apart
from twolink.times import merged


@dataclass(frozen=True, eq=False)
class Visited:
    """The motion of a run at some `times` (s), and at the `ends` of its steps (s), both rising.

    The `values` of q and u, shape (4, n), and those `at_ends`, shape (4, m), are in numbers of the
    run, and all times in float64. Ends are rounded to it: where the numbers of a run are longer
    this changes its values, in others it is a rounding of theirs, and the ends are `exact`.
    """

    times: Array
    values: Any
    ends: Array
    at_ends: Any
    exact: bool

    @property
    def known(self) -> tuple[Array, Any]:
        """The times (s) at which the motion is known in its precision, rising; q and u there."""
        if not self.exact:
            return self.times, self.values
        return _sorted(self.times, self.values, self.ends, self.at_ends)

    @property
    def sizes(self) -> tuple[Array, Array]:
        """All times (s), rising, and q and u there in float64, shape (4, n + m)."""
        values, at_ends = (each.astype(float) for each in (self.values, self.at_ends))
        return _sorted(self.times, values, self.ends, at_ends)


def _sorted(times: Array, values: Any, more: Array, other: Any) -> tuple[Array, Any]:
    """Return two arrays of times in one order, and the values that belong to them."""
    every = np.concatenate([times, more])
    order = every.argsort(kind="stable")
    return every[order], np.concatenate([values, other], axis=1)[:, order]


def largest_until(times: Array, places: Array, values: Array) -> Array:
    """Return the largest of the values at rising places (s) up to each time (s), shape (n,)."""
    last = np.searchsorted(places, times, side="right") - 1
    return np.asarray(np.maximum.accumulate(values)[np.maximum(last, 0)])


class Common(NamedTuple):
    """The times (s) at which two runs are known, rising, and their differences (rad, rad/s)."""

    times: Array
    apart: Array

    def until(self, times: Array) -> Array:
        """Return the largest difference up to each time (s), shape (n,)."""
        return largest_until(times, self.times, self.apart)

    def resolves(self, run: Visited) -> bool:
        """Return whether the runs are compared in each step of a run, its ends included."""
        begins, ends = run.ends[:-1], run.ends[1:]
        first = np.searchsorted(self.times, begins)
        last = np.searchsorted(self.times, ends, side="right")
        return bool((last > first).all())


def compared(first: Visited, second: Visited) -> Common:
    """Return the difference of two runs where both are known.

    The second is in numbers as long as those of the first.
    """
    (ours, q), (theirs, p) = first.known, second.known
    # With indices: without them NumPy imports its masked arrays, which takes 30 ms.
    times, here, there = np.intersect1d(ours, theirs, return_indices=True)
    return Common(times, apart(q[:, here], p[:, there]).max(axis=0))


def with_middles(ends: Array) -> Array:
    """Return the ends of steps and their middles (s)."""
    return np.asarray(merged(ends, (ends[1:] + ends[:-1]) / 2))
