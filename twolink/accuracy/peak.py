"""The arithmetic of one core at its best, measured by matrix products."""

from __future__ import annotations

from time import perf_counter

import numpy as np

# The size of the largest matrices whose product OpenBLAS computes in one thread.
_SIZE = 64
_PRODUCTS, _REPEATS = 64, 20


def peak_of_a_core() -> float:
    """Return floating-point operations a second: the best of repeated products of matrices.

    A product of n × n matrices is n² (2n - 1) operations. It takes some hundredths of a second.
    """
    dice = np.random.default_rng(1)
    first, second = dice.random((2, _SIZE, _SIZE))
    product = np.empty_like(first)
    shortest = float("inf")
    for _ in range(_REPEATS):
        start = perf_counter()
        for _ in range(_PRODUCTS):
            np.matmul(first, second, out=product)
        shortest = min(shortest, perf_counter() - start)
    return _PRODUCTS * _SIZE**2 * (2 * _SIZE - 1) / shortest
