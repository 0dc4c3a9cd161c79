"""Starts nearby: their distances from the motion show how round-off grows.

Truncation errors do not show that where they are far smaller than those of the order, or where they
keep a symmetry of the motion, such as links that spin folded. Nor do two runs that share the
round-off of the start.

One direction may miss the growth: by chance, an error along it has no part that grows. In a linear
motion under loads of a potential energy, the part of a change (Δq, Δu) that grows like e^λt is
p · Δq + p · Δu/λ, where p = M v for a mode v. For Δq = a and Δu = s b, with σ = s/λ, it vanishes
where p is normal to a + σ b. Here b is a turned by a right angle, and the second pair (a, b) is the
first one turned by it: so both sums a + σ b have one length, and are normal to each other, for
every σ. One of them has at least the part |p| √((1 + σ²)/2).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

# Directions of angles and of speeds, without symmetry.
_DIRECTIONS = (((1.0, -0.7), (0.7, 1.0)), ((0.7, 1.0), (-1.0, 0.7)))

FORWARD, ACROSS = range(len(_DIRECTIONS))
"""The numbers of the directions in which starts are moved."""

ROUNDINGS = 4096
"""The part by which a start is moved to show the growth of its errors, in roundings."""

ON_EACH_STEP = 4.0
"""The growth of errors on each step, in that of an error of the start.

It was seven times as large at the median of random motions, whose truncation errors show it.
"""


class Move(NamedTuple):
    """The part of angles and speeds by which a start is moved, and the number of a direction."""

    part: float
    direction: int = FORWARD


def growth_of_moved(apart: Any, part: float, most: float) -> Any:
    """Return the growth of an error of the start, from distances from a run that is moved.

    Those (rad, rad/s) are the largest so far, of a start moved by a `part`. The growth is infinite,
    as it is unknown, where they are above the `most` over which errors grow in proportion.
    """
    return np.where(apart <= most, apart / part, np.inf)


def moved_start(q: Any, u: Any, move: Move) -> tuple[Any, Any]:
    """Return angles and speeds that are moved by a part of the largest angle and speed.

    Angles count as at least 1 rad. All are numbers of any type, or arrays of one shape.
    """
    part, (of_angles, of_speeds) = move.part, _DIRECTIONS[move.direction]
    angle, speed = part * np.maximum(1.0, _largest(q)), part * _largest(u)
    return _along(q, angle, of_angles), _along(u, speed, of_speeds)


def _along(values: Any, by: Any, direction: tuple[float, float]) -> tuple[Any, Any]:
    (first, second), (a, b) = values, direction
    return first + a * by, second + b * by


def _largest(values: Any) -> Any:
    """Return the larger size of two numbers, or of each of two arrays, in float64."""
    first, second = (np.abs(np.asarray(each)).astype(float) for each in values)
    largest = np.maximum(first, second)
    return largest if largest.ndim else float(largest)
