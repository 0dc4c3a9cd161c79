"""Steps of runs in lanes, for accumulators that need them in few intervals.

An interval is some steps between two looks (`marching`). In most of them an angle cannot reach a
level, by the paths of both angles: these are left. The others are made again from the rows at their
start, with the same bits, for polynomials of the angles and the bound on the error of each step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Block, Spans
from twolink.ensembles.carried_bounds import of_last_steps, uncorrected
from twolink.ensembles.compiled import System
from twolink.ensembles.lane_rows import LAST, LEFT, Rows, Settings
from twolink.ensembles.marching import BETWEEN, Begun, filled_lanes, stepped
from twolink.ensembles.quantity import Accumulator
from twolink.ensembles.step import compiled_angles, compiled_step

Array = NDArray[np.float64]

# Intervals that are made again together, which bounds their memory.
_AT_ONCE = 512


class Interval(NamedTuple):
    """Runs `which`, shape (n,), and their rows at the starts of intervals, shape (ROWS, n)."""

    which: Any
    rows: Array

    def of(self, chosen: Any) -> Interval:
        """Return some of the intervals."""
        return Interval(self.which[chosen], self.rows[:, chosen])


@dataclass
class Watch:
    """The intervals of some runs in which accumulators ask for steps.

    Runs that are `brief` end where all accumulators need no more of their motions.
    """

    runs: Begun
    accumulators: Sequence[Accumulator]
    brief: bool
    asked: list[Interval] = field(default_factory=list)

    def __call__(self, which: Any, before: Array, after: Array) -> Any:
        """Note the intervals that are asked for, and return which runs may end, shape (n,)."""
        first, last = Rows.of(before), Rows.of(after)
        tolerance = Settings(*self.runs.parameters[-len(Settings._fields) :, which]).tolerance
        errors = uncorrected(last) + of_last_steps(last, tolerance)
        errors = np.where(np.isnan(errors), np.inf, errors)
        angles = np.stack([first.state[:2], last.state[:2]], axis=1)
        # The rows are overwritten by later steps.
        paths = last.paths[:, None].copy()
        spans = Spans(which, angles, paths, errors[None])
        needed = np.zeros(len(which), bool)
        for each in self.accumulators:
            needed |= each.open_spans(spans)[0]
        if needed.any():
            self.asked.append(Interval(which[needed], before[:, needed]))
        if not self.brief:
            return np.zeros(len(which), bool)
        return np.logical_and.reduce([each.known() for each in self.accumulators])[which]

    def show(self, system: System) -> None:
        """Give the steps of all intervals that were asked for to the accumulators."""
        if not self.asked:
            return
        which, rows = zip(*self.asked, strict=True)
        intervals = Interval(np.concatenate(which), np.concatenate(rows, axis=1))
        for first in range(0, len(intervals.which), _AT_ONCE):
            block = _block(system, self.runs, intervals.of(slice(first, first + _AT_ONCE)))
            for each in self.accumulators:
                each.add(block)


def _block(system: System, runs: Begun, intervals: Interval) -> Block:
    """Return the steps of intervals."""
    count = len(intervals.which)
    lanes = filled_lanes(count)
    parameters = np.ascontiguousarray(runs.parameters[:, intervals.which[lanes]])
    rows = [np.ascontiguousarray(intervals.rows[:, lanes])]
    step, angles = compiled_step(system, paths=True), compiled_angles(system)
    # A step adds the truncation error of the one before to the region.
    for _ in range(BETWEEN + 1):
        rows.append(stepped(step, rows[-1].copy(), parameters, runs.duration, 1))
    starts = [runs.duration - each[LEFT] for each in rows[:BETWEEN]]
    found = [
        angles(np.ascontiguousarray(each[:4]), pars=parameters[: angles.nparams], time=time)
        for each, time in zip(rows[:BETWEEN], starts, strict=True)
    ]
    return Block(
        np.array(starts)[:, :count],
        np.array([each[LAST, :count] for each in rows[1:-1]]),
        np.array(found).reshape(BETWEEN, 2, -1, len(lanes))[..., :count],
        np.array([uncorrected(Rows.of(each))[:count] for each in rows[2:]]),
        which=intervals.which,
    )
