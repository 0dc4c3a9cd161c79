"""Directions in which a scene is varied: the slopes of all its numbers by one parameter.

A parameter is a number of a scene file; the chain, the effects and the start follow from it by the
reader of scene files. So L1 of a uniform bar also moves its mass centre and changes its inertia.
Slopes are those of parabolas through neighbouring scenes, exact for numbers that depend on a
parameter linearly or as its square, as all numbers do at present; the difference from a second
parabola of half the size is their error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.arithmetic import Pair
from twolink.effects import contact_elements, discontinuities
from twolink.ensembles.family import Family
from twolink.ensembles.numbers import numbers_in
from twolink.errors import SimulationError, TwolinkError

Array = NDArray[np.float64]

# The neighbours of a value, in units of their distance: on both sides if a scene accepts them.
_NEIGHBOURS = ((1, -1), (1, 2), (-1, -2))

# The distance of neighbours, as a share of a value, and the distance from 0.
_SHARE = 0.25

# Slopes of at most so many binary digits are exact. Rounded ones have more, but for one in 10⁷.
_SHORT = 26

# Two parabolas through the same numbers differ by roundings: by far less than this share.
_MOST_DOUBT = 1e-9


@dataclass(frozen=True)
class Direction:
    """The slopes by a parameter of a scene's numbers, and of its start q (rad) and u (rad/s).

    `numbers` are those of the chain with rotors and of the effects, in the order of `numbers_in`.
    `doubt` is the relative error of the slopes, measured.
    """

    numbers: tuple[float, ...]
    q: Pair
    u: Pair
    doubt: float = 0.0


@dataclass(frozen=True)
class Roundings:
    """The numbers of a scene whose slopes by parameters are rounded to float64.

    `units` has a direction for each, in which this number alone varies, with slope 1; `sizes`,
    shape (parameters, units), bound the errors of its slopes.
    """

    units: tuple[Direction, ...]
    sizes: Array

    @classmethod
    def of(cls, given: Sequence[Direction]) -> Roundings:
        """Return the roundings of the slopes of directions.

        Slopes of few digits, such as that of a parameter by itself, are exact.
        """
        slopes = np.array([[*each.numbers, *each.q, *each.u] for each in given])
        sizes = np.where(_is_short(slopes), 0.0, np.spacing(np.abs(slopes)))
        places = np.flatnonzero(sizes.any(axis=0))
        units = []
        for place in places.tolist():
            *numbers, q1, q2, u1, u2 = (np.arange(slopes.shape[1]) == place).astype(float).tolist()
            units.append(Direction(tuple(numbers), (q1, q2), (u1, u2)))
        return cls(tuple(units), sizes[:, places])


def _is_short(numbers: Array) -> Any:
    """Return which numbers have at most half of the digits of float64."""
    mantissas = np.frexp(numbers)[0] * 2.0**_SHORT
    return mantissas == np.round(mantissas)


def directions(family: Family) -> tuple[Direction, ...]:
    """Return the direction of each parameter of a family of scenes, at the values of its scene.

    Raises `SimulationError` for a parameter by which the scene has no derivative.
    """
    return tuple(_direction(family, place) for place in range(len(family.keys)))


def _direction(family: Family, place: int) -> Direction:
    name = ".".join(family.keys[place])
    own = list(family.values)
    value = own[place]
    base, form = _numbers(family, own)

    def at(other: float) -> Array | None:
        """Return the numbers of a scene with another value, or None where it has another form."""
        try:
            found, other_form = _numbers(family, [*own[:place], other, *own[place + 1 :]])
        except TwolinkError:
            return None
        return found if other_form == form else None

    # A power of two keeps the neighbours free of roundings.
    distance = _SHARE * 2.0 ** np.floor(np.log2(abs(value))) if value else _SHARE
    if _moves_corners(family, place):
        raise SimulationError(
            f"{name} must be a number that moves no corner of a load in time, since variational"
            f" equations are integrated from corner to corner; got {value!r}, the time of one"
        )
    if _makes_modes(family, place):
        raise SimulationError(
            f"{name} must be a number beside which no friction or contact acts, since that has"
            f" modes and events; got {value!r}"
        )
    first, second = (_slopes(at, base, value, size) for size in (distance, distance / 2))
    if first is None or second is None:
        raise SimulationError(
            f"{name} must be a number that can be a little greater or less in a scene of the same"
            f" form; got {value!r}"
        )
    changed = first != second
    doubt = float(np.abs((first - second)[changed] / first[changed]).max(initial=0.0))
    if not doubt < _MOST_DOUBT:
        raise SimulationError(
            f"{name} must be a number on which those of the scene depend smoothly; got"
            f" {value!r}, where they do not"
        )
    *numbers, q1, q2, u1, u2 = first.tolist()
    return Direction(tuple(numbers), (q1, q2), (u1, u2), doubt)


def _moves_corners(family: Family, place: int) -> bool:
    """Return whether the corners of loads in time move with a value."""
    own = list(family.values)
    corners = discontinuities(family.parts(own).effects)
    own[place] = float(np.nextafter(own[place], np.inf))
    try:
        return discontinuities(family.parts(own).effects) != corners
    except TwolinkError:
        return False


def _makes_modes(family: Family, place: int) -> bool:
    """Return whether a value next to that of a smooth scene gives it friction or contact."""
    for side in (np.inf, -np.inf):
        own = list(family.values)
        own[place] = float(np.nextafter(own[place], side))
        try:
            parts = family.parts(own)
        except TwolinkError:
            continue
        if contact_elements(parts.effects, parts.chain):
            return True
    return False


def _numbers(family: Family, values: list[float]) -> tuple[Array, object]:
    """Return the numbers of a scene, then q and u of its start, and the form of the scene."""
    parts = family.parts(values)
    numbers, form = numbers_in((parts.chain, parts.effects))
    return np.array([*numbers, *parts.q, *parts.u], dtype=float), form


def _slopes(
    at: Callable[[float], Array | None], base: Array, value: float, distance: float
) -> Array | None:
    """Return the slopes at a value of the parabola through it and two neighbours, if there are."""
    for near, far in _NEIGHBOURS:
        ends = value + near * distance, value + far * distance
        found = at(ends[0]), at(ends[1])
        if found[0] is None or found[1] is None:
            continue
        a, b = ends[0] - value, ends[1] - value
        to_a, to_b = (found[0] - base) / a, (found[1] - base) / b
        # Zeros lose their signs.
        return np.asarray((b * to_a - a * to_b) / (b - a) + 0.0)
    return None
