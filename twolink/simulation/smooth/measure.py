"""A smooth motion whose global error is measured, at little more than the cost of a bare run.

Let e be the error of a run of order p. A second run, the judge, has an error r |e|, so that their
difference D satisfies |e| ≤ |D| / (1 − r): a bound, once r is known to be well below 1.

*In one precision.* The truncation error of a step is exp(−2 (p + 1)) by heyoka's choice of steps,
and grows with the motion like any other error. Four orders more divide it by e⁸ ≈ 3000. Two orders
(e⁴ ≈ 55) are not enough: where a few fast steps make all the error, the last coefficients of one
run may happen to vanish there, and r reached 3 in 500 runs; with four it stayed below 0.03 up to
order 13. Round-off is no smaller in the judge, and two runs of one formulation share some of it
(the momenta of the start, the constants of the chain). So this pair serves only up to the order
whose truncation is some fifty roundings; the margin of 3 admits r = 2/3. Where truncation errors
happen to be smaller, the round-off counts: that of as many sums as steps, and eight roundings times
the growth of errors, which a pair of a lower order has measured. Without the latter one motion in
1500, whose truncation errors cancelled, had ten times the reported error.

*In a longer precision.* Nearer to round-off the judge has longer numbers, a higher order (runs of
equal order have equal truncation errors), and the lowest one with a hundredth of the accuracy as
its error. That error, as predicted, is added with a margin: the two may happen to be equal.

The growth of errors over the run, |e| / exp(−2 (p + 1)), also selects the orders and the precision
of all further runs, so that few are in vain; every result is measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from twolink.formulations import EquationsName
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.smooth.taylor import TaylorRun, default_longest_step, taylor_run

_LOWEST_ORDER = 7

# Orders of a judge above that of the run, in the same precision: an error e⁻⁸ times as large.
_MORE = 4

# Factors on the difference from a judge of the same precision, and of a longer one.
MARGIN_OF_LIKE_PRECISIONS = 3.0
_MARGIN = 1.1

# The growth of the truncation error of a step over a run, before the first measurement: that of one
# in four random chains over 10 s, since a judge that is too coarse is the next run to be judged.
_GROWTH = 5e3

# The part of the accuracy for the error of a judge of a longer precision, and for the truncation
# error of a run that it judges.
_OF_THE_JUDGE, _OF_TRUNCATION = 1e-2, 0.2

# The error that round-off leaves, in roundings times the growth, of motions where it is small (the
# median is 0.4). An attempt in vain costs the judge, which may be the next run.
_ROUND_OFF = 0.1

# The same of motions where it is large.
_MOST_ROUND_OFF = 8

# Roundings of a speed that is computed from momenta.
_A_VALUE = 4


@dataclass(frozen=True)
class Measured:
    """The result, its largest error up to each time (rad, rad/s), and all runs."""

    kept: TaylorRun
    errors: Array
    runs: tuple[TaylorRun, ...]

    @property
    def worst(self) -> float:
        """The largest error (rad, rad/s)."""
        return float(self.errors.max())


def measured_run(
    scene: Scene,
    times: Array,
    accuracy: float,
    formulation: EquationsName,
    progress: Callable[[str], Callable[[float], None]],
) -> Measured:
    """Return a run that meets an accuracy, or the most accurate one.

    `progress` maps the name of a run to a function that receives its completed share. Raises
    `SimulationError` if the scene cannot be integrated to the last time.
    """
    search = _Search(scene, times, accuracy, formulation, progress)
    for found in search.attempts():
        if found.worst <= accuracy:
            break
    return found


@dataclass
class _Search:
    """The runs of a scene so far, and the `grown` error of a unit of truncation at each time."""

    scene: Scene
    times: Array
    accuracy: float
    formulation: EquationsName
    progress: Callable[[str], Callable[[float], None]]
    grown: Array | None = None
    runs: dict[tuple[PrecisionName, int], TaylorRun] = field(default_factory=dict)

    def attempts(self) -> Iterator[Measured]:
        """Yield measured runs, the cheapest first: the caller stops at one that suffices."""
        for precision, longer in pairwise(PRECISIONS):
            yield from self._judged_by_order(precision)
            if self._left_by_round_off(precision) <= self.accuracy:
                yield self._judged_by_precision(precision, longer)
        last = tuple(PRECISIONS)[-1]
        yield from self._judged_by_order(last)
        # The finest run: the difference is the error of the coarser one, which is larger.
        yield self._measured(
            self._run(last, PRECISIONS[last].full_order),
            self._run(last, PRECISIONS[last].truncated_order),
            MARGIN_OF_LIKE_PRECISIONS,
        )

    @property
    def growth(self) -> float:
        """The growth of the truncation error of a step over the run."""
        return _GROWTH if self.grown is None else float(self.grown.max())

    def _judged_by_order(self, precision: PrecisionName) -> Iterator[Measured]:
        """Yield runs that are judged by a higher order of their precision, until that is vain."""
        highest = PRECISIONS[precision].truncated_order
        wanted = self.accuracy / MARGIN_OF_LIKE_PRECISIONS
        order = _rung(order_for(wanted / self.growth))
        if self.grown is None:
            # The first pair measures the growth, whatever the accuracy, far above round-off.
            order = min(order, highest - _MORE)
        while order <= highest:
            kept = self._run(precision, self._ready(precision, order, highest))
            judge = self._run(precision, kept.order + _MORE)
            found = self._measured(kept, judge, MARGIN_OF_LIKE_PRECISIONS)
            self._learn(found)
            yield found
            order = _rung(max(order_for(wanted / self.growth), kept.order + 1))

    def _judged_by_precision(self, precision: PrecisionName, longer: PrecisionName) -> Measured:
        """Return a run without truncation error, judged by one of a longer precision."""
        full, most = PRECISIONS[precision].full_order, PRECISIONS[longer].full_order
        order = min(full, order_for(_OF_TRUNCATION * self.accuracy / self.growth))
        kept = self._run(precision, self._ready(precision, order, full))
        judging = order_for(_OF_THE_JUDGE * self.accuracy / self.growth)
        # Runs of equal order have equal truncation errors.
        judging = min(max(judging, kept.order + 2), most)
        judge = self._run(longer, self._ready(longer, judging, most))
        found = self._measured(kept, judge, _MARGIN)
        assert self.grown is not None
        own = truncation(judging) + PRECISIONS[longer].rounding
        errors = found.errors + MARGIN_OF_LIKE_PRECISIONS * own * self.grown
        return replace(found, errors=errors)

    def _left_by_round_off(self, precision: PrecisionName) -> float:
        """Return the expected error (rad, rad/s) of a run without truncation error."""
        return _ROUND_OFF * self.growth * PRECISIONS[precision].rounding

    def _ready(self, precision: PrecisionName, order: int, highest: int) -> int:
        """Return the lowest order of a run that is there, from an order on, or that order."""
        there = [own for kind, own in self.runs if kind == precision and order <= own <= highest]
        return min(there, default=order)

    def _run(self, precision: PrecisionName, order: int) -> TaylorRun:
        """Return the run of a precision and an order."""
        key = precision, order
        if key not in self.runs:
            self.runs[key] = taylor_run(
                self.scene,
                self.times,
                formulation=self.formulation,
                precision=precision,
                order=order,
                longest_step=default_longest_step(self.scene),
                progress=self.progress(f"order {order}, {precision}"),
            )
        return self.runs[key]

    def _learn(self, found: Measured) -> None:
        """Note the growth of errors that a pair of runs showed."""
        grown = found.errors / MARGIN_OF_LIKE_PRECISIONS / truncation(found.kept.order)
        self.grown = grown if self.grown is None else np.maximum(self.grown, grown)

    def _measured(self, kept: TaylorRun, judge: TaylorRun, margin: float) -> Measured:
        """Return a run with its difference from a judge, times a margin."""
        errors = margin * difference(kept, judge)
        if kept.precision == judge.precision:
            errors = errors + _sums(kept, self.times)
            if self.grown is not None:
                errors = errors + _MOST_ROUND_OFF * PRECISIONS[kept.precision].rounding * self.grown
        return Measured(kept, errors, tuple(self.runs.values()))


def difference(first: Any, second: Any) -> Array:
    """Return the largest difference so far of any angle or speed (rad, rad/s), shape (n,).

    The runs have `q` and `u` of shape (2, n), in numbers of any precision.
    """
    earlier, later = np.concatenate([first.q, first.u]), np.concatenate([second.q, second.u])
    if earlier.dtype != later.dtype:
        # NumPy does not convert between long double and heyoka's quadruple numbers.
        earlier = np.vectorize(type(later.flat[0]), otypes=[later.dtype])(earlier)
    return np.asarray(np.maximum.accumulate(np.abs(later - earlier).max(axis=0).astype(float)))


def _sums(run: TaylorRun, times: Array) -> Array:
    """Return the round-off (rad, rad/s) of as many sums as the steps up to each time.

    The error at the start is that of the conversion to momenta and back.
    """
    states = np.concatenate([run.q, run.u]).astype(float)
    sizes = np.maximum.accumulate(np.abs(states).max(axis=0))
    converted = np.abs(states[:, 0] - [*run.scene.q, *run.scene.u]).max()
    steps = run.steps * times / float(times[-1])
    return np.asarray(converted + PRECISIONS[run.precision].rounding * sizes * (_A_VALUE + steps))


def truncation(order: int) -> float:
    """Return the relative truncation error of a step, by heyoka's choice of steps."""
    return math.exp(-2 * (order + 1))


def order_for(error: float) -> int:
    """Return the lowest order whose `truncation` is below an error."""
    return max(_LOWEST_ORDER, 2 * math.ceil((-math.log(error) / 2 - 2) / 2) + 1)


def _rung(order: int) -> int:
    """Return the next order at which a judge is the next run to be judged."""
    return _LOWEST_ORDER + _MORE * math.ceil((order - _LOWEST_ORDER) / _MORE)
