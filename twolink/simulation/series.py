"""Taylor series of steps, shared by the integrators with and without events."""

from __future__ import annotations

from typing import Any

import numpy as np


def powers(lengths: Any, count: int) -> Any:
    """Return the powers 0 … count − 1 of each length: shape (n, count).

    Products take a third of the time of NumPy's powers.
    """
    factors = np.empty((len(lengths), count), dtype=lengths.dtype)
    factors[:, 0] = 1
    factors[:, 1:] = lengths[:, None]
    return np.multiply.accumulate(factors, axis=1, out=factors)
