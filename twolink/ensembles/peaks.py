"""The largest values of polynomials on [0, 1]: of q1, q2 and q2 − q1, and of their negatives.

With K ≥ |y″| a polynomial y is at most max(y(0), y(1)) + K/8, and on a part of width w at most its
ends and K w²/8 above them. Parts that may hold a value above the largest one known are halved until
none may by more than a few roundings.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import values_at

Array = NDArray[np.float64]

# The relative accuracy to which a largest value is found: a few roundings.
_FOUND = 4e-15

# Halvings of a step after which the bracket is within the rounding of any value.
_HALVINGS = 40

WEIGHTS = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, -1.0]])
"""The functions of two angles or speeds: both, the second less the first, and their negatives."""


def signed(q: Array, axis: int = 0) -> Array:
    """Return q1, q2, q2 − q1 and their negatives along an axis of q1 and q2."""
    q1, q2 = np.moveaxis(q, axis, 0)
    rows = [q1, q2, q2 - q1]
    return np.stack([*rows, *(-row for row in rows)], axis)


def gain(largest: Array) -> Array:
    """Return by how much a largest value may be above the one that is found."""
    return np.asarray(_FOUND * (1.0 + np.abs(largest)))


def bends(coefficients: Array, lengths: Array) -> Array:
    """Return bounds on second derivatives in shares of steps, of q1, q2 and q2 − q1: (n, 3, lanes).

    `coefficients`, shape (n, 2, p + 1, lanes), are those in the variable of steps.
    """
    last = coefficients.shape[2] - 1
    value = last * (last - 1) * np.abs(coefficients[:, :, last])
    for k in range(last - 1, -1, -1):
        value = value * lengths + k * (k - 1) * np.abs(coefficients[:, :, k])
    return np.concatenate([value, value.sum(axis=1, keepdims=True)], axis=1)


def raise_to_peaks(largest: Array, columns: Any, rows: Array, bends: Array) -> Array:
    """Raise the largest values, one for each column, to those of polynomials on [0, 1].

    `rows` has the coefficients, shape (p + 1, m), and `columns` and `bends` those of each. Returns
    the places of the values that have risen, and NaN for the others.
    """
    found = np.full(len(largest), np.nan)
    places, low, width = np.arange(len(columns)), np.zeros(len(columns)), 1.0
    for _ in range(_HALVINGS):
        if not len(places):
            break
        width /= 2
        # Both halves of each part, and their ends.
        low, places = np.concatenate([low, low + width]), np.concatenate([places, places])
        chosen, own = rows[:, places], columns[places]
        left, right = _at(chosen, low), _at(chosen, low + width)
        values, before = np.maximum(left, right), largest[own]
        np.maximum.at(largest, own, values)
        known = largest[own]
        rises = (values > before) & (values == known)
        found[own[rises]] = (low + np.where(right > left, width, 0.0))[rises]
        goes_on = values + bends[places] * (width * width / 8) > known + gain(known)
        places, low = places[goes_on], low[goes_on]
    return found


def _at(coefficients: Array, x: Array) -> Array:
    """Return the values of polynomials, shape (p + 1, m), each at its own place."""
    return values_at(coefficients[None], x[None])[0]
