"""Bernstein coefficients: bounds on a polynomial on an interval, and on parts of it.

The Bernstein coefficients of a polynomial on [0, 1] bound it from both sides, and the first and the
last of them are its values at the ends. The coefficients on a half follow from those on the whole
(de Casteljau).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.simulation.hybrid.tolerances import POLYNOMIAL
from twolink.simulation.series import powers_of

Array = NDArray[np.float64]

EPSILON = float(np.finfo(float).eps)
"""The rounding of float64, in which bounds are computed."""


@functools.lru_cache(maxsize=64)
def bernstein_matrix(length: int, number: Any = float) -> Any:
    """Return T, shape (n, n): c @ T are the Bernstein coefficients of Σ c_k x^k on [0, 1]."""
    degree = length - 1
    zero = number(0)
    return np.array(
        [
            [number(math.comb(j, k)) / number(math.comb(degree, k)) if j >= k else zero
             for j in range(length)]
            for k in range(length)
        ]
    )  # fmt: skip


@functools.lru_cache(maxsize=64)
def halving_matrix(length: int, number: Any = float) -> Any:
    """Return H, shape (n, n): b @ H are the Bernstein coefficients on the left half of [0, 1]."""
    return np.array(
        [[number(math.comb(j, k) / 2**j) for j in range(length)] for k in range(length)]
    )


def product(matrix: Any, vector: Any) -> Any:
    """Return matrix @ vector, faster than NumPy for numbers longer than float64."""
    if vector.dtype == np.float64:
        # It begins faster than the operator.
        return matrix.dot(vector)
    return np.add.reduce(matrix * vector, -1)


def rounding_bound(coefficients: Sequence[Any], rounding: float) -> float:
    """Return a bound on the error of the values of a polynomial, from its terms."""
    cut = abs(coefficients[-1]) + abs(coefficients[-2])
    return POLYNOMIAL * rounding * float(sum(map(abs, coefficients))) + float(cut)


def margins_of(coefficients: Any, rounding: float) -> tuple[Array, Array, Array]:
    """Return by how much polynomials, shape (m, n), exceed the bounds on their errors on [0, 1].

    Those with a positive margin are proven positive. The Bernstein coefficients, shape (m, n), and
    the bounds are returned as well. All are computed in float64: `first_fall` decides the
    polynomials without a positive margin.
    """
    in_floats = np.asarray(coefficients, dtype=float)
    length = in_floats.shape[-1]
    bernstein = in_floats.dot(bernstein_matrix(length))
    bounds = np.abs(in_floats).dot(_weights(length, max(rounding, EPSILON)))
    return np.minimum.reduce(bernstein, -1) - bounds, bernstein, bounds


def is_positive_until(
    coefficients: Sequence[Any], end: float, bound: float, least: float = 0.0
) -> bool:
    """Return whether Σ c_k x^k is proven to exceed `least` on [0, end], in float64.

    `bound` is that on the error of its values, in the precision of the coefficients.
    """
    cut = np.array(coefficients, dtype=float) * powers_of(np.array([end]), len(coefficients))
    rounding = POLYNOMIAL * EPSILON * float(np.abs(cut).sum())
    lowest_value = float(cut.dot(bernstein_matrix(len(cut))).min())
    return lowest_value > least + bound + rounding


@functools.lru_cache(maxsize=64)
def _weights(length: int, rounding: float) -> Array:
    """Return w, shape (n,): |c| @ w is `rounding_bound` of c."""
    weights = np.full(length, POLYNOMIAL * rounding)
    weights[-2:] += 1
    return weights


def bernstein_of(coefficients: Sequence[Any]) -> list[Any]:
    """Return the Bernstein coefficients of Σ c_k x^k on [0, 1], in numbers of any type."""
    matrix = bernstein_matrix(len(coefficients), kind_of(coefficients))
    found: list[Any] = product(matrix.T, np.array(coefficients)).tolist()
    return found


def until(coefficients: Sequence[Any], end: float) -> list[Any]:
    """Return the Bernstein coefficients of Σ c_k x^k on [0, end]."""
    return bernstein_of([c * end**k for k, c in enumerate(coefficients)])


def last_half_until(coefficients: Sequence[Any], end: float) -> list[Any]:
    """Return the Bernstein coefficients of Σ c_k x^k on [end/2, end]."""
    return right_half(until(coefficients, end))


def left_half(b: Sequence[Any]) -> list[Any]:
    """Return the Bernstein coefficients on the left half of an interval (de Casteljau)."""
    found: list[Any] = product(halving_matrix(len(b), kind_of(b)).T, np.array(b)).tolist()
    return found


def right_half(b: Sequence[Any]) -> list[Any]:
    """Return the Bernstein coefficients on the right half of an interval."""
    return left_half(b[::-1])[::-1]


def kind_of(numbers: Sequence[Any]) -> Any:
    """Return the type of the numbers in a sequence."""
    return float if isinstance(numbers[0], float) else type(numbers[0])
