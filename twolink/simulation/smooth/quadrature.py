"""Quadrature on steps: Gauss's nodes, and weights for residuals of Taylor series."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from twolink.simulation.run import Array

MOMENTS = 8
"""Moments of a defect. The next is at most 2.5⁹/9!, or one percent, of the defect."""

# The inner nodes for residuals: Radau's, of the rule with four nodes of which the last is 1.
_INNER = (0.08858795951270395, 0.4094668644407347, 0.7876594617608471)


class ResidualRule(NamedTuple):
    """Nodes in [0, 1], shape (4,), and weights of the integrals of a residual r, by columns.

    `integral`, shape (4, 2), has ∫ r dτ and the part of it that is the term τ^p. `firsts`, shape
    (4, 3), have ∫ ℓ_j R dτ, where R is the integral of r from 0 and ℓ_j is Lagrange's polynomial
    that is 1 at the j-th of Gauss's three nodes; their sum is the first moment. `moments`, shape
    (4, MOMENTS − 1), have ∫ r (1 − τ)^k/k! dτ, k from 2.
    """

    nodes: Array
    integral: Array
    firsts: Array
    moments: Array

    @property
    def noise(self) -> float:
        """The standard deviation of the integral, divided by that of one value at a node."""
        return float(np.linalg.norm(self.integral[:, 0]))


@functools.cache
def residual_rule(order: int) -> ResidualRule:
    """Return the quadrature of residuals of Taylor series of an order p.

    A residual consists of round-off, whose k-th term is some exp(−2 k) times the first, and of a
    term τ^p followed by higher powers, each smaller than the one before by exp(−2). The rule is
    exact for the first three powers and for τ^p: ∫ τ^j (1 − τ)^k/k! dτ = j!/(j + k + 1)!. Its last
    node is the mean of τ weighted by τ^p, so that it is nearly exact for the next power.
    """
    nodes = np.array([*_INNER, (order + 1) / (order + 2)])
    powers = np.array([*range(len(_INNER)), order])
    lagrange = np.linalg.inv(gauss_nodes(3)[:, None] ** np.arange(3))
    exact = [
        [
            1 / (j + 1),
            1 / (j + 1) if j == order else 0.0,
            *(1 / ((j + 1) * (j + 2 + np.arange(3))) @ lagrange),
            *(math.factorial(j) / math.factorial(j + k + 1) for k in range(2, MOMENTS + 1)),
        ]
        for j in powers.tolist()
    ]
    weights = np.linalg.solve(nodes ** powers[:, None], np.array(exact))
    return ResidualRule(nodes, weights[:, :2], weights[:, 2:5], weights[:, 5:])


@functools.cache
def gauss_nodes(count: int) -> Array:
    """Return Gauss's nodes in [0, 1], at least two."""
    # NumPy's rule takes 30 ms to import.
    from_highest = np.arange(count, 0, -1, dtype=np.longdouble)
    x = np.cos(np.pi * (from_highest - 0.25) / (count + 0.5))
    for _ in range(6):
        x = _newton(x, count)
    return np.asarray((x + 1) / 2, dtype=float)


def _newton(x: Array, count: int) -> Array:
    """Return better roots of Legendre's polynomial of a degree."""
    before, value = 1 + 0 * x, x
    for k in range(2, count + 1):
        before, value = value, ((2 * k - 1) * x * value - (k - 1) * before) / k
    slope = count * (x * value - before) / (x * x - 1)
    return np.asarray(x - value / slope)
