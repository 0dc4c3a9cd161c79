"""The order of a bundle and the size of its lanes' state, for an accuracy.

The truncation error of a step follows from the accuracy and the growth of errors. The lowest order
suffices whose own steps have it at a size of the state that all variables stay below: a larger size
makes the steps longer.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth.bundles import RATIOS, SECOND
from twolink.simulation.smooth.judging import order_for, truncation

# The estimated error of a bundle's first lane, in the error of a run with its truncation errors, in
# most motions: the estimate is the largest of three, and longer steps leave more terms of the
# series.
ESTIMATED = 12.0

# Factor on the estimated error: the error was at most four times as large in 1722 bundles of random
# motions (`benchmarks.lanes`).
_MARGIN = 20.0

# Factor on the distance of two lanes, which is known at some times: between these it was at most
# 1.16 times as large in 1722 bundles of random motions (`benchmarks.lanes`), and 1.91 times where a
# search had placed the fastest turn of a whip between them.
_BETWEEN = 2.0

# The error that round-off leaves, in roundings times the growth, of motions where it is large: it
# was 12 in one of a hundred random motions, and 0.4 in half of them. Where it was more, up to 43,
# the margin on the estimate is larger.
_ROUND_OFF = 32 * PRECISIONS["double"].rounding

# Steps of a higher order have truncation errors far below round-off.
_HIGHEST_ORDER = 19

_LOWEST_ORDER = 7

# The order of a bundle that shows the growth of errors, where one for the accuracy is near
# round-off before it is known.
_ORDER_FOR_GROWTH = 11

# The growth of errors before the first measurement, or a smaller one where no order serves it. The
# first lane has the accuracy as well if it is up to thirty times as large, as it is in half of
# random chains over 10 s. It costs some chains a higher order, by a tenth of their time, and saves
# others a second bundle.
_GROWTHS = (3e5, 3e4)

# The least size of the state of the first lane: in the largest variable of the start, which others
# may exceed later, and in the largest one of the motion.
_LARGER_THAN_START, _LARGER_THAN_MOTION = 8.0, 2.0

# The longest step of the first lane, in those of its order at the size of the motion, as a
# logarithm: those are e⁻² of the radius of convergence. Three times as large a logarithm would
# leave estimates of a twentieth of the error.
_LONGER = 0.3

# The least and the largest part by which the start of a lane is moved: round-off is far less, and
# its distance from the first lane is in proportion.
_LEAST_OFFSET, _LARGEST_OFFSET = 1024 * PRECISIONS["double"].rounding, 1e-4


class BundlePlan(NamedTuple):
    """The order of a bundle, and the size of the state of its first lane."""

    order: int
    size: float

    @property
    def offset(self) -> float:
        """The part by which the start of the last lane is moved.

        It grows to about as much as the error of the second lane.
        """
        part = ESTIMATED * float(RATIOS[SECOND]) * truncation(self.order)
        return min(max(part, _LEAST_OFFSET), _LARGEST_OFFSET)


class Bounds(NamedTuple):
    """Bounds on the errors (rad, rad/s) of the first and of the second lane of a bundle."""

    first: float
    second: float


def missed_by_step(order: int, size: float) -> float:
    """Return a bound on the error of a variable by one step, at the size of a state.

    The last term of its series is exp(−2 p) of the size, and the next one is less than half of it.
    """
    return size * math.exp(-2 * order)


def bounds(estimate: float, distance: float, growth: float, of_step: float) -> Bounds:
    """Return the bounds on the errors of two lanes.

    `estimate` is the estimated error of the first one, and `distance` that of the second from it.
    `growth` is the error of a run with a round-off of 1 on each step. A step of the first lane
    misses q or u by at most `of_step`: that is all the error where damping ends it soon, and it is
    largest where steps end.
    """
    first = _MARGIN * estimate + _ROUND_OFF * max(1.0, growth) + of_step
    return Bounds(first, _BETWEEN * distance + float(RATIOS[SECOND]) * of_step + first)


def growth_of(estimate: Any, truncated: float) -> Any:
    """Return the error of a run with an error of 1 on each step.

    `estimate` is that of a first lane whose truncation errors are the part `truncated` of its
    state.
    """
    return estimate / (ESTIMATED * truncated)


class Known(NamedTuple):
    """A motion as a bundle shows it.

    `growth` is the error of a run with a truncation error of 1 on each step, None if it is not
    known, and `of_round_off` that with a round-off of 1. `largest` is the largest variable, at
    least 1.
    """

    growth: float | None
    largest: float
    of_round_off: float = 0.0


class Start(NamedTuple):
    """A motion as its start shows it.

    `largest` is the largest variable at the start, at least 1, and `speed` the error of q or u
    (rad, rad/s) by one of 1 in a variable, which a step misses.
    """

    largest: float
    speed: float


def bundle_plan(accuracy: float, start: Start, known: Known | None = None) -> BundlePlan | None:
    """Return the cheapest bundle that is expected to have an accuracy (rad, rad/s).

    None if round-off leaves no room for it.
    """
    growth = None if known is None else known.growth
    room = accuracy
    if known is not None:
        room -= _ROUND_OFF * max(known.growth or 0.0, known.of_round_off)
    if not room > 0:
        return None
    state = start.largest if known is None else known.largest
    least = _LARGER_THAN_START if known is None else _LARGER_THAN_MOTION
    # What one step misses, in its truncation error.
    of_step = start.speed * missed_by_step(0, state) / truncation(0)
    for expected in _GROWTHS if growth is None else (growth,):
        # For the second lane, or at least for the first.
        for ratio, of_distance in ((float(RATIOS[SECOND]), _BETWEEN), (1.0, 0.0)):
            factor = (of_distance * ratio + _MARGIN) * ESTIMATED * expected + ratio * of_step
            order = max(order_for(room / factor / least), _LOWEST_ORDER)
            if order <= _HIGHEST_ORDER:
                return BundlePlan(order, state * _part(order, room / factor, least))
    return BundlePlan(_ORDER_FOR_GROWTH, state * least) if growth is None else None


def finest_plan(known: Known) -> BundlePlan:
    """Return the bundle with the smallest errors, which shows the largest growth of errors."""
    return BundlePlan(_HIGHEST_ORDER, known.largest * _LARGER_THAN_MOTION)


def _part(order: int, of_state: float, least: float) -> float:
    """Return the size of the state for truncation errors that are a part of it, at least `least`.

    It is that of the first lane, in the largest variable.
    """
    longest = math.exp(_LONGER * order)
    return max(min(of_state / truncation(order), longest), least)
