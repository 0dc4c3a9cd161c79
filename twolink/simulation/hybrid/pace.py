"""The pace dt/ds of an arc on pressed surfaces, whose independent variable s is not time."""

from __future__ import annotations

import functools
import operator
from collections.abc import Sequence

from twolink.arithmetic import Scalar, sqrt


def factors_of_pace(roots: Sequence[Scalar]) -> list[Scalar]:
    """Return the factors whose product is dt/ds: the roots (m^½), and one for each beyond two.

    The latter make dt/ds as small as the product of two roots, not of all: where many roots begin
    at the least one, s would otherwise grow so large that the powers of its steps leave the range
    of the numbers. They are analytic, as the sum of the depths is zero only if every root is.
    """
    beyond = len(roots) - 2
    if beyond <= 0:
        return [*roots]
    size = 1 / sqrt(functools.reduce(operator.add, [root * root for root in roots]))
    return [*roots, *[size] * beyond]


def product(factors: Sequence[Scalar]) -> Scalar:
    """Return the product of some numbers."""
    return functools.reduce(operator.mul, factors)
