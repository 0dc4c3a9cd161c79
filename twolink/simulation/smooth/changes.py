"""The shortest time in which loads of user-defined effects change, from their formulas.

A Taylor series does not see a pulse that is nearly zero where a step starts, and two runs may pass
it alike. The kinds of effects of this package have loads that vary everywhere like polynomials,
sines and the state itself. Any other load is evaluated on a grid over the whole time: where values
between points do not approach their interpolation as the grid becomes finer, it is unresolved.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from twolink.chain import Chain
from twolink.effects import Effect, discontinuities, is_built_in, pieces_at, smooth_loads
from twolink.loads import Torque
from twolink.simulation.run import Array
from twolink.simulation.smooth.sized import Sized, sized
from twolink.values import Content

# Intervals of the grid over the duration: three in w of a pulse exp(−(t/w)²) with w = 1e-4 of it,
# of which thirty are above `_SMALL`. Between two discontinuities there are some at least.
_INTERVALS, _FEWEST = 2**15, 2**6

MOST_STEPS = 200_000
"""Steps into which a duration is divided for changes of loads that are found."""

# The part of the time in which a load changes that a step may have.
_OF_A_CHANGE = 0.5

# The coarsest grid, and the part of the interpolation error that must vanish with each halving: of
# a smooth load 15/16 does.
_COARSEST, _LEFT = 8, 0.25

# Below this part of its largest value the changes of a load are not resolved: the ends of a pulse.
_SMALL = 1e-9

# Roundings of the formula that are no change.
_ROUNDINGS = 64 * np.finfo(float).eps

# Numbers of loads that are evaluated together, which bounds the memory.
_AT_ONCE = 2**21

# Intervals around an unresolved one of which finer grids are made, their number, and their depth.
_AROUND, _PLACES, _DEEPEST = 4, 16, 5

# Loads may vanish at the start: beside it they are looked at from these angles (rad) and speeds
# (rad/s) away from it.
_AWAY = (((0.0, 0.0), (0.0, 0.0)), ((0.7, -1.3), (1.1, -0.6)), ((-1.9, 0.4), (-0.8, 1.7)))


def longest_for_loads(
    chain: Chain, effects: tuple[Effect, ...], q: Any, u: Any, duration: float
) -> float:
    """Return the longest step (s) that does not pass a change of loads; it may be infinite.

    An effect declares it, or it is found for those that are not built in; a shorter one than the
    duration divided by `MOST_STEPS` is not resolved. q (rad), u (rad/s) and the numbers of effects
    may be those of runs side by side, shape (lanes,): loads are looked at near the first start.
    """
    declared, unknown = _declared(effects)
    if not unknown:
        return declared
    start = tuple(tuple(float(np.ravel(x)[0]) for x in pair) for pair in (q, u))
    lanes = max(np.size(x) for x in q)
    by_pieces, found = _found(Content((chain,)), Content(unknown), start, duration, lanes)
    return min(declared, by_pieces, max(_OF_A_CHANGE * found, duration / MOST_STEPS))


@functools.lru_cache(maxsize=64)
def _found(
    chain: Content, effects: Content, start: Any, duration: float, lanes: int
) -> tuple[float, float]:
    """Return the shortest times (s) in which loads change: as pieces declare, and as is found.

    The latter is that at poses near a start.
    """
    by_pieces = shortest = math.inf
    for begin, end, pieces in _pieces(effects.objects, duration):
        declared, unknown = _declared(pieces)
        by_pieces = min(by_pieces, declared)
        for q, u in _poses(start) if unknown else ():
            load = Load(chain.objects[0], unknown, q, u)
            count = max(_FEWEST, _INTERVALS * (end - begin) / duration)
            shortest = min(shortest, load.shortest_change(begin, end, count, lanes))
    return by_pieces, shortest


def _declared(effects: tuple[Effect, ...]) -> tuple[float, tuple[Effect, ...]]:
    """Return the shortest time (s) that effects declare, and those whose times are not known."""
    times = [float(np.min(effect.shortest_time)) for effect in effects]
    unknown = tuple(
        effect
        for effect, time in zip(effects, times, strict=True)
        if time == math.inf and not is_built_in(effect)
    )
    return min(times, default=math.inf), unknown


def _pieces(
    effects: tuple[Effect, ...], duration: float
) -> Iterator[tuple[float, float, tuple[Effect, ...]]]:
    """Yield the intervals between discontinuities (s), each with its smooth effects."""
    inside = [t for t in discontinuities(effects) if 0 < t < duration]
    for begin, end in pairwise([0.0, *inside, duration]):
        yield begin, end, pieces_at(effects, begin)


def poses_near(start: Any) -> Iterator[tuple[Any, Any]]:
    """Yield angles and speeds at which loads are looked at, the `start` first.

    Each pair has the shape of that of the start, (2,) or (2, lanes).
    """
    q, u = (np.array(pair) for pair in start)
    for angles, speeds in np.array(_AWAY):
        yield tuple((q.T + angles).T), tuple((u.T + speeds).T)


def _poses(start: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the same as numbers that carry their round-off.

    Functions of floats would raise errors where those of NumPy return NaN.
    """
    for (q1, q2), (u1, u2) in poses_near(start):
        yield (Sized(q1), Sized(q2)), (Sized(u1), Sized(u2))


@dataclass(frozen=True)
class Load:
    """The loads of effects at a pose of a chain, as functions of time."""

    chain: Chain
    effects: tuple[Effect, ...]
    q: Any
    u: Any

    def shortest_change(self, begin: float, end: float, count: float, lanes: int) -> float:
        """Return the shortest time (s) in which the loads change, from a number of intervals.

        The numbers of effects may be arrays, shape (lanes,), whose size bounds the grid.
        """
        parts = math.ceil(count * lanes / _AT_ONCE)
        ends = np.linspace(begin, end, parts + 1)
        grids = [_grid(a, b, count / parts) for a, b in pairwise(ends)]
        small = np.max([_SMALL * self._largest(grid) for grid in grids], axis=0)
        return min(self._in_grid(grid, small, _DEEPEST, _PLACES) for grid in grids)

    def _largest(self, grid: Array) -> Array:
        """Return the largest values of the numbers of loads, shape (numbers, 1 or lanes)."""
        values, _ = self._at(grid)
        return np.abs(values).max(axis=1)

    def _in_grid(self, grid: Array, small: Array, depth: int, places: int) -> float:
        """Return the shortest time (s) in which the loads change on a grid, and on finer ones.

        Finer grids are made around unresolved places, where `small` changes do not count.
        """
        values, noise = self._at(grid)
        if not np.isfinite(values).all():
            # The pose is none of the motion, or the start of a run is refused.
            return math.inf
        spacing = float(grid[1] - grid[0])
        stride, where = _unresolved(values, noise + small[:, None])
        if stride > 2 or not depth:
            return stride * spacing
        found = stride * spacing
        for place in where[:places]:
            around = grid[max(place - _AROUND, 0)], grid[min(place + _AROUND, len(grid) - 1)]
            finer = _grid(*around, _FEWEST)
            found = min(found, self._in_grid(finer, small, depth - 1, 1))
        return found

    def _at(self, times: Array) -> tuple[Array, Array]:
        """Return all numbers of loads that vary, and their round-off: (numbers, n, 1 or lanes)."""
        with np.errstate(all="ignore"):
            loads = smooth_loads(self.effects, self.chain, self.q, self.u, Sized(times[:, None]))
            numbers = [sized(number) for load in loads for number in _numbers(load)]
            rows = [each for each in numbers if np.ndim(each.value) == 2]
            width = max((each.value.shape[1] for each in rows), default=1)
            shape = len(times), width
            values, noise = np.zeros((2, len(rows), *shape))
            for k, each in enumerate(rows):
                values[k], noise[k] = each.value, _ROUNDINGS * (each.error + each.spread)
        return values, noise


def _numbers(load: Any) -> tuple[Any, ...]:
    return (load.moment,) if isinstance(load, Torque) else tuple(load.components)


def _grid(begin: float, end: float, count: float) -> Array:
    """Return the ends of intervals, a power of two of them, at least a number."""
    return np.linspace(begin, end, 2 ** math.ceil(math.log2(max(count, _FEWEST))) + 1)


def _unresolved(values: Array, small: Array) -> tuple[float, Array]:
    """Return the finest stride in which values are unresolved, and the places, worst first.

    The stride is infinite if all are resolved. Values and `small` errors have shape (numbers, n,
    lanes), with n − 1 a power of two.
    """
    count = values.shape[1] - 1
    before, finest, places = None, math.inf, np.zeros(0, int)
    stride = count // _COARSEST
    while stride >= 2:
        errors = _interpolation_errors(values, stride)
        if before is not None:
            padded = np.pad(before, ((0, 0), (1, 1), (0, 0)))
            near = np.maximum(np.maximum(padded[:, :-2], padded[:, 1:-1]), padded[:, 2:])
            allowed = np.maximum(
                _LEFT * np.repeat(near, 2, axis=1), small[:, stride // 2 :: stride]
            )
            over = (errors - allowed).max(axis=(0, 2), initial=-math.inf)
            worst = np.argsort(-over)
            wrong = worst[: np.count_nonzero(over > 0)]
            if len(wrong):
                finest, places = stride, wrong * stride + stride // 2
        before, stride = errors, stride // 2
    return finest, places


def _interpolation_errors(values: Array, stride: int) -> Array:
    """Return the errors of cubic interpolation at the middles of the intervals of a stride."""
    points, middles = values[:, ::stride], values[:, stride // 2 :: stride]
    guess = np.empty_like(middles)
    inner = 9 * (points[:, 1:-2] + points[:, 2:-1]) - (points[:, :-3] + points[:, 3:])
    guess[:, 1:-1] = inner / 16
    for end, four in ((0, points[:, :4]), (-1, points[:, :-5:-1])):
        first, second, third, fourth = four.transpose(1, 0, 2)
        guess[:, end] = (5 * first + 15 * second - 5 * third + fourth) / 16
    return np.abs(middles - guess)
