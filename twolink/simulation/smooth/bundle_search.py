"""The bundle of lanes that measures a smooth motion to an accuracy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth.bundle_plan import (
    Bounds,
    BundlePlan,
    bundle_plan,
    finest_plan,
)
from twolink.simulation.smooth.bundled import Bundled, start_of
from twolink.simulation.smooth.growth_along import is_conservative
from twolink.simulation.smooth.measured import Measured
from twolink.simulation.smooth.pairs import Pairs
from twolink.simulation.smooth.prediction import Prediction
from twolink.simulation.smooth.round_off import rounding_until
from twolink.simulation.smooth.runs import Runs

# The most bundles of lanes for one motion.
_BUNDLES = 4

# The part of the error of a lane that a bound on its round-off may add to it.
_NEGLIGIBLE = 1 / 16


@dataclass
class BundleSearch:
    """The bundles of a motion so far, from which the `prediction` of further runs learns.

    The `pairs` of further runs have the growth of its errors from them. Code for derivatives took
    `compile_seconds`.
    """

    runs: Runs
    pairs: Pairs
    accuracy: float
    prediction: Prediction
    compile_seconds: float = 0.0
    _last: Bundled | None = None

    def found(self) -> Measured | None:
        """Return the lane of a bundle that has the accuracy, or None if none is expected to.

        Near round-off double precision does not give it.
        """
        start = start_of(self.runs.scene, self.runs.formulation, self.runs.longest_step)
        plan = bundle_plan(self.accuracy, start)
        follows_errors = not is_conservative(self.runs.scene.effects)
        self._expect(plan, follows_errors)
        for _ in range(_BUNDLES):
            found = None if plan is None else self.runs.bundle(plan)
            if found is None:
                return None
            self._last = found
            if follows_errors:
                self.compile_seconds += self.runs.wait_for_errors()
            measured = self.lane_of(found)
            if measured is not None and found.lanes.is_resolved:
                return measured
            # Lanes that have the accuracy are made again, and compared at more times.
            if measured is None:
                plan = bundle_plan(self.accuracy, start, found.known)
                if plan is not None and not found.is_coarser_than(plan):
                    return None
        return None

    def learn_growth(self) -> None:
        """Learn the growth of errors from a bundle with the smallest ones, if it is not known.

        Those of the last bundle may have been too large to grow in proportion.
        """
        last = self._last
        if (
            last is None
            or self.pairs.knows_growth
            or not last.is_coarser_than(finest_plan(last.known))
        ):
            return
        found = self.runs.bundle(finest_plan(last.known))
        if found is not None and found.growth is not None:
            self._in_detail(found)

    def _expect(self, plan: BundlePlan | None, follows_errors: bool) -> None:
        """Compile the derivatives of rates ahead of their use.

        They are needed for the growth of errors, or, near round-off, for those of a run by its
        defect.
        """
        near = plan is not None and plan.order >= PRECISIONS["double"].truncated_order
        if follows_errors or near:
            self.runs.expect_errors()

    def lane_of(self, found: Bundled) -> Measured | None:
        """Return the lane of a bundle that has the accuracy, with an error for the whole motion.

        It is the second one, whose error is nearly its distance from the first, or else the first.
        """
        if found.growth is None:
            return None
        bounds = found.bounds
        if bounds is not None and bounds.first <= self.accuracy:
            bound = bounds.second if bounds.second <= self.accuracy else bounds.first
            shared = self.pairs.shared_at_most(found.first, found.of_round_off)
            measured = self._with_round_off(found, bounds, shared)
            if measured is not None and shared <= _NEGLIGIBLE * bound:
                return measured
        return self._in_detail(found)

    def _in_detail(self, found: Bundled) -> Measured | None:
        """Return the same, by the round-off that two lanes share; further runs learn from it."""
        grown = found.grown_at(self.runs.times)
        self.prediction = self.prediction.learned(grown)
        if found.is_linear:
            self.pairs.growth = found.round_off_growth_at(self.runs.times)
        bounds = found.bounds
        if bounds is None or bounds.first > self.accuracy:
            return None
        # The first lane has the more steps.
        every = self.pairs.shared(found.first, grown)
        self.prediction = self.prediction.sharing(every, PRECISIONS["double"].rounding)
        rounded = rounding_until(found.first, self.runs.times)
        return self._with_round_off(found, bounds, float((every + rounded).max()))

    def _with_round_off(self, found: Bundled, bounds: Bounds, round_off: float) -> Measured | None:
        """Return the lane that has the accuracy, with its error over the whole motion."""
        for kept, bound in ((found.second, bounds.second), (found.first, bounds.first)):
            if bound + round_off <= self.accuracy:
                errors = np.full(len(self.runs.times), bound + round_off)
                return Measured(kept, errors, tuple(self.runs.made))
        return None
