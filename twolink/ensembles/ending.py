"""The ends of runs of a smooth scene in lanes, and steps before the end only where they are needed.

The error is bounded as in `error`. A run and its judge are compared at evenly spaced times, the
places, through which heyoka goes in one call: a call of Python after each step would cost more than
the step. Where the error is too large, the judge is the next run that is measured.

The judge integrates the squares of both speeds as well. By the inequality of Cauchy and Schwarz an
angle turns between two places by no more than the root of their distance in time times the integral
of its squared speed. Few intervals remain in which an angle may reach a level; they are looked at
step by step (`looking`). A run ends where nothing more of it counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import ROUNDING, Ends, Lanes, Spans
from twolink.ensembles.compiled import PATH_UNIT, System
from twolink.ensembles.error import SoFar, states_of
from twolink.ensembles.looking import CloserLook, Intervals
from twolink.ensembles.motions import OF_AN_INTEGRAL, Given, Motions, begun, go_on
from twolink.ensembles.quantity import Accumulator
from twolink.simulation.smooth.judging import MORE_ORDERS
from twolink.simulation.smooth.longest_step import longest_steps

Array = NDArray[np.float64]

PLACES = 32
"""Intervals of a run at whose ends its error is measured."""

# Intervals after which runs may end early: fewer cost more calls, and more cost steps in vain.
_IN_A_PART = 8

# Intervals that are looked at together, which bounds their memory.
_LOOKS = 512

# Paths (rad) so short that errors of the integral need not be small beside it.
_SHORT = 1e-4


@dataclass
class Ending:
    """Runs side by side, of which only the ends are wanted, and what accumulators ask for.

    `numbers` are the parameters, shape (parameters, n). `growths` are the growths of errors that
    pairs of lower orders have measured, shape (n,). Runs that are `brief` end where all is known.
    """

    system: System
    lanes: Lanes
    numbers: Array
    growths: Array
    brief: bool = False
    _judge: Motions | None = None
    _runs: Given = field(init=False)

    def __post_init__(self) -> None:
        """Compute the longest steps (s), shape (n,), and the times of the places (s)."""
        chain, effects, q, u, duration = self.lanes
        with np.errstate(all="ignore"):
            cap = np.asarray(longest_steps(chain, effects, tuple(q), tuple(u), duration))
        times = np.linspace(0.0, duration, PLACES + 1)
        self._runs = Given(self.system, self.lanes, self.numbers, cap, times)

    @classmethod
    def at_the_start(
        cls,
        system: System,
        lanes: Lanes,
        numbers: Array,
        *,
        brief: bool = False,
    ) -> Ending:
        """Return runs of which nothing is known."""
        return cls(system, lanes, numbers, np.zeros(lanes.width), brief)

    def of(self, chosen: Any) -> Ending:
        """Return some of the runs, by their places, shape (m,)."""
        judge = None if self._judge is None else self._judge.of(chosen)
        own = self._runs.lanes_of(chosen), self.numbers[:, chosen], self.growths[chosen]
        return Ending(self.system, *own, self.brief, judge)

    def ends(self, order: int, accumulators: Sequence[Accumulator] = ()) -> tuple[Ends, Any, int]:
        """Return the ends by an order, which runs have none, shape (n,), and the steps of results.

        Accumulators receive the steps that they ask for.
        """
        again = self._judge is not None and self._judge.order == order
        kept = self._judge if again and self._judge else begun(self._runs, order, paths=False)
        judge = self._judge = begun(self._runs, order + MORE_ORDERS, paths=True)
        known_steps = kept.steps.sum()
        known = SoFar.at_the_start(self.lanes, self.growths)
        asked: list[Intervals] = []
        going, done = np.flatnonzero(~kept.lost), np.zeros(self.lanes.width, bool)
        stride = _IN_A_PART if self.brief else PLACES
        for first in range(0, PLACES, stride):
            places = slice(first, first + stride + 1)
            if not again:
                go_on(self._runs, kept, going, places, kept.taken)
            going = going[~kept.lost[going] & (kept.reached[going] >= first + stride)]
            go_on(self._runs, judge, going, places, kept.steps if again else kept.taken)
            going = going[~judge.lost[going]]
            found = self._compared(kept, judge, going, places, known)
            if len(going):
                asked.append(self._asked(kept, judge, going, places, found, accumulators))
            known.note(going, found.of(-1))
            if self.brief:
                done = np.logical_and.reduce([each.known() for each in accumulators])
                going = going[~done[going]]
        lost = kept.lost | judge.lost | ((judge.reached < PLACES) & ~done)
        self._look(kept, judge, asked, accumulators, known, lost)
        states = states_of(self.lanes.chain, kept.variables[:4, -1])
        errors = known.bounds(kept.steps)
        # A run that was the judge before is not made again.
        taken = kept.steps.sum() - known_steps
        return Ends(states[:2], states[2:], np.where(lost, np.nan, errors)), lost, int(taken)

    def _compared(
        self, kept: Motions, judge: Motions, runs: Any, places: slice, known: SoFar
    ) -> SoFar:
        """Return the measures of errors up to places, shape (places, n)."""
        chain = self._runs.lanes_of(runs).chain
        first, second = (
            states_of(chain, each.variables[:4, places, runs]) for each in (kept, judge)
        )
        return known.of(runs).with_states(chain, first, second, kept.order)

    def _asked(
        self,
        kept: Motions,
        judge: Motions,
        runs: Any,
        places: slice,
        found: SoFar,
        accumulators: Sequence[Accumulator],
    ) -> Intervals:
        """Return the intervals between places whose steps are needed."""
        variables = judge.variables[:, places, runs]
        lengths = np.diff(self._runs.times[places])[:, None]
        # Each step rounds the sum of an integral by half of this, even if it adds far less; the
        # other half is for the value at a place.
        rounded = judge.steps[runs] * ROUNDING * variables[4:, 1:]
        integrals = (np.diff(variables[4:], axis=1) + rounded) / PATH_UNIT
        squares = (1 + OF_AN_INTEGRAL) * lengths * integrals
        paths = np.sqrt(np.maximum(squares, 0.0) + _SHORT**2)
        spans = Spans(runs, variables[:2], paths, found.bounds(kept.steps[runs])[1:])
        needed = np.zeros(spans.errors.shape, bool)
        for each in accumulators:
            needed |= each.open_spans(spans)
        first, lanes = np.nonzero(needed)
        place, which = places.start + first, runs[lanes]
        return Intervals(
            which,
            self._runs.times[place],
            self._runs.times[place + 1],
            kept.variables[:, place, which],
            judge.variables[:, place, which],
            found.differences[first, lanes],
            found.sizes[first, lanes],
            kept.steps[which],
            found.growths[first, lanes],
        )

    def _look(
        self,
        kept: Motions,
        judge: Motions,
        asked: Sequence[Intervals],
        accumulators: Sequence[Accumulator],
        known: SoFar,
        lost: Any,
    ) -> None:
        """Give the steps of intervals to the accumulators, and note what they show of errors."""
        if not asked:
            return
        intervals = Intervals(*(np.concatenate(rows, axis=-1) for rows in zip(*asked, strict=True)))
        pools = kept.pool(self.system), judge.pool(self.system)
        for first in range(0, len(intervals.which), _LOOKS):
            part = intervals.of(slice(first, first + _LOOKS))
            which = part.which
            lanes, numbers = self._runs.lanes_of(which), self.numbers[:, which]
            look = CloserLook(kept.order, *pools, lanes, numbers, self._runs.cap[which], part)
            for block in look.blocks():
                for each in accumulators:
                    each.add(block)
            known.note(which, look.intervals.so_far)
            lost[which[look.lost]] = True
