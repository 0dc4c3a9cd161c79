"""Polynomials with exact coefficients, for the tests of bounds and roots."""

from fractions import Fraction

import numpy as np

from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid.bernstein import rounding_bound

EPSILON = 2.0**-52


def bound_of(coefficients, precision="double"):
    return rounding_bound(coefficients, PRECISIONS[precision].rounding)


def expanded(*factors):
    """Return the coefficients of a product of polynomials, each rounded once."""
    total = [Fraction(1)]
    for factor in factors:
        grown = [Fraction(0)] * (len(total) + len(factor) - 1)
        for i, a in enumerate(total):
            for j, b in enumerate(factor):
                grown[i + j] += a * Fraction(b)
        total = grown
    return total


def as_floats(coefficients):
    return [float(c) for c in coefficients]


def series_like(random, count):
    """Return coefficients that shrink as those of a step that goes to rounding."""
    return list(random.normal(size=count) * np.exp(-1.7 * np.arange(count)))
