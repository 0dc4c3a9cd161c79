"""The largest and the smallest angles of a run, between samples as well.

On a step an angle is a polynomial, whose largest value is found as in `peaks`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Block, Ends, Lanes
from twolink.ensembles.peaks import WEIGHTS, bends, gain, raise_to_peaks, signed
from twolink.ensembles.quantity import Accumulator, Dimension, Quantity, Variable

Array = NDArray[np.float64]

_ANGLES = Dimension("angle", 3)


@dataclass(frozen=True)
class Extremes(Quantity):
    """The extremes of q1, q2 and the elbow q2 − q1."""

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The smallest and the largest angles."""
        return (
            Variable("smallest", "smallest q1, q2 and q2 - q1", "rad", (_ANGLES,)),
            Variable("largest", "largest q1, q2 and q2 - q1", "rad", (_ANGLES,)),
        )

    def accumulator(self, lanes: Lanes) -> Accumulator:
        """Return an accumulator for runs in lanes."""
        return _Extremes(lanes)


class _Extremes(Accumulator):
    """The extremes so far: of all six functions the largest, shape (6, lanes)."""

    def __init__(self, lanes: Lanes) -> None:
        self._largest = signed(lanes.q)

    def add(self, block: Block) -> None:
        """Take the extremes on the steps of a block."""
        lengths = block.lengths[:, None]
        starts, ends = signed(block.angles[:, :, 0], 1), signed(_horner(block.angles, lengths), 1)
        bent = bends(block.angles, lengths)
        # Steps of runs that have ended are left out.
        higher = np.where(lengths == 0, -np.inf, np.maximum(starts, ends))
        np.maximum(self._largest, higher.max(axis=0), out=self._largest)
        reached = higher + np.concatenate([bent, bent], axis=1) / 8
        steps, functions, lanes = np.nonzero(reached > self._largest + gain(self._largest))
        if not len(steps):
            return
        weights = WEIGHTS[functions]
        chosen = block.angles[steps, :, :, lanes]
        rows = (weights[:, :1] * chosen[:, 0] + weights[:, 1:] * chosen[:, 1]).T
        own = block.lengths[steps, lanes]
        rows = rows * own ** np.arange(float(len(rows)))[:, None]
        columns = functions * self._largest.shape[1] + lanes
        raise_to_peaks(self._largest.reshape(-1), columns, rows, bent[steps, functions % 3, lanes])

    def rounding(self) -> Any:
        """Return by how much extremes may exceed those that are found, and as much for rounding."""
        return 2 * gain(self._largest).max(axis=0)

    def values(self, ends: Ends) -> dict[str, Any]:
        """Return the smallest and the largest angles (rad)."""
        largest = np.maximum(self._largest, signed(ends.q)).T
        return {"smallest": -largest[:, 3:], "largest": largest[:, :3]}


def _horner(coefficients: Array, x: Array) -> Array:
    """Return the values, shape (n, 2, lanes), of polynomials (n, 2, p + 1, lanes)."""
    value: Array = coefficients[:, :, -1]
    for k in range(coefficients.shape[2] - 2, -1, -1):
        value = value * x + coefficients[:, :, k]
    return value
