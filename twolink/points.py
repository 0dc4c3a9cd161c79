"""Points and links that users name."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

import numpy as np

from twolink.chain import Point
from twolink.inputs import as_number, check_instance, refuse


def as_point(name: str, value: Any) -> Point:
    """Return a point of link 1 or 2 with finite coordinates, or raise `ParameterError`."""
    check_instance(name, value, Point)
    link, along, across = value
    return Point(
        as_link(f"{name}: link", link),
        _coordinate(f"{name}: along", along),
        _coordinate(f"{name}: across", across),
    )


def as_link(name: str, value: Any) -> int:
    """Return the number of a link, 1 or 2, or raise `ParameterError`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value not in (1, 2):
        refuse(name, value, "1 or 2")
    return int(value)


def _coordinate(name: str, value: Any) -> Any:
    """Return a number of any kind; a real one must be finite."""
    number = as_number(name, value)
    if isinstance(number, Real) and not math.isfinite(number):
        refuse(name, value, "a finite number of m")
    return number
