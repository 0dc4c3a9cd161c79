"""The motion of a run at the ends of its steps, between which it changes little.

The time in which a motion changes may become far shorter than at its start: the tip of a whip turns
back within a thousandth of a swing. Errors peak there, and no times that are chosen before the run
show it. A step is as short as a seventh of the radius of convergence of the series.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from twolink.simulation.run import Array, MotionRun
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
    def everywhere(self) -> tuple[Array, Array]:
        """All times (s), rising, and q and u there in float64, shape (4, n + m)."""
        if not len(self.ends):
            return self.times, self.values.astype(float, copy=False)
        times = np.concatenate([self.times, self.ends])
        values = np.concatenate([self.values.astype(float), self.at_ends.astype(float)], axis=1)
        order = times.argsort(kind="stable")
        return times[order], values[:, order]

    def largest(self, times: Array, sizes: Callable[[Array], Array]) -> Array:
        """Return the largest size up to each time (s), shape (n,), between the times as well.

        `sizes` are those of q and u in float64, shape (4, m) to shape (k, m).
        """
        return self.largest_of(times, self.sizes(sizes))

    def sizes(self, sizes: Callable[[Array], Array]) -> Array:
        """Return the sizes of q and u, shape (k, n + m): at the times, and at the ends of steps."""
        values = self.values.astype(float, copy=False)
        if len(self.ends):
            values = np.concatenate([values, self.at_ends.astype(float, copy=False)], axis=1)
        return sizes(values)

    def largest_of(self, times: Array, sizes: Array) -> Array:
        """Return the largest of these `sizes` up to each time (s), shape (n,)."""
        largest, count = sizes.max(axis=0), len(self.times)
        at_times = largest_until(times, self.times, largest[:count])
        if not len(self.ends):
            return at_times
        return np.maximum(at_times, largest_until(times, self.ends, largest[count:]))


@dataclass(frozen=True, kw_only=True)
class VisitingRun(MotionRun, ABC):
    """A run that has the motion at the times that were `visited`, if this was requested."""

    visited: Visited | None = field(default=None, repr=False, compare=False)


def visited_by(run: VisitingRun) -> Visited:
    """Return the motion of a run that had times to visit, at these and at the ends of its steps."""
    assert run.visited is not None
    return run.visited


def largest_until(times: Array, places: Array, sizes: Array) -> Array:
    """Return the largest of the sizes at rising places (s) up to each time (s), shape (n,).

    It is 0 before the first place.
    """
    last = np.searchsorted(places, times, side="right")
    return np.asarray(np.concatenate([[0.0], np.maximum.accumulate(sizes)])[last])


class Common(NamedTuple):
    """The differences (rad, rad/s) of two runs at the times (s) at which both are known.

    At those at which they were evaluated, and at the ends of steps, both rising.
    """

    times: Array
    apart: Array
    ends: Array
    apart_at_ends: Array

    def until(self, times: Array) -> Array:
        """Return the largest difference up to each time (s), shape (n,)."""
        return np.maximum(
            largest_until(times, self.times, self.apart),
            largest_until(times, self.ends, self.apart_at_ends),
        )

    def unknown(self) -> Common:
        """Return infinite differences at the same times."""
        return self._replace(apart=np.full_like(self.apart, np.inf))

    def resolves(self, run: Visited) -> bool:
        """Return whether the runs are compared in each step of a run, its ends included."""
        if len(self.ends) == len(run.ends) and np.array_equal(self.ends, run.ends):
            return True
        places = np.sort(np.concatenate([self.times, self.ends]))
        first = np.searchsorted(places, run.ends[:-1])
        last = np.searchsorted(places, run.ends[1:], side="right")
        return bool((last > first).all())


def compared(first: Visited, second: Visited) -> Common:
    """Return the difference of two runs where both are known.

    The second is in numbers as long as those of the first.
    """
    times, here, there = _found(first.times, second.times)
    at_times = _apart(first.values[:, here], second.values[:, there])
    if not first.exact:
        return Common(times, at_times, np.zeros(0), np.zeros(0))
    ends, here, there = _found(first.ends, second.times)
    return Common(times, at_times, ends, _apart(first.at_ends[:, here], second.values[:, there]))


def _found(times: Array, others: Array) -> tuple[Array, Any, Array]:
    """Return the times (s) that are among others, both rising, and their places in both."""
    there = np.minimum(np.searchsorted(others, times), len(others) - 1)
    same = others[there] == times
    if same.all():
        return times, slice(None), there
    return times[same], same, there[same]


def _apart(ours: Any, theirs: Any) -> Array:
    """Return the largest difference of q and u, each of shape (4, n), shape (n,)."""
    return np.asarray(apart(ours, theirs).max(axis=0, initial=0.0))


def with_middles(ends: Array) -> Array:
    """Return the ends of steps and their middles (s)."""
    return np.asarray(merged(ends, (ends[1:] + ends[:-1]) / 2))
