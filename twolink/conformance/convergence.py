"""The convergence verdict: where an engine's motions go as its step shrinks.

With steps divided by r, motions x_0, x_1, … differ by d_k = |x_k − x_{k+1}|. A method of order p
has d_k / d_{k+1} → r^p, and Richardson's extrapolation x_n + (x_n − x_{n−1}) / (r^p − 1) is its
limit up to higher order (E. Hairer, S. P. Nørsett and G. Wanner, Solving Ordinary Differential
Equations I, 1993, section II.4). Motions of the right equations have the truth as their limit,
those of other equations another one: then the errors level off while the differences shrink. Limits
that are closer than the finest error are not distinguished.

Motions with events, and those of variable steps with their tolerance, have errors that shrink
unevenly: their order is the slope of all differences,
and that of the errors is taken over the last three halvings, each error being the largest at its
setting and all finer ones, as a single small error is no limit; they are not extrapolated. Their
limit is the truth only if the two finest motions have two correct digits, as errors of order one
may fall for a while. It is another model only if the finest motions still approach each other, and
the way that is left to their limit is shorter than the error.

A method may be unstable at coarse settings: the verdict is on the motions behind the last one that
is not finite.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import accumulate, pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Errors shrink with this share of the order of the differences, or more, if the limit is the truth.
_SHARE = 0.5

# The number of last errors, or differences, whose slope is taken if they shrink unevenly.
_UNEVEN = 4

# The largest error, relative to the largest value, of the two finest motions of an uneven sequence
# whose limit is the truth.
_TWO_DIGITS = 0.01

# Differences, and differences of differences, need so many motions.
_LEAST_MOTIONS = 3

# A method converges if a finer setting divides differences by more than this: with half the step,
# the order is above 0.5.
_LEAST_DIVISOR = math.sqrt(2)


class Limit(Enum):
    """Where motions go as the step shrinks."""

    TRUTH = "converges to the truth"
    ANOTHER = "converges to another model"
    NONE = "does not converge"


@dataclass(frozen=True)
class Convergence:
    """The verdict on a method: its limit, the measured order, and errors in rad and rad/s.

    `order` is NaN where rounding hides it; `errors` are those of all motions, from coarse to fine,
    and `limit_error` is that of the extrapolated limit.
    """

    limit: Limit
    order: float
    errors: tuple[float, ...]
    limit_error: float

    @property
    def error(self) -> float:
        """The error of the finest motion (rad, rad/s)."""
        return self.errors[-1]

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        if not math.isfinite(self.error):
            return f"{self.limit.value}; values are not finite at the finest setting"
        order = "" if math.isnan(self.order) else f", order {self.order:.1f}"
        return (
            f"{self.limit.value}{order}; error {self.error:.1e} at the finest setting,"
            f" {self.limit_error:.1e} of its limit"
        )


@dataclass(frozen=True)
class Curve:
    """A method's errors against its settings: steps (s) or tolerances, from coarse to fine."""

    parameter: Literal["step", "tolerance"]
    settings: tuple[float, ...]
    verdict: Convergence

    @property
    def points(self) -> tuple[tuple[float, float], ...]:
        """The settings with their errors (rad, rad/s)."""
        return tuple(zip(self.settings, self.verdict.errors, strict=True))


def convergence(
    motions: Sequence[Array],
    truth: Array,
    epsilon: float,
    ratio: float = 2.0,
    *,
    even: bool = True,
) -> Convergence:
    """Return the verdict on three motions or more, each with its step or tolerance divided by r.

    `ratio` is r; `even` states that a smooth motion has fixed steps. `epsilon` is that of the
    engine's precision: errors below the square root of it, relative to the largest value, are half
    of all digits and no difference of models.
    """
    errors = tuple(float(np.abs(motion - truth).max()) for motion in motions)
    stable = _behind_last_infinite(errors)
    if stable > len(motions) - _LEAST_MOTIONS:
        return Convergence(Limit.NONE, math.nan, errors, math.inf)
    return _of_finite(motions[stable:], truth, epsilon, ratio, errors, even=even)


def _behind_last_infinite(errors: Sequence[float]) -> int:
    """Return the index from which all errors are finite."""
    return max((k + 1 for k, error in enumerate(errors) if not math.isfinite(error)), default=0)


def _of_finite(
    motions: Sequence[Array],
    truth: Array,
    epsilon: float,
    ratio: float,
    errors: tuple[float, ...],
    *,
    even: bool,
) -> Convergence:
    """Return the verdict on finite motions, the last ones of those that have the errors."""
    same = math.sqrt(epsilon) * float(np.abs(truth).max())
    differences = [float(np.abs(one - other).max()) for one, other in pairwise(motions)]
    order = _order(differences, same, ratio) if even else _slope(differences, same, ratio)
    if errors[-1] <= same:
        return Convergence(Limit.TRUTH, order, errors, errors[-1])
    if not ratio**order > _LEAST_DIVISOR:
        if differences[-1] <= same:
            # Motions that agree with each other to half of all digits have a limit, and no order.
            return Convergence(Limit.ANOTHER, math.nan, errors, errors[-1])
        return Convergence(Limit.NONE, order, errors, errors[-1])
    if even:
        shrinking = math.log(errors[-2] / errors[-1], ratio)
        extrapolated = motions[-1] + (motions[-1] - motions[-2]) / (ratio**order - 1)
        left = float(np.abs(extrapolated - truth).max())
        limit = Limit.TRUTH if shrinking >= _SHARE * order else Limit.ANOTHER
        return Convergence(limit, order, errors, left)
    finite = errors[-len(motions) :]
    shrinking = _slope(_from_here_on(finite)[-_UNEVEN:], 0.0, ratio)
    if shrinking >= _SHARE * order and max(finite[-2:]) <= _TWO_DIGITS * np.abs(truth).max():
        return Convergence(Limit.TRUTH, order, errors, errors[-1])
    last = ratio ** _slope(differences[-_UNEVEN:], same, ratio)
    still = last > _LEAST_DIVISOR or differences[-1] <= same
    another = still and differences[-1] / (ratio**order - 1) < errors[-1]
    return Convergence(Limit.ANOTHER if another else Limit.NONE, order, errors, errors[-1])


def _order(differences: Sequence[float], same: float, ratio: float) -> float:
    """Return log_r of the last ratio of differences that rounding does not hide."""
    pairs = [(coarse, fine) for coarse, fine in pairwise(differences) if coarse > 0 and fine > 0]
    seen = [pair for pair in pairs if pair[1] > 1e-4 * same]
    if not pairs or not seen:
        return math.nan
    return math.log(seen[-1][0] / seen[-1][1], ratio)


def _from_here_on(errors: Sequence[float]) -> list[float]:
    """Return, for each error, the largest of it and all finer ones."""
    return list(accumulate(reversed(errors), max))[::-1]


def _slope(differences: Sequence[float], same: float, ratio: float) -> float:
    """Return the slope of log_r of the differences that rounding does not hide."""
    seen = [difference for difference in differences if difference > 1e-4 * same]
    if len(seen) < 2:
        return math.nan
    return float(-np.polyfit(range(len(seen)), np.log(seen) / math.log(ratio), 1)[0])
