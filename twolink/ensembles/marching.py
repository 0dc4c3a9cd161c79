"""Runs in lanes, step by step to their ends, each with its own steps.

All lanes take a step in one call. A lane that has reached its end is given to the next run; in
between it takes steps of length 0, which change nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.following import MOST_STEPS
from twolink.ensembles.lane_rows import FREQUENCY, LAST, LEFT, ROWS, STEPS, Rows, Settings
from twolink.ensembles.step import FIRST, TOGETHER

Array = NDArray[np.float64]

BETWEEN = 8
"""Steps between two looks at which lanes have ended."""

# Lanes, whose rows stay in the memory of a core; no power of two, as rows would then compete for
# one place there.
_LANES = 760

Look = Callable[[Any, Array, Array], Any]
"""A function of runs (n,) and of their rows before and after some steps, shape (ROWS, n).

It returns which of them end early, shape (n,).
"""


class Begun(NamedTuple):
    """Runs at their start: states (q, p), shape (4, n), and their duration (s).

    `parameters`, shape (parameters, n), are those of `compiled_step`; the last are `Settings`.
    """

    state: Array
    parameters: Array
    duration: float

    def rows(self, step: Any) -> Array:
        """Return the first rows, shape (ROWS, n)."""
        count = self.state.shape[1]
        lanes = filled_lanes(count)
        first = np.zeros((ROWS, len(lanes)))
        Rows.of(first).state[:] = self.state[:, lanes]
        # A step to the end, which is at once, finds the frequencies.
        found = stepped(step, first, _taken(self.parameters, lanes), 0.0, 1)[:, :count]
        rows = Rows.of(found)
        found[LEFT] = self.duration
        cap = Settings(*self.parameters[-len(Settings._fields) :]).cap
        np.maximum(rows.frequency, 1 / (FIRST * cap), out=found[FREQUENCY])
        return found


def marched(step: Any, runs: Begun, look: Look | None = None) -> Array:
    """Return the rows of runs after their last step, shape (ROWS, n).

    The rows of runs that have no end, since they are not finite or take no further step, are NaN.
    `look` is called with the rows before and after `BETWEEN` steps, for which `Rows.paths` begin
    at 0; lanes without a run of their own repeat another, which may come again after its end.
    """
    begun = runs.rows(step)
    found = np.full_like(begun, np.nan)
    count = begun.shape[1]
    slots = filled_lanes(count)[:_LANES]
    coming = len(slots) if len(slots) <= count else count
    now, parameters = _taken(begun, slots), _taken(runs.parameters, slots)
    unfinished = np.full(count, True)
    while len(slots):
        Rows.of(now).paths[:] = 0.0
        before = now.copy() if look else now
        now = stepped(step, now, parameters, runs.duration, BETWEEN)
        ended = (now[LEFT] == 0) & (now[LAST] == 0)
        if look:
            ended |= look(slots, before, now)
        # Terms beyond the range of float64 leave no length for a step.
        stuck = (now[LEFT] > 0) & (now[LAST] == 0)
        lost = ~np.isfinite(now[LEFT]) | stuck | (now[STEPS] > MOST_STEPS)
        new = ended & ~lost & unfinished[slots]
        found[:, slots[new]], unfinished[slots[new]] = now[:, new], False
        free = np.flatnonzero(ended | lost)
        given = np.arange(coming, min(count, coming + len(free)))
        coming += len(given)
        filled, empty = free[: len(given)], free[len(given) :]
        slots[filled] = given
        now[:, filled], parameters[:, filled] = begun[:, given], runs.parameters[:, given]
        if len(empty):
            kept = _kept(len(slots), empty)
            slots, now, parameters = slots[kept], _taken(now, kept), _taken(parameters, kept)
    return found


def stepped(step: Any, now: Array, parameters: Array, duration: float, count: int) -> Array:
    """Return the rows after a number of steps; the given ones may be overwritten.

    Their number of lanes is a multiple of `TOGETHER`.
    """
    assert now.shape[1] % TOGETHER == 0
    other = np.empty_like(now)
    for _ in range(count):
        step(now, pars=parameters, time=duration - now[LEFT], outputs=other, batch_parallel=False)
        now, other = other, now
    return now


def filled_lanes(count: int) -> Any:
    """Return the runs of as many lanes as are computed together: the last of them repeat others."""
    return np.arange(-(-count // TOGETHER) * TOGETHER) % max(1, count)


def _kept(count: int, empty: Any) -> Any:
    """Return the lanes that go on, as many as are computed together: some of them are empty."""
    spare = -(count - len(empty)) % TOGETHER
    going = np.full(count, len(empty) < count)
    going[empty[spare:]] = False
    return np.flatnonzero(going)


def _taken(rows: Array, places: Any) -> Array:
    return np.ascontiguousarray(rows[:, places])
