"""Pairs of runs of one precision, and the round-off that both of them may share.

Their difference does not show it. It is that of sums and of loads, and that of all steps, which
grows: as an error of the start does, by a third run from a start nearby, and where loads depend on
speeds or time also as errors of later steps do, by the flows along a run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.simulation.run import Array
from twolink.simulation.smooth.growth_along import RoundOffGrowth, growth_along, is_conservative
from twolink.simulation.smooth.judging import truncation
from twolink.simulation.smooth.round_off import (
    MOST_ROUND_OFF,
    LoadsAlong,
    sums,
    sums_at_most,
)
from twolink.simulation.smooth.runs import Runs
from twolink.simulation.smooth.taylor import TaylorRun
from twolink.simulation.smooth.visited import VisitingRun, largest_until, visited_by


class Pair(NamedTuple):
    """A run and its judge, how far they are `apart`, and the round-off that they may share.

    All up to each time, shape (n,), in rad and rad/s; that which grows does so by the `growth`.
    """

    kept: TaylorRun
    judge: TaylorRun
    apart: Array
    shared: Array
    growth: RoundOffGrowth

    def bound(self, margin: float, more: Array | float) -> Array:
        """Return the error of a run by a margin on the difference, infinite where it is unknown.

        `more` is other round-off that both runs share.
        """
        carried = MOST_ROUND_OFF * self.rounding * self.growth.on_each_step
        return np.asarray(margin * self.apart + self.shared + carried + more)

    @property
    def rounding(self) -> float:
        """The rounding of both runs."""
        return PRECISIONS[self.kept.precision].rounding


class Pairs:
    """The pairs of runs of a scene, with the growth of its errors as far as it is known."""

    def __init__(self, runs: Runs) -> None:
        """Begin without knowledge of the growth."""
        self._runs = runs
        self.growth = RoundOffGrowth(np.full(1, np.inf), np.zeros(1))
        # Of the first run that needs them: they are nearly the same in all runs.
        self._loads: LoadsAlong | None = None

    @property
    def knows_growth(self) -> bool:
        """Whether the growth of errors of the start is known."""
        return bool(np.isfinite(self.growth.from_start).all())

    def pair(self, precision: PrecisionName, orders: tuple[int, int]) -> Pair:
        """Return a run and its judge of some orders.

        The growth of errors of the start is measured by a third run, unless it is known.
        """
        kept, judge, common = self._runs.pair(precision, orders)
        from_start, of_steps = self.growth
        if not self.knows_growth:
            from_start = self._runs.grown_from_start(precision, orders[0])
        if not is_conservative(self._runs.scene.effects):
            # Each run anew: one in longer numbers may stay where loads change fast.
            of_steps = self._grown_on_steps(kept)
        self.growth = RoundOffGrowth(from_start, of_steps)
        apart = common.until(self._runs.times)
        grown = apart / truncation(min(kept.order, judge.order))
        # The run of the higher order takes the more steps, by a few hundredths.
        shared = self.shared(max(kept, judge, key=lambda run: run.steps), grown)
        return Pair(kept, judge, apart, shared, self.growth)

    def shared(self, run: VisitingRun, grown: Array) -> Array:
        """Return the round-off of sums and loads that a run and its judge share up to each time.

        `grown` is the error of a run with a truncation error of 1 on each step.
        """
        times, of_round_off = self._runs.times, self.growth.on_each_step
        known = np.where(np.isfinite(of_round_off), of_round_off, 0.0)
        return sums(run, times) + self._along(run).errors(run, times, np.maximum(grown, known))

    def shared_at_most(self, run: VisitingRun, grown: float) -> float:
        """Return a bound (rad, rad/s) on the round-off of values and that of `shared`, at once.

        `grown` is the error of a run with an error of 1 on each step.
        """
        duration = float(self._runs.times[-1])
        of_loads = self._along(run).errors_at_most(run, duration, grown)
        return sums_at_most(run, duration) + of_loads

    def _along(self, run: VisitingRun) -> LoadsAlong:
        """Return the round-off of loads along the first run."""
        if self._loads is None:
            self._loads = LoadsAlong.along(run)
        return self._loads

    def _grown_on_steps(self, run: TaylorRun) -> Array:
        """Return the growth of errors of later steps along a run, up to each time, shape (n,)."""
        places, states = visited_by(run).everywhere
        found = growth_along(self._runs.scene, run.formulation, places, states)
        return np.asarray(largest_until(self._runs.times, places, found))
