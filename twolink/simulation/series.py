"""Taylor series of steps, shared by the integrators with and without events."""

from __future__ import annotations

from typing import Any

import numpy as np


def powers(lengths: Any, count: int) -> Any:
    """Return the powers 0 … count − 1 of each length: shape (n, count).

    Products take a third of the time of NumPy's powers.
    """
    factors = lengths[:, None].repeat(count, 1)
    factors[:, 0] = 1
    return np.multiply.accumulate(factors, 1, None, factors)


def powers_of(length: Any, count: int) -> Any:
    """Return the powers 0 … count − 1 of the only length in an array: shape (count,).

    They are those of `powers`, in half the time.
    """
    factors = length.repeat(count)
    factors[0] = 1
    return np.multiply.accumulate(factors)
