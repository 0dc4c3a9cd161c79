"""Taylor series of steps, shared by the integrators with and without events."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np


def powers(lengths: Any, count: int) -> Any:
    """Return the powers 0 … count − 1 of each length: shape (n, count)."""
    if lengths.dtype == np.float64:
        return lengths[:, None] ** _exponents(count)
    factors = np.empty((len(lengths), count), dtype=lengths.dtype)
    factors[:, 0] = 1
    factors[:, 1:] = lengths[:, None]
    return np.multiply.accumulate(factors, axis=1)


@functools.cache
def _exponents(count: int) -> Any:
    return np.arange(float(count))
