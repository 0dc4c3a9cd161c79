"""Whether a point can be beyond a surface, decided exactly by the numbers of the scene.

A point of link 1 moves on a circle about A, and one of link 2 in a disk or a ring about it. Where a
surface is a tangent of this circle, as a floor at the lowest place of B is, the point touches it
without speed and is never beyond it. Round-off would decide between that and an impact that turns
the chain around.
"""

from __future__ import annotations

import functools
from fractions import Fraction
from numbers import Rational
from typing import Any

from twolink.chain import Chain
from twolink.contact.coordinates import PointName


def is_reachable(
    chain: Chain, point: PointName, normal: tuple[float, float], place: tuple[float, float]
) -> bool:
    """Return whether a named point can be behind the line through a place with a normal.

    The normal has any length. A chain whose numbers are not real is taken to reach everything.
    """
    link, along, across = getattr(chain, point)
    lengths = chain.L1 if link == 2 else 0.0, along, across
    try:
        return not _is_never_behind(*map(_rational, (*lengths, *normal, *place)))
    except (TypeError, ValueError, OverflowError):
        return True


# Elements are made several times in a run, and exact numbers take longer than all else in them.
@functools.lru_cache(maxsize=256)
def _is_never_behind(
    first: Any, along: Any, across: Any, x: Any, y: Any, place_x: Any, place_y: Any
) -> bool:
    """Return whether a point on link 2 is never behind a line; `first` (m) is the length of link 1.

    It is `along` and `across` link 2 (m), and the line goes through a place (m) with a normal.
    """
    first, a, b, x, y, place_x, place_y = map(
        Fraction, (first, along, across, x, y, place_x, place_y)
    )
    height = x * place_x + y * place_y
    if height > 0:
        # A itself is behind the line.
        return False
    # The distance of the line from A, squared, against (first + √radius)².
    distance, radius = height * height / (x * x + y * y), a * a + b * b
    rest = distance + first * first - radius
    return distance >= first * first and rest >= 0 and rest * rest >= 4 * first * first * distance


def _rational(number: Any) -> Any:
    """Return a fraction as it is, and a number of float64 in any type as that number."""
    return number if isinstance(number, Rational) else float(number)
