"""The precisions and orders of a measured run and of its judge, and the choice between them.

A pair of runs that misses the accuracy shows how much the motion amplifies the error of a step. The
next pair is the cheapest one that is expected to suffice by this growth. The expectation saves
work; only the difference of two runs decides.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.simulation.hybrid.tolerances import (
    LEAST_SHARE,
    OF_BOUNCES,
    OF_DOUBLE,
    SATURATED,
    SHOWN,
)

Array = NDArray[np.float64]

# The constraints of a mode hold to round-off at any accuracy.
_LOWEST_ORDER = 15

# The order without truncation error in double precision.
BEST_ORDER = 21

# The orders of runs in long doubles, one for a judge and the other for the run beside it.
_LONG_ORDERS = 21, 23

# Assumed growth of the errors of a step over a run, before a pair has shown it.
_GROWTH = 1e3

# Margin of a growth that is extrapolated from the time before an error is saturated.
_EXTRAPOLATED = 100.0

# An error stays if it changes by less than the first factor although the errors of steps fall by
# more than the second.
_STAYS, _FALLS = 2.0, 100.0

# A start causes such an error only if it was moved by at least this part of a rounding of the
# earlier result.
_OF_START = 0.1


class Configuration(NamedTuple):
    """A precision and an order, and those of the run that judges it.

    With `shares_judge` it is a run in long doubles whose judge, of the same precision, has judged
    a run in double precision before.
    """

    precision: PrecisionName
    order: int
    judge: PrecisionName
    judging_order: int
    shares_judge: bool = False

    @property
    def is_long(self) -> bool:
        """Whether both runs are of the longest precision."""
        return self.precision == self.judge and not self.shares_judge

    @property
    def rounding(self) -> float:
        """The distance from 1 to the next number in the precision of the result."""
        return PRECISIONS[self.precision].rounding

    @property
    def step_error(self) -> float:
        """The larger relative error of a step of the two runs, by round-off or truncation."""
        return max(
            _step_error(self.precision, self.order), _step_error(self.judge, self.judging_order)
        )


class Seen(NamedTuple):
    """The errors (rad, rad/s) up to each time that a configuration has shown, both of shape (n,).

    They are infinite from the time on at which the judge ends, or does not determine the motion.
    They are `undecided` if the round-off of the judge leaves a choice open. The two runs start
    `apart` (rad or rad/s) if one of them was moved onto a contact, and one of them may have omitted
    `bounces`.
    """

    configuration: Configuration
    times: Array
    errors: Array
    apart: float = 0.0
    bounces: bool = False
    undecided: bool = False

    @property
    def in_long_doubles(self) -> Array:
        """The errors (rad, rad/s) up to each time that two runs in long doubles may share.

        Their difference does not show what both leave out. It is a part of these errors, which are
        those of a run in double precision.
        """
        return (OF_BOUNCES if self.bounces else OF_DOUBLE) * self.errors

    @property
    def is_of_start(self) -> bool:
        """Whether the change of the start has caused the errors, and would in every precision."""
        known = bool(np.isfinite(self.errors).all())
        return self.configuration.is_long and known and self.apart > self.configuration.step_error

    @property
    def leaves_open(self) -> bool:
        """Whether an unknown error may depend on a choice that 113 bits have left open.

        Of two runs in 113 bits this is assumed, whatever has ended them.
        """
        return self.configuration.is_long or (
            self.undecided and self.configuration.judge == "quadruple"
        )

    def stays_as(self, earlier: Seen, accuracy: float) -> bool:
        """Return whether the start causes the errors: they are as large as those of another pair.

        The steps of the `earlier` pair had larger errors, and its start differed by a rounding
        that is no more than ten times the change of the start. No precision reduces that change. A
        pair that shows less of the motion counts only if it misses the accuracy (rad, rad/s) there:
        its judge may have ended early.
        """
        before, now = earlier.configuration, self.configuration
        longer = now.rounding < before.rounding and now.step_error * _FALLS < before.step_error
        if not longer or self.apart < _OF_START * before.rounding:
            return False
        every = earlier.errors, self.errors
        known = [int((errors <= SATURATED).sum()) for errors in every]
        more, share = known[1] - known[0], LEAST_SHARE * len(self.times)
        first, last = (float(errors[: min(known)].max(initial=0.0)) for errors in every)
        if more > share or (-more > share and last <= accuracy):
            return False
        return last > SHOWN and first / _STAYS < last < first * _STAYS

    def expected(self, following: Configuration) -> float:
        """Return the error (rad, rad/s) at the end that another configuration is expected to have.

        The errors of steps grow alike in both. An error of the omitted part of bounces that
        accumulate goes with the square root of round-off (`tolerances.zeno_time`); in quadruple
        precision it is far below any accuracy. Where 113 bits have left a choice open, only the
        last pair has a chance to decide it.
        """
        if following.shares_judge:
            return self._expected_in_long_doubles(following)
        known = np.isfinite(self.errors)
        if self.leaves_open and not known.all():
            return math.inf
        finite = self.errors[known]
        worst = float(finite.max(initial=0.0))
        growth = self._growth(finite)
        expected = math.exp(min(growth + math.log(following.step_error), 700.0))
        if following.is_long or following.precision == self.configuration.precision:
            return expected
        return max(expected, worst * math.sqrt(following.rounding / self.configuration.rounding))

    def _expected_in_long_doubles(self, following: Configuration) -> float:
        """Return the expected error (rad, rad/s) of a run in long doubles with the same judge.

        It is infinite for another judge, and where this run or its judge has ended early.
        """
        own, whole = self.configuration, len(self.errors) == len(self.times)
        judges = {(pair.judge, pair.judging_order) for pair in (own, following)}
        if own.precision != "double" or len(judges) > 1 or not whole:
            return math.inf
        return float(self.in_long_doubles.max())

    def _growth(self, errors: Array) -> float:
        """Return the logarithm of the factor by which the error of a step grows over the motion."""
        own = math.log(self.configuration.step_error)
        large = np.flatnonzero(errors > SATURATED)
        if not len(large):
            worst = float(errors.max(initial=0.0))
            return math.log(worst) - own if worst > 0 else -math.inf
        share = max(float(self.times[large[0]] / self.times[-1]), LEAST_SHARE)
        return (math.log(SATURATED) - own) / share + math.log(_EXTRAPOLATED)


def _step_error(precision: PrecisionName, order: int) -> float:
    """Return the relative error of a step, by round-off or truncation."""
    own = PRECISIONS[precision]
    return max(own.rounding, own.step_tolerance(order))


def configurations(accuracy: float) -> Iterator[Configuration]:
    """Yield the precisions and orders for an accuracy (rad, rad/s), the cheapest first."""
    # The quotient of both may underflow.
    wanted = (math.log(_GROWTH) - math.log(accuracy)) / 2 - 1
    order = max(_LOWEST_ORDER, 2 * math.ceil((wanted - 1) / 2) + 3)
    if order <= 19:
        low, high = _LONG_ORDERS
        yield from _by_long_doubles(order, low if order + 4 <= low else high)
    if order <= BEST_ORDER:
        yield from _by_long_doubles(BEST_ORDER, _LONG_ORDERS[1])
    # The truncation of order 25, 3e-23 of a step, is far below a rounding of long doubles.
    yield Configuration("long double", 23, "quadruple", 25)
    # The judge of the pair before has often been made.
    yield Configuration("quadruple", 31, "quadruple", 25)
    yield Configuration("quadruple", 35, "quadruple", 31)
    yield Configuration("quadruple", 41, "quadruple", 37)


def _by_long_doubles(order: int, judging: int) -> Iterator[Configuration]:
    """Yield a run in double precision with its judge, and one more run in long doubles with it.

    Judges of order 21 and above know the states at events to round-off. With a lower one the speeds
    that count as zero are nearly those that the run in double precision takes for zero, and both
    runs may take the same small speed for none.
    """
    yield Configuration("double", order, "long double", judging)
    other = next(own for own in _LONG_ORDERS if own != judging)
    yield Configuration("long double", other, "long double", judging, shares_judge=True)
