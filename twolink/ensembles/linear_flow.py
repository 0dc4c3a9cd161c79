"""The flow of the linearized motion over a step, as expressions.

Matrices are arrays of expressions. The flow is the exponential of Magnus's series of sixth order,
from the derivatives J of the rates at Gauss's three nodes. Errors of flows add up over a run, where
the errors that they carry may turn back and forth: a flow of fourth order is not accurate enough
for the thousands of steps of a regular motion.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.comparisons import size, total
from twolink.optional import heyoka
from twolink.simulation.smooth.flows import magnus
from twolink.simulation.smooth.quadrature import gauss_nodes

Matrix = NDArray[Any]

NODES: tuple[float, ...] = tuple(map(float, gauss_nodes(3)))
"""Gauss's nodes in a step of length 1."""

# The angle (rad) by which an oscillation of the linearized motion turns in a step, and the growth
# or the decay, up to which the series of exponentials are exact to some 1e-5 and 1e-2.
_TURN, _DECAY = 0.6, 2.0


def derivatives(rates: list[Any], variables: list[Any]) -> Matrix:
    """Return the derivatives of rates by variables, a row for each rate."""
    tensors = heyoka().diff_tensors(rates, diff_args=variables, diff_order=1)
    return np.asarray(tensors.jacobian)


def flow(jacobians: tuple[Matrix, Matrix, Matrix], length: Any) -> Matrix:
    """Return the flow over a step from the derivatives of the rates at the nodes."""
    first, second, third = (length * each for each in jacobians)
    logarithm, _ = magnus(first, second, third)
    return _exponential(logarithm)


def frequency(jacobian: Matrix) -> Any:
    """Return the largest inverse length (1/s) of a step over which flows are exact enough.

    The squares of the eigenvalues of J sum to that of products J_ij J_ji. Those of oscillations are
    negative, whatever the units of the variables.
    """
    products = (jacobian * jacobian.T).ravel()
    turns = total([size(x) - x for x in products])
    decays = total([size(x) + x for x in products])
    return heyoka().sqrt(turns * (0.25 / _TURN**2) + decays * (0.25 / _DECAY**2))


def _exponential(matrix: Matrix) -> Matrix:
    """Return the series of an exponential to the sixth power, in three products."""
    one = np.eye(4)
    square = matrix @ matrix
    cube = matrix @ square
    last = cube @ (one * (1 / 6) + matrix * (1 / 24) + square * (1 / 120) + cube * (1 / 720))
    return np.asarray(one + matrix + square * 0.5 + last)
