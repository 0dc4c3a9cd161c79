"""Gauss's quadrature on steps, in any precision, and exact integrals of polynomials' slopes."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.simulation.run import Array

MOMENTS = 8
"""Moments of a defect. For h J = 2.5, the most of a step, the next is some 1e-3 of the defect."""


@dataclass(frozen=True, eq=False)
class GaussRule:
    """Gauss's nodes and weights on [0, 1], in the numbers of a precision.

    `moments`, shape (nodes, 8), are weights of integrals with (1 − τ)^k/k!, k from 1, in float64.
    """

    nodes: Any
    weights: Any
    moments: Array

    def errors_of_slopes(self, length: int) -> Array:
        """Return the combination of c_k that is the error of the rule for y', in float64.

        The rule is exact for powers below twice the number of nodes.
        """
        nodes, weights = self.nodes.astype(float), self.weights.astype(float)
        found = np.zeros(length)
        for k in range(2 * len(nodes) + 1, length):
            found[k] = k * float(weights @ nodes ** (k - 1)) - 1
        return found


@functools.cache
def gauss_rule(count: int, precision: PrecisionName) -> GaussRule:
    """Return Gauss's rule with a number of nodes, at least two."""
    # NumPy's rule is in float64, and its import takes 30 ms.
    from_highest = np.arange(count, 0, -1, dtype=np.longdouble)
    x: Any = np.cos(np.pi * (from_highest - 0.25) / (count + 0.5))
    for _ in range(6):
        x, _ = _newton(x, count)
    if precision == "quadruple":
        x = PRECISIONS[precision].lengthened(x)
        x, _ = _newton(x, count)
    _, slope = _newton(x, count)
    kind = np.dtype(PRECISIONS[precision].number)
    nodes = ((x + 1) / 2).astype(kind)
    weights = (1 / ((1 - x * x) * slope * slope)).astype(kind)
    left, k = (1 - nodes).astype(float)[:, None], np.arange(1, MOMENTS + 1)
    factors = left**k / np.array([math.factorial(each) for each in k])
    return GaussRule(nodes, weights, weights.astype(float)[:, None] * factors)


def _newton(x: Any, count: int) -> tuple[Any, Any]:
    """Return better roots of Legendre's polynomial of a degree, and its slope at x."""
    before, value = 1 + 0 * x, x
    for k in range(2, count + 1):
        before, value = value, ((2 * k - 1) * x * value - (k - 1) * before) / k
    slope = count * (x * value - before) / (x * x - 1)
    return x - value / slope, slope
