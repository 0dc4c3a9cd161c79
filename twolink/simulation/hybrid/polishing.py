"""The only root of a polynomial in an interval, to the last bits, and its lowest place."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

from twolink.simulation.hybrid.bernstein import kind_of


def polished(
    coefficients: Sequence[Any], low: float, high: float, near: float | None = None
) -> Any:
    """Return the only root in an interval, by Newton's method kept inside a bracket.

    It starts `near` a place, by default in the middle. Where the polynomial is not positive at the
    lower end, that is the root.
    """
    at_low = low + 0 * coefficients[-1]
    if horner(coefficients, at_low) <= 0:
        return at_low
    return bracketed(coefficients, low, high, (low + high) / 2 if near is None else near)


def bracketed(coefficients: Sequence[Any], low: float, high: float, near: float) -> Any:
    """Return the only root in an interval at whose lower end the polynomial is positive."""
    if not isinstance(coefficients[0], float):
        # From the root in float64, few iterations in longer precision remain.
        near = bracketed([float(c) for c in coefficients], low, high, near)
    zero = 0 * coefficients[-1]
    low, high = zero + low, zero + high
    x = zero + near if low < near < high else (low + high) / 2
    from_highest, least, before = coefficients[::-1], _least_change(kind_of(coefficients)), zero
    for _ in range(200):
        value, slope = zero, zero
        for c in from_highest:
            slope = slope * x + value
            value = value * x + c
        if value == 0:
            return x
        low, high = (x, high) if value > 0 else (low, x)
        following = x - value / slope if slope != 0 else low
        if low < following < high:
            # Errors are squared: after two changes, the next is the cube of the last by the square
            # of the one before.
            change = abs(following - x)
            if change * change * change < least * following * before * before:
                return following
        else:
            following, change = (low + high) / 2, zero
        if following in (x, low, high):
            return following
        x, before = following, change
    return x


@functools.cache
def _least_change(kind: Any) -> Any:
    """Return the part of a root below which a change of it is less than half a rounding."""
    rounding = kind(1)
    while kind(1) + rounding / 2 != kind(1):
        rounding = rounding / 2
    return rounding / 16


def lowest(coefficients: Sequence[Any], limit: float) -> float | None:
    """Return the place of a minimum inside (0, 1) with a value below a limit, or None."""
    descent = [-k * float(c) for k, c in enumerate(coefficients) if k]
    if descent[0] <= 0 or sum(descent) >= 0:
        return None
    place = bracketed(descent, 0.0, 1.0, 0.5)
    return place if horner(coefficients, place) < limit else None


def horner(coefficients: Sequence[Any], x: Any) -> Any:
    """Return Σ c_k x^k."""
    value = 0 * x
    for c in reversed(coefficients):
        value = value * x + c
    return value
