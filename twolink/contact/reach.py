"""Whether a point can be beyond a surface, decided exactly by the numbers of the scene.

A point of link 1 moves on a circle about A, and one of link 2 in a disk or a ring about it. Where a
surface is a tangent of this circle, as a floor at the lowest place of B is, the point touches it
without speed and is never beyond it. Round-off would decide between that and an impact that turns
the chain around.
"""

from __future__ import annotations

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
    try:
        first, a, b = map(_exactly, (chain.L1 if link == 2 else 0.0, along, across))
        (x, y), (place_x, place_y) = map(_exactly, normal), map(_exactly, place)
    except (TypeError, ValueError, OverflowError):
        return True
    height = x * place_x + y * place_y
    if height > 0:
        # A itself is behind the line.
        return True
    # The distance of the line from A, squared, against (first + √radius)².
    distance, radius = height * height / (x * x + y * y), a * a + b * b
    rest = distance + first * first - radius
    is_beyond = (
        distance >= first * first and rest >= 0 and rest * rest >= 4 * first * first * distance
    )
    return not is_beyond


def _exactly(number: Any) -> Fraction:
    """Return the exact value of a fraction, or of a number of float64 in any type."""
    return Fraction(number) if isinstance(number, Rational) else Fraction(float(number))
