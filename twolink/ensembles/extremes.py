"""The largest and the smallest angles of a run, between samples as well.

On a step an angle is a polynomial y on [0, 1]. With K ≥ |y″| it is at most max(y(0), y(1)) + K/8,
and on a part of width w at most its ends and K w²/8 above them. Parts that may hold an angle above
the largest one known are halved until none may by more than one part in 10¹³.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Block, Ends, Lanes, values_at
from twolink.ensembles.quantity import Accumulator, Dimension, Quantity, Variable

Array = NDArray[np.float64]

_ANGLES = Dimension("angle", 3)

# The relative accuracy to which an extreme is found, far below the errors of runs.
_FOUND = 1e-13

# Halvings of a step after which the bracket is within the rounding of any angle.
_HALVINGS = 40


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
        self._largest = _signed(lanes.q)

    def add(self, block: Block) -> None:
        """Take the extremes on the steps of a block."""
        lengths = block.lengths[:, None]
        starts, ends = _signed(block.angles[:, :, 0], 1), _signed(_horner(block.angles, lengths), 1)
        bends = _bends(block.angles, lengths)
        # Steps of runs that have ended are left out.
        higher = np.where(lengths == 0, -np.inf, np.maximum(starts, ends))
        np.maximum(self._largest, higher.max(axis=0), out=self._largest)
        reached = higher + np.concatenate([bends, bends], axis=1) / 8
        steps, functions, lanes = np.nonzero(reached > self._largest + _gain(self._largest))
        if not len(steps):
            return
        weights = _WEIGHTS[functions]
        chosen = block.angles[steps, :, :, lanes]
        rows = (weights[:, :1] * chosen[:, 0] + weights[:, 1:] * chosen[:, 1]).T
        own = block.lengths[steps, lanes]
        rows = rows * own ** np.arange(float(len(rows)))[:, None]
        columns = functions * self._largest.shape[1] + lanes
        _halve(self._largest.reshape(-1), columns, rows, bends[steps, functions % 3, lanes])

    def values(self, ends: Ends) -> dict[str, Any]:
        """Return the smallest and the largest angles (rad)."""
        largest = np.maximum(self._largest, _signed(ends.q)).T
        return {"smallest": -largest[:, 3:], "largest": largest[:, :3]}


_WEIGHTS = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, -1.0]])
"""The functions of q1 and q2: q1, q2, q2 − q1 and their negatives."""


def _signed(q: Array, axis: int = 0) -> Array:
    """Return q1, q2, q2 − q1 and their negatives along an axis of q1 and q2."""
    q1, q2 = np.moveaxis(q, axis, 0)
    rows = [q1, q2, q2 - q1]
    return np.stack([*rows, *(-row for row in rows)], axis)


def _horner(coefficients: Array, x: Array) -> Array:
    """Return the values, shape (n, 2, lanes), of polynomials (n, 2, p + 1, lanes)."""
    value: Array = coefficients[:, :, -1]
    for k in range(coefficients.shape[2] - 2, -1, -1):
        value = value * x + coefficients[:, :, k]
    return value


def _bends(coefficients: Array, lengths: Array) -> Array:
    """Return bounds on the second derivatives on [0, 1] of q1, q2 and q2 − q1: (n, 3, lanes)."""
    last = coefficients.shape[2] - 1
    value = last * (last - 1) * np.abs(coefficients[:, :, last])
    for k in range(last - 1, -1, -1):
        value = value * lengths + k * (k - 1) * np.abs(coefficients[:, :, k])
    return np.concatenate([value, value.sum(axis=1, keepdims=True)], axis=1)


def _halve(largest: Array, columns: Any, rows: Array, bends: Array) -> None:
    """Raise the largest values, one for each column, to those of polynomials on [0, 1].

    `rows` has the coefficients, shape (p + 1, m), and `columns` and `bends` those of each.
    """
    places, low, width = np.arange(len(columns)), np.zeros(len(columns)), 1.0
    for _ in range(_HALVINGS):
        if not len(places):
            return
        width /= 2
        # Both halves of each part, and their ends.
        low, places = np.concatenate([low, low + width]), np.concatenate([places, places])
        chosen = rows[:, places]
        values = np.maximum(_at(chosen, low), _at(chosen, low + width))
        np.maximum.at(largest, columns[places], values)
        known = largest[columns[places]]
        left = values + bends[places] * (width * width / 8) > known + _gain(known)
        places, low = places[left], low[left]


def _gain(largest: Array) -> Array:
    return np.asarray(_FOUND * (1.0 + np.abs(largest)))


def _at(coefficients: Array, x: Array) -> Array:
    """Return the values of polynomials, shape (p + 1, m), each at its own place."""
    return values_at(coefficients[None], x[None])[0]
