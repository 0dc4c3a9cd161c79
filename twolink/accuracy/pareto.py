"""The Pareto front of error and time, the cheapest configuration per digit, and measured orders."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from twolink.accuracy.work_precision import Point

# Asymptotic range of a method: errors below this (rad, rad/s), above rounding by this factor, and
# for fixed steps only the finest few.
_ASYMPTOTIC = 1e-2
_ABOVE_ROUNDING = 100.0
_FINEST = 4


@dataclass(frozen=True)
class Choice:
    """The cheapest point with a number of digits, and the cost factor of one more digit.

    `next_digit` is None if no point has more digits.
    """

    digits: int
    point: Point
    next_digit: float | None


def pareto_front(points: Iterable[Point]) -> tuple[Point, ...]:
    """Return the Pareto-optimal points in error and time, from coarse to fine."""
    front: list[Point] = []
    for point in sorted(
        (p for p in points if not p.failed and p.error > 0), key=lambda p: (p.seconds, p.error)
    ):
        if not front or point.error < front[-1].error:
            front.append(point)
    return tuple(front)


def choices(points: Iterable[Point]) -> tuple[Choice, ...]:
    """Return the cheapest point for 1, 2, 3, … digits, up to the largest available number."""
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


def measured_order(points: Iterable[Point], *, roundoff_floor: float) -> float | None:
    """Return the slope of log error over log step in the asymptotic range of one configuration.

    If the parameter is a tolerance, the step is the mean one, the inverse of the number of steps;
    errors scatter because step distributions differ, and all points are fitted. The slope is a
    least-squares fit through at least three points; the result is None if there are fewer, or if
    the configuration declares no order. `roundoff_floor` is the round-off error (rad, rad/s);
    points near it are excluded.
    """
    inside = [
        p
        for p in points
        if p.order is not None
        and p.steps
        and not p.failed
        and _ABOVE_ROUNDING * roundoff_floor < p.error < _ASYMPTOTIC
    ]
    inside.sort(key=lambda p: -(p.steps or 0))
    if inside and inside[0].parameter == "step":
        inside = inside[:_FINEST]
    if len(inside) < 3:
        return None
    steps = [-math.log10(p.steps) for p in inside if p.steps]
    return float(np.polyfit(steps, [math.log10(p.error) for p in inside], 1)[0])


def by_configuration(points: Iterable[Point]) -> dict[str, tuple[Point, ...]]:
    """Return the points of each configuration by name, in the order of their settings."""
    found: dict[str, list[Point]] = {}
    for point in points:
        found.setdefault(point.configuration, []).append(point)
    return {name: tuple(own) for name, own in found.items()}


def seconds_at(points: Iterable[Point], error: float) -> float | None:
    """Return the time (s) at which one configuration reaches an error, or None.

    The points are in the order of their settings, from coarse to fine. The next finer setting, if
    any, must reach the error too, which excludes accidental hits. The time is interpolated log-log
    between that setting and the one before, so that the result does not depend on the distance of
    a setting from the error.
    """
    return _cost_at(points, error, lambda point: point.seconds)


def operations_at(points: Iterable[Point], error: float) -> float | None:
    """Return the floating-point operations at an error, interpolated as in `seconds_at`, or None.

    They are None, too, if one of the points has neither a count nor an estimate.
    """
    given = tuple(point for point in points if not point.failed)
    if any(point.arithmetic is None for point in given):
        return None
    return _cost_at(given, error, lambda point: point.arithmetic or 0.0)


def _cost_at(points: Iterable[Point], error: float, cost: Callable[[Point], float]) -> float | None:
    usable = [p for p in points if not p.failed and p.error > 0]
    kept = [p.error <= error for p in usable]
    for index, point in enumerate(usable):
        if kept[index] and all(kept[index : index + 2]):
            coarser = usable[index - 1] if index else point
            return _between(coarser, point, error, cost) if coarser.error > error else cost(point)
    return None


def _between(coarse: Point, fine: Point, error: float, cost: Callable[[Point], float]) -> float:
    share = math.log(coarse.error / error) / math.log(coarse.error / fine.error)
    return float(cost(coarse) * (cost(fine) / cost(coarse)) ** share)
