"""The first time of a condition, such as a flip, with a bound or "undecided".

Angles leave an open interval: for a flip, between two upright positions. On each step an angle is
a polynomial y, whose distance from the true angle is at most ε: the bound on the error of the run
up to the end of the step, and round-off and truncation of the polynomial. As long as y stays in the
interval by more than ε, the angle has not left it; once y is outside by more than ε, it has. The
first crossing is therefore between the first place where y is within ε of an end (`first_fall`
proves by Bernstein coefficients that there is none before) and the first place where it is beyond
by ε. The verdict is "happens", with the middle of the two times and half their distance as the
bound; "never", where the first place does not come; or else "undecided".
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
from twolink.ensembles.blocks import Block, Ends, Lanes
from twolink.ensembles.family import Family
from twolink.ensembles.quantity import Accumulator, Quantity, Variable
from twolink.errors import ParameterError
from twolink.inputs import as_choice, as_positive, as_real, as_word
from twolink.simulation.hybrid.roots import Search, first_fall, rounding_bound
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

_ROUNDING = float(np.finfo(float).eps)

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

    def __post_init__(self) -> None:
        """Require a name, an angle, and a finite level; an elbow has no upright position."""
        where = "keep.first"
        name = as_word(f"{where}: name", self.name)
        if not name.isidentifier():
            raise ParameterError(
                f"{where}: name must be letters, digits and underscores; got {quoted(name)}"
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
        ends = np.array([interval.low for interval in self._intervals])
        # Without gravity no pose is upright, so that flips are undecided.
        self._unknown = np.isnan(ends).any(axis=0)

    def add(self, block: Block) -> None:
        """Look for the exits on the steps of a block."""
        # Decided lanes are skipped.
        open_lanes = (block.lengths > 0) & ~self._unknown & np.isinf(self._late)
        of_each = [open_lanes & ~_inside(interval, block) for interval in self._intervals]
        lanes, steps = np.nonzero(functools.reduce(np.logical_or, of_each).T)
        for lane, step in zip(lanes.tolist(), steps.tolist(), strict=True):
            if self._late[lane] < np.inf or self._unknown[lane]:
                continue
            if not math.isfinite(block.errors[step, lane]):
                # From a step of unknown error on, the lane is undecided.
                self._unknown[lane] = True
                self._early[lane] = min(self._early[lane], block.starts[step, lane])
                continue
            for interval, suspects in zip(self._intervals, of_each, strict=True):
                if suspects[step, lane]:
                    self._look(interval, block, step, lane)

    def values(self, ends: Ends) -> dict[str, Any]:
        """Return the times (s), their bounds (s) and the verdicts."""
        verdicts = self._verdicts()
        happens = verdicts == HAPPENS
        with np.errstate(invalid="ignore"):
            time = np.where(happens, (self._early + self._late) / 2, np.nan)
            bound = (self._late - self._early) / 2 + _OF_A_TIME * _ROUNDING * self._late
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
        never = np.isinf(self._early) & ~self._unknown
        return np.where(never, NEVER, np.where(known, HAPPENS, UNDECIDED)).astype(np.uint8)

    def _look(self, interval: _Interval, block: Block, step: int, lane: int) -> None:
        """Look for the exit of an angle from its interval on a step of a lane."""
        y, error = _polynomial(interval, block, step, lane)
        swing = float(np.abs(y[1:]).sum())
        for end, sign in ((float(interval.high[lane]), 1.0), (float(interval.low[lane]), -1.0)):
            if not math.isfinite(end):
                continue
            # The distance to the end, positive inside.
            distance = (-sign * y).tolist()
            distance[0] += sign * end
            margin = error + _OF_A_LEVEL * _ROUNDING * abs(end)
            if distance[0] - swing > margin + _SLACK * abs(end):
                # It stays away from this end, if not from the other one.
                continue
            early = _first_below(distance, margin)
            if early is None:
                continue
            moment = _time_at(block, step, lane, early)
            self._early[lane] = min(self._early[lane], moment)
            late = _surely_below(distance, -margin)
            if late is not None:
                moment = _time_at(block, step, lane, late)
                self._late[lane] = min(self._late[lane], moment)


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


# Roundings of an angle, far above those of a polynomial's sum.
_SLACK = 1e-12


def _polynomial(interval: _Interval, block: Block, step: int, lane: int) -> tuple[Array, float]:
    """Return an angle on a step as a polynomial on [0, 1], and the bound on its error (rad)."""
    w1, w2 = interval.weights
    rows = block.angles[step, :, :, lane]
    length = block.lengths[step : step + 1, lane]
    y = (w1 * rows[0] + w2 * rows[1]) * powers(length, rows.shape[1])[0]
    weight = abs(w1) + abs(w2)
    error = weight * float(block.errors[step, lane]) + rounding_bound(y.tolist(), _ROUNDING)
    return y, error


def _first_below(distance: list[float], margin: float) -> float | None:
    """Return a place in [0, 1] before which a polynomial exceeds a margin, or None if it does."""
    lowered = [distance[0] - margin, *distance[1:]]
    if lowered[0] <= 0:
        return 0.0
    found: Search = first_fall(lowered, 0.0)
    if found.unsure:
        return 0.0
    places = [float(place) for place in (found.fall, found.touch) if place is not None]
    # The root is polished to a few roundings.
    return max(0.0, min(places) - _POLISHED) if places else None


def _surely_below(distance: list[float], margin: float) -> float | None:
    """Return a place in [0, 1] by which a polynomial has fallen below a (negative) margin."""
    lowered = [distance[0] - margin, *distance[1:]]
    if lowered[0] <= 0:
        return 0.0
    found: Search = first_fall(lowered, 0.0)
    if found.fall is None:
        return None
    place = min(1.0, float(found.fall) + _POLISHED)
    return place


_POLISHED = 1e-12


def _time_at(block: Block, step: int, lane: int, x: float) -> float:
    """Return the time (s) at a place in [0, 1] of a step."""
    start = float(block.starts[step, lane])
    elapsed = x * float(block.lengths[step, lane])
    if block.clocks is not None:
        clock = block.clocks[step, :, lane].tolist()
        elapsed = math.fsum(c * elapsed**k for k, c in enumerate(clock))
    return start + elapsed
