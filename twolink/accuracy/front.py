"""What to take: the cheapest way to each number of digits, and the order a method really has."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from twolink.accuracy.work_precision import Point

# Where a method's order shows: errors below this (rad, rad/s), by this factor above rounding, and
# of fixed steps the finest few.
_ASYMPTOTIC = 1e-2
_ABOVE_ROUNDING = 100.0
_FINEST = 4


@dataclass(frozen=True)
class Choice:
    """The cheapest point that has so many digits, and by what factor one more takes longer.

    `next_digit` is None where nothing has more digits.
    """

    digits: int
    point: Point
    next_digit: float | None


def pareto_front(points: Iterable[Point]) -> tuple[Point, ...]:
    """Return the points that no other beats in both error and time, from coarse to fine."""
    front: list[Point] = []
    for point in sorted(
        (p for p in points if not p.failed and p.error > 0), key=lambda p: (p.seconds, p.error)
    ):
        if not front or point.error < front[-1].error:
            front.append(point)
    return tuple(front)


def choices(points: Iterable[Point]) -> tuple[Choice, ...]:
    """Return the cheapest point for 1, 2, 3, … digits, as far as any point has them."""
    front = pareto_front(points)
    if not front:
        return ()
    most = math.floor(-math.log10(front[-1].error))
    found: list[Choice] = []
    for digits in range(1, most + 1):
        point = next(p for p in front if p.error <= 10.0**-digits)
        further = next((p for p in front if p.error <= point.error / 10), None)
        found.append(Choice(digits, point, _factor_a_digit(point, further)))
    return tuple(found)


def _factor_a_digit(point: Point, further: Point | None) -> float | None:
    if further is None:
        return None
    digits = math.log10(point.error / further.error)
    return float((further.seconds / point.seconds) ** (1 / digits))


def measured_order(points: Iterable[Point], *, floor: float) -> float | None:
    """Return the slope of log error against log step over the asymptotic range of one way.

    Where the knob is a tolerance, the mean step stands for the step, the inverse of their number;
    since no two tolerances spread their steps alike, errors scatter, and all points are fitted.
    The slope is that of a straight line through at least three points, fitted by least squares;
    None where there are fewer, or the way declares no order. `floor` is the error that rounding
    makes (rad, rad/s): points near to it show no order.
    """
    inside = [
        p
        for p in points
        if p.order is not None
        and p.steps
        and not p.failed
        and _ABOVE_ROUNDING * floor < p.error < _ASYMPTOTIC
    ]
    inside.sort(key=lambda p: -(p.steps or 0))
    if inside and inside[0].knob == "step":
        inside = inside[:_FINEST]
    if len(inside) < 3:
        return None
    steps = [-math.log10(p.steps) for p in inside if p.steps]
    return float(np.polyfit(steps, [math.log10(p.error) for p in inside], 1)[0])


def ways_of(points: Iterable[Point]) -> dict[str, tuple[Point, ...]]:
    """Return the points of each way, by its name, in the order of their settings."""
    found: dict[str, list[Point]] = {}
    for point in points:
        found.setdefault(point.way, []).append(point)
    return {name: tuple(own) for name, own in found.items()}


def seconds_at(points: Iterable[Point], error: float) -> float | None:
    """Return the time (s) at which one way keeps an error, None where it never does.

    The points are in the order of their settings, from coarse to fine. The next finer setting must
    keep the error too, if there is one: a hit by luck is none. Between that setting and the one
    before time is interpolated, logarithm by logarithm, so that no way is favoured by a setting
    that happens to lie just below the error.
    """
    usable = [p for p in points if not p.failed and p.error > 0]
    kept = [p.error <= error for p in usable]
    for index, point in enumerate(usable):
        if kept[index] and all(kept[index : index + 2]):
            coarser = usable[index - 1] if index else point
            return _between(coarser, point, error) if coarser.error > error else point.seconds
    return None


def _between(coarse: Point, fine: Point, error: float) -> float:
    share = math.log(coarse.error / error) / math.log(coarse.error / fine.error)
    return float(coarse.seconds * (fine.seconds / coarse.seconds) ** share)
