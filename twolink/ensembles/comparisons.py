"""Sums, sizes and comparisons of heyoka's expressions."""

from __future__ import annotations

from typing import Any

from twolink.optional import heyoka


def total(addends: list[Any]) -> Any:
    """Return the sum of expressions."""
    return heyoka().sum(addends)


def two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """Return a sum and the rest that its rounding leaves out, exactly (Knuth, TAOCP 2, 4.2.2)."""
    found = a + b
    of_b = found - a
    return found, (a - (found - of_b)) + (b - of_b)


def size(x: Any) -> Any:
    """Return the absolute value of an expression."""
    return heyoka().select(heyoka().lt(x, 0.0), -x, x)


def largest(*values: Any) -> Any:
    """Return the largest of some expressions; values after the first do not count if not numbers.

    A comparison with NaN is false.
    """
    found, *others = values
    for other in others:
        found = heyoka().select(heyoka().gt(other, found), other, found)
    return found


def smallest(*values: Any) -> Any:
    """Return the smallest of some expressions, as `largest` does."""
    found, *others = values
    for other in others:
        found = heyoka().select(heyoka().lt(other, found), other, found)
    return found
