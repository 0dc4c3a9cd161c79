"""The flow of the linearized motion over a step, as expressions.

With J at Gauss's two nodes A and B of a step of length h, the flow is a product of exponentials,

    exp(h (a2 A + a1 B)) exp(h (a1 A + a2 B)),   a1, a2 = 1/4 ± √3/6

of fourth order (S. Blanes and P. C. Moan, Fourth- and sixth-order commutator-free Magnus
integrators for linear and non-linear dynamical systems, 2006, Applied Numerical Mathematics 56,
1519). A motion of constant J is carried without damping of its own, which the flow of a Runge-Kutta
method has.
"""

from __future__ import annotations

import math
from typing import Any

from twolink.ensembles.comparisons import size, total
from twolink.ensembles.deviations import Matrix, Vector, product
from twolink.optional import heyoka

_THIRD = math.sqrt(3) / 6

NODES = 0.5 - _THIRD, 0.5 + _THIRD
"""Gauss's nodes in a step of length 1."""

_WEIGHTS = 0.25 + _THIRD, 0.25 - _THIRD

# The angle (rad) by which an oscillation of the linearized motion turns in a step, and the growth
# or the decay, up to which the series of the exponentials are exact to some 1e-4 and 1e-2.
_TURN, _DECAY = 0.8, 2.5


def derivatives(rates: Vector, variables: Vector) -> Matrix:
    """Return the derivatives of rates by variables: a row for each rate."""
    tensors = heyoka().diff_tensors(rates, diff_args=variables, diff_order=1)
    return [list(row) for row in tensors.jacobian]


def flow(first: Matrix, second: Matrix, length: Any) -> Matrix:
    """Return the flow over a step from the derivatives of the rates at both nodes."""
    more, less = (length * weight for weight in _WEIGHTS)
    before, after = _sum(more, first, less, second), _sum(less, first, more, second)
    return product(_exponential(after), _exponential(before))


def frequency(jacobian: Matrix) -> Any:
    """Return the largest inverse length (1/s) of a step over which flows are exact enough.

    The squares of the eigenvalues of J sum to that of products J_ij J_ji. Those of oscillations are
    negative, whatever the units of the variables.
    """
    turns, decays = [], []
    for i in range(4):
        for j in range(4):
            both = jacobian[i][j] * jacobian[j][i]
            turns.append(size(both) - both)
            decays.append(size(both) + both)
    squares = total(turns) * (0.25 / _TURN**2) + total(decays) * (0.25 / _DECAY**2)
    return heyoka().sqrt(squares)


def _exponential(matrix: Matrix) -> Matrix:
    """Return the series of an exponential to the fourth power, in two products."""
    square = product(matrix, matrix)
    inner = _sum(1 / 6, matrix, 1 / 24, square, 0.5)
    return _sum(1.0, matrix, 1.0, product(square, inner), 1.0)


def _sum(a: Any, one: Matrix, b: Any, other: Matrix, unit: float = 0.0) -> Matrix:
    """Return a times a matrix, b times another, and some of the unit matrix."""
    both = zip(one, other, strict=True)
    found = [[a * x + b * y for x, y in zip(*rows, strict=True)] for rows in both]
    for i in range(4):
        found[i][i] = found[i][i] + unit
    return found
