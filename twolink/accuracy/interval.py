"""Intervals of exact decimal numbers, rounded outwards from balls."""

from __future__ import annotations

import math
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any, NamedTuple

from twolink.inputs import refuse


class Interval(NamedTuple):
    """All numbers within `radius` of `centre`, both exact decimal numbers."""

    centre: str
    radius: str

    def __contains__(self, number: object) -> bool:
        """Return whether it contains a number of those that `as_exact` takes."""
        distance = abs(as_exact("a number of an interval", number) - Fraction(self.centre))
        return distance <= Fraction(self.radius)

    def __str__(self) -> str:
        return f"{self.centre} ± {self.radius}"


def as_exact(name: str, value: Any) -> Fraction:
    """Return a float, a whole number, a Fraction, a Decimal or a decimal string exactly.

    Raises `ParameterError` for anything else, and for infinity and NaN.
    """
    try:
        return Fraction(value)
    except (TypeError, ValueError, ArithmeticError):
        refuse(name, value, "a finite real number, or one in decimal digits")


def interval(ball: Any, bound: Any) -> Interval:
    """Return a decimal interval that contains all numbers within a bound of a ball."""
    middle, width = _exact(ball.mid()), _exact(ball.rad()) + _exact(bound.upper())
    if width == 0:
        return Interval(_decimal(middle), "0")
    # One digit beyond the first of the radius; the radius absorbs this rounding.
    places = max(0, 1 - math.floor(_log10(width)))
    centre = Fraction(round(middle * 10**places), 10**places)
    width += abs(middle - centre)
    unit = Fraction(10) ** (math.floor(_log10(width)) - 2)
    radius = math.ceil(width / unit) * unit
    return Interval(_decimal(centre), f"{Decimal(radius.numerator) / Decimal(radius.denominator)}")


def _exact(ball: Any) -> Fraction:
    """Return an exact ball as a rational."""
    mantissa, exponent = (int(part) for part in ball.man_exp())
    return Fraction(mantissa) * Fraction(2) ** exponent


def _log10(x: Fraction) -> float:
    return math.log10(x.numerator) - math.log10(x.denominator)


def _decimal(x: Fraction) -> str:
    """Return a rational whose denominator has no factors but 2 and 5, as a decimal number."""
    with localcontext() as context:
        context.prec = 5000
        return f"{Decimal(x.numerator) / Decimal(x.denominator):f}"
