"""The first time of a condition, such as a flip, with a bound or "undecided".

Angles leave an open interval: for a flip, between two upright positions. On each step an angle is
a polynomial y, whose distance from the true angle is at most ε: the bound on the error of the run
up to the end of the step, and round-off and truncation of the polynomial. As long as y stays in the
interval by more than ε, the angle has not left it; once y is outside by more than ε, it has. The
first crossing is therefore between the first place where y is within ε of an end (`first_descent`
proves that there is none before) and the first place where it is beyond by ε. The verdict is
"happens", with the middle of the two times and half their distance as the bound; "never", where the
first place does not come; or else "undecided".
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from twolink.effects import effect_class
from twolink.ensembles.blocks import ROUNDING, Block, Ends, Lanes, Spans, values_at
from twolink.ensembles.family import Family
from twolink.ensembles.quantity import Accumulator, Quantity, Variable
from twolink.errors import ParameterError
from twolink.inputs import as_choice, as_positive, as_real, as_word
from twolink.simulation.hybrid.tolerances import POLYNOMIAL
from twolink.simulation.series import powers
from twolink.text import quoted

Array = NDArray[np.float64]

AngleName = Literal["q1", "q2", "elbow", "either"]

# The linear combinations of q1 and q2 that are watched.
_WATCHED: dict[AngleName, tuple[tuple[float, float], ...]] = {
    "q1": ((1.0, 0.0),),
    "q2": ((0.0, 1.0),),
    "elbow": ((-1.0, 1.0),),
    "either": ((1.0, 0.0), (0.0, 1.0)),
}

VERDICTS = ("undecided", "happens", "never")
UNDECIDED, HAPPENS, NEVER = range(3)

# Units in the last place of the ends of an interval, which are computed from π, and of a time.
_OF_A_LEVEL, _OF_A_TIME = 4, 8


@dataclass(frozen=True)
class FirstTime(Quantity):
    """The first time at which an angle crosses a `level` (rad), or a link is upright.

    `of` is "q1", "q2" (absolute angles), "elbow" (q2 − q1) or "either" link. Without a level it is
    a flip: the first time at which a link points against gravity. A time with a bound above
    `within` (s) is undecided.
    """

    name: str = "flip"
    of: AngleName = "q2"
    level: float | None = None
    within: float = 1e-3

    of_state = False
    of_steps = False
    of_spans = True

    def __post_init__(self) -> None:
        """Require a name, an angle, and a finite level; an elbow has no upright position."""
        where = "keep.first"
        name = as_word(f"{where}: name", self.name)
        if not name.isidentifier():
            raise ParameterError(
                f"{where}: name must be letters, digits and underscores, with no digit first;"
                f" got {quoted(name)}"
            )
        as_choice(f"{where}: of", self.of, get_args(AngleName))
        object.__setattr__(self, "within", as_positive(f"{where}: within", self.within))
        if self.level is not None:
            object.__setattr__(self, "level", as_real(f"{where}: level", self.level))
        elif self.of == "elbow":
            raise ParameterError(
                f"{where}: level must be given for the elbow, which has no upright position; got"
                " none"
            )
        if self.level is not None and self.of == "either":
            raise ParameterError(
                f"{where}: of must be one angle where a level is given; got 'either'"
            )

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The time, its bound and the verdict."""
        description = f"first time of {self.name}"
        return (
            Variable(f"{self.name}_time", description, "s", of_end=False),
            Variable(
                f"{self.name}_bound", f"bound on the error of the {description}", "s", of_end=False
            ),
            Variable(
                f"{self.name}_verdict", description, flags=VERDICTS, dtype="u1",
                flags_of_end=(VERDICTS[NEVER],),
            ),
        )  # fmt: skip

    def check(self, family: Family, duration: float) -> None:
        """Raise `ParameterError` for flips of scenes without gravity."""
        if self.level is None and family.tables["effects"].get("gravity") is None:
            raise ParameterError(
                f"keep.first: level must be given for {quoted(self.name)} in a scene without"
                " gravity, where no position is upright; got none"
            )

    def accumulator(self, lanes: Lanes) -> Accumulator:
        """Return an accumulator for runs in lanes."""
        return _Watch(self, lanes)


class _Interval(NamedTuple):
    """An angle as weights of q1 and q2, and the ends (rad) that it must not reach, (lanes,)."""

    weights: tuple[float, float]
    low: Array
    high: Array

    def is_unsure(self, lanes: Lanes) -> Any:
        """Return in which lanes it has no ends, or the start is at one of them but for rounding.

        A single angle and a level are as given, without rounding.
        """
        first, second = (w * q for w, q in zip(self.weights, lanes.q, strict=True))
        slack = _OF_A_LEVEL * ROUNDING * (np.abs(first) + np.abs(second) + math.tau)
        apart = np.minimum(first + second - self.low, self.high - (first + second))
        given = not all(self.weights) and np.isinf(self.low - self.high)
        return ~(given | (apart > slack))

    def of(self, which: Any) -> _Interval:
        """Return the interval of some lanes."""
        return _Interval(self.weights, self.low[which], self.high[which])


def _intervals(asked: FirstTime, lanes: Lanes) -> Iterator[_Interval]:
    """Yield the intervals in which the angles are at the start."""
    for weights in _WATCHED[asked.of]:
        start = weights[0] * lanes.q[0] + weights[1] * lanes.q[1]
        if asked.level is None:
            upright = np.broadcast_to(_upright(lanes), start.shape)
            turns = np.floor((start - upright) / math.tau)
            low = upright + math.tau * turns
            yield _Interval(weights, low, low + math.tau)
        else:
            below = start < asked.level
            yield _Interval(
                weights,
                np.where(below, -np.inf, asked.level),
                np.where(below, asked.level, np.inf),
            )


def _upright(lanes: Lanes) -> Any:
    """Return the angle against gravity (rad), in (−π, π]; NaN where there is no gravity."""
    gravity = effect_class("gravity")
    acting = [effect.acceleration for effect in lanes.effects if isinstance(effect, gravity)]
    x, y = (np.asarray(sum(pair[k] for pair in acting), dtype=float) for k in (0, 1))
    return np.where((x == 0) & (y == 0), np.nan, np.arctan2(-y, -x))


class _Watch(Accumulator):
    """The first exit of angles from their intervals, in lanes."""

    def __init__(self, asked: FirstTime, lanes: Lanes) -> None:
        self._asked = asked
        self._intervals = list(_intervals(asked, lanes))
        self._early = np.full(lanes.width, np.inf)
        self._late = np.full(lanes.width, np.inf)
        # Undecided are flips without gravity, where no pose is upright, and starts at an end.
        self._unknown = np.logical_or.reduce(
            [interval.is_unsure(lanes) for interval in self._intervals]
        )
        # Whether an angle has been seen outside of its interval between two steps that were added.
        self._seen = np.zeros(lanes.width, bool)
        # Whether the error has become unknown before.
        self._blind = np.zeros(lanes.width, bool)

    def add(self, block: Block) -> None:
        """Look for the exits on the steps of a block."""
        numbers = np.arange(len(self._late))[block.which]
        # Steps after a known exit are skipped. Those before it count, also where they come later:
        # intervals that are looked at together go on side by side.
        counts = block.starts < np.where(self._unknown, -np.inf, self._late)[numbers]
        counts &= block.lengths > 0
        for each in self._intervals:
            interval = each.of(numbers)
            steps, lanes = np.nonzero(counts & ~_inside(interval, block))
            if len(steps):
                found = _exits(interval, block, steps, lanes)
                for moments, known in zip(found, (self._early, self._late), strict=True):
                    np.minimum.at(known, numbers[lanes], moments)

    def open_spans(self, spans: Spans) -> Any:
        """Return in which intervals an angle may leave its own for the first time, shape (m, n)."""
        which = spans.which
        needed = np.zeros(spans.errors.shape, bool)
        seen = self._seen[which]
        for each in self._intervals:
            may_leave, outside = _between(each.of(which), spans)
            needed |= may_leave
            seen = seen | outside
        # Unknown errors stay unknown.
        blind = np.isinf(spans.errors) | self._blind[which]
        decided = np.logical_or.accumulate(seen | blind)
        # An interval counts if nothing is decided at its start.
        needed[1:] &= ~decided[:-1]
        needed[0] &= ~(self._seen | self._blind)[which]
        self._seen[which], self._blind[which] = seen.any(axis=0), blind[-1]
        return needed & ~self._unknown[which]

    def known(self) -> Any:
        """Return which lanes have left their intervals for certain."""
        return self._seen | self._unknown

    def values(self, ends: Ends) -> dict[str, Any]:
        """Return the times (s), their bounds (s) and the verdicts."""
        verdicts = self._verdicts()
        happens = verdicts == HAPPENS
        with np.errstate(invalid="ignore"):
            time = np.where(happens, (self._early + self._late) / 2, np.nan)
            bound = (self._late - self._early) / 2 + _OF_A_TIME * ROUNDING * self._late
        name = self._asked.name
        return {
            f"{name}_time": time,
            f"{name}_bound": np.where(happens, bound, np.nan),
            f"{name}_verdict": verdicts,
        }

    def undecided(self) -> Any:
        """Return which lanes are undecided."""
        return self._verdicts() == UNDECIDED

    def _verdicts(self) -> Any:
        with np.errstate(invalid="ignore"):
            known = (self._late - self._early) / 2 <= self._asked.within
        never = np.isinf(self._early) & ~self._unknown & ~self._seen & ~self._blind
        return np.where(never, NEVER, np.where(known, HAPPENS, UNDECIDED)).astype(np.uint8)


def _inside(interval: _Interval, block: Block) -> Any:
    """Return which steps are in the interval for certain, by a bound that costs little."""
    w1, w2 = interval.weights
    if w1 and w2:
        rows = w1 * block.angles[:, 0] + w2 * block.angles[:, 1]
    else:
        rows = block.angles[:, 0] if w1 else block.angles[:, 1]
    size = np.abs(rows[:, -1])
    for k in range(rows.shape[1] - 2, 0, -1):
        size = size * block.lengths + np.abs(rows[:, k])
    # The last two terms, which bound the truncation, are counted twice.
    reach = 2 * size * block.lengths + block.errors + _SLACK * np.abs(rows[:, 0])
    return (rows[:, 0] + reach < interval.high) & (rows[:, 0] - reach > interval.low)


def _between(interval: _Interval, spans: Spans) -> tuple[Any, Any]:
    """Return where between places an angle may leave an interval, and at which it is outside.

    Both are of shape (m, n), the latter at the ends of spans. An angle that goes from a to b by a
    path p comes up to (a + b + p)/2, and down to (a + b − p)/2.
    """
    w1, w2 = interval.weights
    y = w1 * spans.angles[0] + w2 * spans.angles[1]
    half = (abs(w1) * spans.paths[0] + abs(w2) * spans.paths[1]) / 2
    errors = (abs(w1) + abs(w2)) * _BETWEEN * spans.errors
    middle, half = (y[:-1] + y[1:]) / 2, half + errors + _SLACK * np.abs(y[1:])
    inside = (middle + half < interval.high) & (middle - half > interval.low)
    outside = (y[1:] - errors > interval.high) | (y[1:] + errors < interval.low)
    return ~inside, outside


# Errors between two places are allowed to be so many times those at the places.
_BETWEEN = 100.0

# Roundings of an angle, far above those of a polynomial's sum.
_SLACK = 1e-12


def _exits(interval: _Interval, block: Block, steps: Any, lanes: Any) -> tuple[Array, Array]:
    """Return before which times (s) an angle is inside, and by which it is outside; inf if not.

    Both are of shape (m,), for so many steps, each of a lane.
    """
    w1, w2 = interval.weights
    chosen = block.angles[steps, :, :, lanes]
    lengths = block.lengths[steps, lanes]
    # Shape (p + 1, m), for angles on [0, 1].
    y = (w1 * chosen[:, 0] + w2 * chosen[:, 1]).T * powers(lengths, chosen.shape[2]).T
    rounding = POLYNOMIAL * ROUNDING * _sum(np.abs(y))
    cut = _sum(np.abs(y[-2:]))
    errors = (abs(w1) + abs(w2)) * block.errors[steps, lanes] + rounding + cut
    early, late = np.full((2, len(steps)), np.inf)
    swing = _sum(np.abs(y[1:]))
    for ends, sign in ((interval.high, 1.0), (interval.low, -1.0)):
        end = ends[lanes]
        # The distance to the end, positive inside.
        distance = -sign * y
        distance[0] += sign * end
        margin = errors + _OF_A_LEVEL * ROUNDING * np.abs(end)
        # It stays away from the other ends, of which some are infinite.
        away = distance[0] - swing > margin + _SLACK * np.abs(end)
        near = np.flatnonzero(np.isfinite(end) & ~away)
        given, margin, gap = distance[:, near], margin[near], rounding[near]
        early[near] = np.minimum(early[near], first_descent(given, margin))
        place = first_descent(given, -margin - gap)
        # A touch ends above its level, where nothing is certain.
        beyond = _value_and_slope(given, np.minimum(place, 1.0))[0] < -margin
        late[near] = np.minimum(late[near], np.where(beyond, place, np.inf))
    return _times_at(block, steps, lanes, early), _times_at(block, steps, lanes, late)


def _times_at(block: Block, steps: Any, lanes: Any, x: Array) -> Array:
    """Return the times (s) at places in [0, 1] of steps, and inf at infinite places."""
    finite = np.isfinite(x)
    elapsed = np.where(finite, x, 0.0) * block.lengths[steps, lanes]
    if block.clocks is not None:
        clocks = block.clocks[steps, :, lanes].T
        elapsed = values_at(clocks[None], elapsed[None])[0]
    return np.where(finite, block.starts[steps, lanes] + elapsed, np.inf)


@np.errstate(all="ignore")
def first_descent(rows: Array, levels: Array) -> Array:
    """Return the first places in [0, 1] where polynomials descend to levels, inf where they do not.

    `rows`, shape (p + 1, m), are the coefficients. Before its place a polynomial is above its level
    for certain: by y″ ≥ −K, y(x + t) ≥ y(x) + t y′(x) − K t²/2, and t is the largest one at which
    the right side is not below the level. At a simple root this converges as Newton's method does.
    At the place the polynomial is above the level by some roundings, or more in a touch.
    """
    degrees, sizes = np.arange(float(len(rows)))[:, None], np.abs(rows)
    bends = np.maximum(_sum(degrees * (degrees - 1) * sizes), _LEAST)
    tiny = ROUNDING * _sum(sizes)
    of_slopes = POLYNOMIAL * ROUNDING * _sum(degrees * sizes)
    found = np.zeros(len(levels))
    left = np.flatnonzero(rows[0] - levels > tiny)
    for _ in range(_MOST_ADVANCES):
        if not len(left):
            break
        value, slope = _value_and_slope(rows[:, left], found[left])
        above, slope = value - levels[left], slope - of_slopes[left]
        t = _positive_root(above, slope, bends[left])
        x = found[left] + t
        moves = (above > tiny[left]) & (x > found[left])
        found[left] = np.where(moves, np.where(x < 1, x, np.inf), found[left])
        left = left[moves & (x < 1)]
    return found


def _sum(rows: Array) -> Array:
    """Return the sum of rows, one after another: no bit depends on their length."""
    total: Array = functools.reduce(np.add, rows)
    return total


def _positive_root(above: Array, slope: Array, bend: Array) -> Array:
    """Return the t > 0 at which above + slope t − bend t²/2 is zero, in a form without cancelling.

    It is 0 where `above` is not positive.
    """
    above = np.maximum(above, 0.0)
    root = np.sqrt(slope * slope + 2 * bend * above)
    return np.where(slope < 0, 2 * above / (root - slope), (slope + root) / bend)


def _value_and_slope(rows: Array, x: Array) -> tuple[Array, Array]:
    """Return the values and the slopes of polynomials, shape (p + 1, m), each at its place."""
    value, slope = rows[-1], np.zeros(len(x))
    for row in rows[-2::-1]:
        slope = slope * x + value
        value = value * x + row
    return value, slope


# Advances after which a place is not proven to be the last one: a touch takes a few tens.
_MOST_ADVANCES = 200

# A bound on y″ that divides.
_LEAST = 1e-300
