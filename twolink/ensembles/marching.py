"""Runs in lanes, step by step to their ends, each with its own steps.

All lanes take a step in one call. A lane that has reached its end is given to the next run; in
between it takes steps of length 0, which change nothing.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.following import MOST_STEPS
from twolink.ensembles.step import FIRST, FREQUENCY, LAST, LEFT, ROWS, STEPS, Rows, Settings

Array = NDArray[np.float64]

# Lanes, whose rows stay in the memory of a core, no power of two, as rows would then compete for
# one place there; and the number in the widest registers: all of them are computed alike, so that
# bits do not depend on the others.
_LANES, _TOGETHER = 760, 8

# Steps between two looks at which lanes have ended.
_BETWEEN = 8


class Begun(NamedTuple):
    """Runs at their start: states (q, p), shape (4, n), and their duration (s).

    `parameters`, shape (parameters, n), are those of `compiled_step`; the last are `Settings`.
    """

    state: Array
    parameters: Array
    duration: float

    def rows(self, step: Any) -> Array:
        """Return the first rows, shape (ROWS, n)."""
        first = np.zeros((ROWS, self.state.shape[1]))
        Rows.of(first).state[:] = self.state
        # A step to the end, which is at once, finds the frequencies.
        parameters = np.ascontiguousarray(self.parameters)
        found = _stepped(step, first, parameters, 0.0, 1)
        rows = Rows.of(found)
        found[LEFT] = self.duration
        cap = Settings(*self.parameters[-len(Settings._fields) :]).cap
        np.maximum(rows.frequency, 1 / (FIRST * cap), out=found[FREQUENCY])
        return found


def marched(step: Any, runs: Begun) -> Array:
    """Return the rows of runs after their last step, shape (ROWS, n).

    The rows of runs that have no end, since they are not finite or take no further step, are NaN.
    """
    begun = runs.rows(step)
    found = np.full_like(begun, np.nan)
    count = begun.shape[1]
    # Lanes without a run of their own repeat others.
    slots = np.arange(min(_LANES, -(-count // _TOGETHER) * _TOGETHER)) % max(1, count)
    coming = len(slots) if len(slots) <= count else count
    now, parameters = _taken(begun, slots), _taken(runs.parameters, slots)
    while len(slots):
        now = _stepped(step, now, parameters, runs.duration, _BETWEEN)
        ended = (now[LEFT] == 0) & (now[LAST] == 0)
        # Terms beyond the range of float64 leave no length for a step.
        stuck = (now[LEFT] > 0) & (now[LAST] == 0)
        lost = ~np.isfinite(now[LEFT]) | stuck | (now[STEPS] > MOST_STEPS)
        found[:, slots[ended]] = now[:, ended]
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


def _kept(count: int, empty: Any) -> Any:
    """Return the lanes that go on, as many as are computed together: some of them are empty."""
    spare = -(count - len(empty)) % _TOGETHER
    going = np.full(count, len(empty) < count)
    going[empty[spare:]] = False
    return np.flatnonzero(going)


def _stepped(step: Any, now: Array, parameters: Array, duration: float, count: int) -> Array:
    """Return the rows after a number of steps; the given ones may be overwritten."""
    other = np.empty_like(now)
    for _ in range(count):
        step(now, pars=parameters, time=duration - now[LEFT], outputs=other, batch_parallel=False)
        now, other = other, now
    return now


def _taken(rows: Array, places: Any) -> Array:
    return np.ascontiguousarray(rows[:, places])
