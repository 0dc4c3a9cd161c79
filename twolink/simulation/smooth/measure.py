"""A smooth motion whose global error is measured, at little more than the cost of a bare run.

*By lanes side by side.* Well above round-off the lanes of a bundle measure each other (`bundled`).
Effects that are not built in, whose loads are looked at in each step, and runs whose own steps are
wanted, have a second run.

*By a second run.* Let e be the error of a run of order p. A second run, the judge, has an error
r |e|, so that their difference D satisfies |e| ≤ |D| / (1 − r): a bound, once r is known to be well
below 1. They are compared at the requested times and at the ends of all steps of the first: errors
may peak between any times that are chosen beforehand (`visited`).

The truncation error of a step is exp(−2 (p + 1)) by heyoka's choice of steps, and grows with the
motion like any other error. Four orders more divide it by e⁸ ≈ 3000. Two orders (e⁴ ≈ 55) are not
enough: where a few fast steps make all the error, the last coefficients of one run may happen to
vanish there, and r reached 3 in 500 runs; with four it stayed below 0.03 up to order 13. Round-off
is no smaller in the judge, and two runs of one formulation share some of it (the momenta of the
start, the constants of the chain). So this pair serves only up to the order whose truncation is
some fifty roundings; the margin of 2 admits r = 1/2. The same difference bounds the error of the
judge, r |e| ≤ |D| r / (1 − r), so that the judge is the result if only it has the accuracy; the
margin of 1/8 admits r = 1/9. Where truncation errors happen to be smaller, the round-off counts:
that of as many sums as steps, and eight roundings times the growth of errors, which a pair of a
lower order has measured. Without the latter one motion in 1500, whose truncation errors cancelled,
had ten times the reported error. And a third run, of the first order, starts nearby: its distance
shows the growth of the round-off that both runs share. Without it links that spin folded, which
leave that by this round-off alone, had 1e10 times the reported error. Where loads depend on speeds
or time, errors of later steps may grow by more, as the flows along a run show (`growth_along`).

*By its own defect.* Nearer to round-off no second run is needed: the defect of the run's own steps
gives its error, and that of the estimate (`step_errors`). Where the error is above the accuracy and
what its subtraction leaves is below, the run is corrected (`corrected`); where only the round-off
of the estimate is above, the defects of the same steps are evaluated in the next longer precision.

The growth of errors over the run, |e| / exp(−2 (p + 1)), also selects the orders and the precision
of all further runs, so that few runs are discarded; every result is measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from twolink.integration.precisions import PRECISIONS, PrecisionName, longer_than
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.compilation_thread import CompilationThread
from twolink.simulation.run import Array, MotionRun
from twolink.simulation.shortened import UnseenError
from twolink.simulation.smooth.bundle_search import BundleSearch
from twolink.simulation.smooth.corrected import corrected_run
from twolink.simulation.smooth.judging import (
    MARGIN_OF_JUDGES,
    MARGIN_OF_LIKE_PRECISIONS,
    MARGIN_OF_ORDERS,
    MORE_ORDERS,
    truncation,
)
from twolink.simulation.smooth.longest_step import Pace
from twolink.simulation.smooth.measured import Measured
from twolink.simulation.smooth.moved_start import ON_EACH_STEP
from twolink.simulation.smooth.pairs import Pair, Pairs
from twolink.simulation.smooth.prediction import Prediction
from twolink.simulation.smooth.round_off import conversions, rounding_until
from twolink.simulation.smooth.runs import Runs
from twolink.simulation.smooth.step_errors import StepErrors
from twolink.simulation.smooth.taylor import TaylorRun
from twolink.simulation.smooth.visited import VisitingRun

# The part of the accuracy for the expected round-off of a run above which its defect is evaluated
# in longer numbers at once: above it, the round-off of its own precision leaves too little room in
# most motions. An evaluation in long doubles costs a third more than one in double precision, and
# one in quadruple precision five times as much as one in long doubles.
_OF_ESTIMATE: dict[PrecisionName, float] = {"double": 0.05, "long double": 0.25}

# The number of times that steps are shortened for the errors to be carried over them.
_SHORTENINGS = 4

# The expected round-off, in accuracies, of a run for which a correction is tried: it leaves a
# hundredth. A run in quadruple precision costs fifty times one in long doubles, and that six to ten
# times one in double precision.
_OF_ROUND_OFF: dict[PrecisionName, float] = {"double": 100.0, "long double": 200.0}

# The same for a run that is not corrected.
_OF_RAW_ROUND_OFF = 0.2

# Allowance for the growth of truncation errors, where only that of round-off is known.
_PESSIMISM = 10.0


def measured_run(
    scene: Scene,
    times: Array,
    accuracy: float,
    formulation: EquationsName,
    progress: Callable[[str], Callable[[float], None]],
    *,
    correct: bool,
    pace: Pace,
) -> Measured:
    """Return a run that meets an accuracy, or the most accurate one.

    With `correct` it may be a run whose estimated error is subtracted. `progress` maps the name of
    a run to a function that receives its completed share. No step is longer than that of the
    `pace`. Raises `SimulationError` if the scene cannot be integrated to the last time.
    """
    with closing(CompilationThread()) as ahead:
        runs = Runs(scene, times, formulation, progress, pace.longest_step, ahead)
        search = _Search(runs, accuracy, correct, pace.leaving > 0)
        try:
            for found in search.attempts():
                if found.worst <= accuracy:
                    break
        except UnseenError as error:
            found = search.unseen(error)
    in_runs = sum(run.compile_seconds for run in found.runs)
    return replace(found, compile_seconds=search.compile_seconds + in_runs)


@dataclass
class _Search:
    """The runs of a scene so far, and the `prediction` of further ones, for an accuracy.

    Only a result that is to be `correct`ed has its estimated error subtracted. A motion that is
    `balanced` at the start grows from round-off, which runs of one precision share. Code for
    defects took `compile_seconds`.
    """

    runs: Runs
    accuracy: float
    correct: bool
    balanced: bool
    prediction: Prediction = field(default_factory=Prediction)
    compile_seconds: float = 0.0

    @cached_property
    def pairs(self) -> Pairs:
        """The pairs of runs, and the growth of errors."""
        return Pairs(self.runs)

    @cached_property
    def bundles(self) -> BundleSearch | None:
        """The bundles of lanes, None if the motion has none."""
        if self.balanced or not (self.correct and self.runs.may_be_bundled):
            return None
        return BundleSearch(self.runs, self.pairs, self.accuracy, self.prediction)

    def attempts(self) -> Iterator[Measured]:
        """Yield measured runs, the cheapest first: the caller stops at one that suffices."""
        first, *_, last = PRECISIONS
        for precision in PRECISIONS:
            if precision == first and self.bundles is not None:
                yield from self._bundled(self.bundles)
            elif precision == first and not self.balanced:
                yield from self._judged_by_order(precision)
            elif precision == last:
                if self.bundles is not None:
                    self._learn_growth(self.bundles)
                yield from self._judged_by_order(precision)
            noise = self.prediction.left_by_round_off(precision)
            if precision != last and not self._is_vain(precision, noise):
                yield from self._judged_by_defect(precision, noise)
        # The finest run: the difference is the error of the coarser one, which is larger.
        orders = PRECISIONS[last].full_order, PRECISIONS[last].truncated_order
        finest = self._pair(last, orders)
        yield self._of(finest.kept, self._judged(finest, MARGIN_OF_LIKE_PRECISIONS))

    def _bundled(self, bundles: BundleSearch) -> Iterator[Measured]:
        """Yield the lane of a bundle that has the accuracy, if double precision gives it."""
        found = bundles.found()
        self.prediction = bundles.prediction
        self.compile_seconds += bundles.compile_seconds
        if found is not None:
            yield found

    def _learn_growth(self, bundles: BundleSearch) -> None:
        """Learn the growth of errors from lanes, which saves runs of the longest precision."""
        bundles.prediction = self.prediction
        bundles.learn_growth()
        self.prediction = bundles.prediction

    def _judged_by_order(self, precision: PrecisionName) -> Iterator[Measured]:
        """Yield runs that are judged by a higher order of their precision, until that is vain."""
        truncated = PRECISIONS[precision].truncated_order
        order = self.prediction.order_of_pair(self.accuracy, precision)
        if self.prediction.grown is None:
            # The growth of errors selects all further runs, and bounds their round-off. A pair near
            # round-off does not show it where its truncation errors cancel.
            order = min(order, truncated - MORE_ORDERS)
        while order <= truncated:
            order = self._cheapest_pair(precision, order, truncated)
            pair = self._pair(precision, (order, order + MORE_ORDERS))
            errors = self._judged(pair, MARGIN_OF_ORDERS)
            self.prediction = self.prediction.learned(pair.apart / truncation(order))
            yield self._of(pair.kept, errors)
            yield self._of(pair.judge, self._judged(pair, MARGIN_OF_JUDGES))
            order = max(self.prediction.order_of_pair(self.accuracy, precision), order + 2)

    def _cheapest_pair(self, precision: PrecisionName, order: int, highest: int) -> int:
        """Return the order from a lowest to a highest one that costs least with its judge.

        Runs that are there cost nothing, others the square of their order.
        """

        def cost(kept: int) -> int:
            pair = kept, kept + MORE_ORDERS
            return sum(own * own for own in pair if (precision, own) not in self.runs.known)

        known = [own for kind, own in self.runs.known if kind == precision]
        there = [own for own in known if order < own <= highest]
        return min([order, *there], key=cost)

    def _judged_by_defect(self, precision: PrecisionName, noise: float) -> Iterator[Measured]:
        """Yield runs near round-off with their own defects, until a higher order is vain.

        Their expected error by round-off is `noise` (rad, rad/s).
        """
        own, order = PRECISIONS[precision], 0
        while order < own.full_order:
            needed = self.prediction.order_by_defect(self.accuracy)
            order = min(max(needed, order + 2), own.full_order)
            hidden = self.correct and noise > _OF_ESTIMATE[precision] * self.accuracy
            evaluated_in = longer_than(precision) if hidden else precision
            kept, errors = self._with_errors(precision, order, evaluated_in)
            self.runs.known[precision, order] = kept
            yield from self._by_errors(kept, errors)
            if not hidden:
                noise = float(errors.round_off_at(self.runs.times).max())
                grown = _PESSIMISM * errors.round_off_at(self.runs.times) / own.rounding
                self.prediction = self.prediction.learned(grown)
                if self.correct and errors.left_at(self.runs.times).max() <= self.accuracy:
                    # Only the round-off of the estimate is in the way.
                    finer = errors.again(longer_than(precision))
                    if finer is not None:
                        self.compile_seconds += finer.compile_seconds
                        yield from self._by_errors(kept, finer)
            if (
                self._is_vain(precision, noise)
                or conversions(kept, self.runs.times).max() > self.accuracy
            ):
                return
            # Beyond that, the error is the round-off of the run.
            least = max(truncation(order), own.rounding / _PESSIMISM)
            grown = errors.estimate_at(self.runs.times) / least
            self.prediction = self.prediction.learned(grown)

    def _with_errors(
        self, precision: PrecisionName, order: int, evaluated_in: PrecisionName
    ) -> tuple[TaylorRun, StepErrors]:
        """Return a new run and its errors, with steps over which errors are carried."""
        for _ in range(_SHORTENINGS):
            self.runs.expect(precision, order)
            self.compile_seconds += self.runs.wait_for_errors()
            errors = StepErrors(self.runs.scene, self.runs.formulation, precision, evaluated_in)
            self.compile_seconds += errors.compile_seconds
            kept = self.runs.new(precision, order, errors)
            if errors.longest_step >= self.runs.longest_step:
                break
            self.runs.longest_step = errors.longest_step
        return kept, errors

    def _by_errors(self, kept: TaylorRun, errors: StepErrors) -> Iterator[Measured]:
        """Yield a run with its errors, and the corrected one if it has the accuracy."""
        yield self._of(kept, errors.at(self.runs.times) + conversions(kept, self.runs.times))
        left = errors.corrected_at(self.runs.times) + conversions(kept, self.runs.times)
        if self.correct and errors.is_kept and left.max() <= self.accuracy:
            run = corrected_run(kept, self.runs.times, errors.correction(), errors.evaluated_in)
            yield self._of(kept, left, run)

    def _of(self, kept: VisitingRun, errors: Array, result: MotionRun | None = None) -> Measured:
        """Return a run, or a result that is made from it, with its errors, beside all runs.

        Those of values in float64 are included.
        """
        # An error that is not a number is unknown.
        known = np.nan_to_num(errors, nan=math.inf, posinf=math.inf)
        rounded = rounding_until(kept, self.runs.times)
        return Measured(result or kept, known + rounded, tuple(self.runs.made))

    def unseen(self, error: UnseenError) -> Measured:
        """Return a run whose steps pass a change of the loads: its error is unknown."""
        unknown = np.full(len(self.runs.times), math.inf)
        return Measured(error.run, unknown, tuple(self.runs.made), why_unknown=str(error))

    def _is_vain(self, precision: PrecisionName, noise: float) -> bool:
        """Return whether round-off (rad, rad/s) exceeds the accuracy at every order."""
        most = _OF_ROUND_OFF[precision] if self.correct else _OF_RAW_ROUND_OFF
        return noise > most * self.accuracy

    def _pair(self, precision: PrecisionName, orders: tuple[int, int]) -> Pair:
        """Return a run and its judge, from which the prediction learns."""
        found = self.pairs.pair(precision, orders)
        self.prediction = self.prediction.learned(ON_EACH_STEP * found.growth.from_start)
        self.prediction = self.prediction.sharing(found.shared, found.rounding)
        return found

    def _judged(self, pair: Pair, margin: float) -> Array:
        """Return the error that the difference of two runs bounds; infinite where it is unknown."""
        return pair.bound(margin, self.prediction.shared_round_off(pair.rounding))
