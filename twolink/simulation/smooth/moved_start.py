"""A start nearby: its distance from the motion shows how round-off grows.

Truncation errors do not show that where they are far smaller than those of the order, or where they
keep a symmetry of the motion, such as links that spin folded. Nor do two runs that share the
round-off of the start.
"""

from __future__ import annotations

from typing import Any

import numpy as np

# A direction without symmetry, of angles and of speeds.
_ANGLES, _SPEEDS = (1.0, -0.7), (-0.8, 0.9)

ROUNDINGS = 4096
"""The part by which a start is moved to show the growth of its errors, in roundings."""

ON_EACH_STEP = 4.0
"""The growth of errors on each step, in that of an error of the start.

It was seven times as large at the median of random motions, whose truncation errors show it.
"""


def growth_of_moved(apart: Any, part: float, most: float) -> Any:
    """Return the growth of an error of the start, from distances from a run that is moved.

    Those (rad, rad/s) are the largest so far, of a start moved by a `part`. The growth is infinite,
    as it is unknown, where they are above the `most` over which errors grow in proportion.
    """
    return np.where(apart <= most, apart / part, np.inf)


def moved_start(q: Any, u: Any, part: float) -> tuple[Any, Any]:
    """Return angles and speeds that differ by a part of the largest angle and speed.

    Angles count as at least 1 rad. All are numbers of any type, or arrays of one shape.
    """
    angle, speed = part * np.maximum(1.0, _largest(q)), part * _largest(u)
    return _along(q, angle, _ANGLES), _along(u, speed, _SPEEDS)


def _along(values: Any, by: Any, direction: tuple[float, float]) -> tuple[Any, Any]:
    (first, second), (a, b) = values, direction
    return first + a * by, second + b * by


def _largest(values: Any) -> Any:
    """Return the larger size of two numbers, or of each of two arrays, in float64."""
    first, second = (np.abs(np.asarray(each)).astype(float) for each in values)
    largest = np.maximum(first, second)
    return largest if largest.ndim else float(largest)
