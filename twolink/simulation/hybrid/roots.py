"""The first root of an event function on a step: proven absent, or isolated and polished.

An event function is a polynomial of the step's Taylor coefficients. Its Bernstein coefficients on
[0, 1] bound it from both sides: if all are positive there is no root, and if they change sign once
there is exactly one. Otherwise the interval is halved (de Casteljau). What is lost to rounding is a
bound on the coefficients, so that a polynomial that touches zero is told apart from one that
crosses it only where the numbers can tell.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.simulation.hybrid.tolerances import MOST_HALVINGS, MOST_PIECES, POLYNOMIAL

Array = NDArray[np.float64]


_EPSILON = float(np.finfo(float).eps)


class Root(NamedTuple):
    """A place x in [0, 1] where a polynomial falls through zero, or touches it within rounding.

    `touches` says that the polynomial is positive again afterwards, or that it may not cross zero.
    """

    x: Any
    touches: bool = False


@functools.lru_cache(maxsize=64)
def bernstein_matrix(length: int) -> Array:
    """Return T, shape (n, n): c @ T are the Bernstein coefficients of Σ c_k x^k on [0, 1]."""
    degree = length - 1
    matrix = np.zeros((length, length))
    for k in range(length):
        for j in range(k, length):
            matrix[k, j] = math.comb(j, k) / math.comb(degree, k)
    return matrix


@functools.lru_cache(maxsize=64)
def halving_matrix(length: int) -> Array:
    """Return H, shape (n, n): b @ H are the Bernstein coefficients on the left half of [0, 1]."""
    matrix = np.zeros((length, length))
    for j in range(length):
        for k in range(j + 1):
            matrix[k, j] = math.comb(j, k) / 2**j
    return matrix


def rounding_bounds(coefficients: Any, rounding: float) -> Array:
    """Return how well each polynomial is known, from its terms: shape (m,) of shape (m, n)."""
    return _bounds(np.abs(coefficients).astype(float, copy=False), rounding)


def _bounds(sizes: Array, rounding: float) -> Array:
    cut = sizes[..., -1] + sizes[..., -2]
    return np.asarray(POLYNOMIAL * rounding * np.add.reduce(sizes, -1) + cut)


def are_positive(coefficients: Any, rounding: float) -> NDArray[np.bool_]:
    """Return which of the polynomials, shape (m, n), are proven positive on [0, 1].

    Longer numbers are rounded to float64 here: what that loses is left to `first_fall`.
    """
    in_floats = np.asarray(coefficients, dtype=float)
    bounds = _bounds(np.abs(in_floats), max(rounding, _EPSILON))
    bernstein = in_floats @ bernstein_matrix(in_floats.shape[-1])
    return np.asarray(np.minimum.reduce(bernstein, -1) > bounds)


def first_fall(coefficients: Sequence[Any], bound: float) -> Root | None:
    """Return the first place in [0, 1] at which Σ c_k x^k falls through zero, or touches it.

    The polynomial is positive at first. `bound` is how well its values are known.
    """
    coefficients = list(coefficients)
    waiting: list[tuple[Any, float, float]] = [(_bernstein(coefficients), 0.0, 1.0)]
    touched: float | None = None
    pieces = 0
    while waiting:
        b, low, high = waiting.pop()
        pieces += 1
        if min(b) > bound:
            if touched is not None:
                return Root(touched, touches=True)
            continue
        if max(b) < -bound:
            # Left of here the sign was lost to rounding: what the numbers say is as good as any.
            return Root(polished(coefficients, low if touched is None else touched, high))
        if touched is None and b[0] > bound and b[-1] < -bound and _changes(b) == 1:
            return Root(polished(coefficients, low, high))
        in_doubt = high - low < 2.0**-MOST_HALVINGS or pieces > MOST_PIECES
        if in_doubt or max(abs(x) for x in b) <= bound:
            touched = low if touched is None else touched
            continue
        left, right = _halves(b)
        middle = (low + high) / 2
        waiting.append((right, middle, high))
        waiting.append((left, low, middle))
    return None if touched is None else Root(touched, touches=True)


def _bernstein(coefficients: Sequence[Any]) -> list[Any]:
    """Return the Bernstein coefficients of Σ c_k x^k on [0, 1], in numbers of any kind."""
    if isinstance(coefficients[0], float):
        matrix = bernstein_matrix(len(coefficients))
        return list((np.array(coefficients) @ matrix).tolist())
    # By differences, since b_j = Σ_k (j over k) c_k/(n over k): each row sums up the one before.
    degree = len(coefficients) - 1
    row = [c / math.comb(degree, k) for k, c in enumerate(coefficients)]
    found = []
    while row:
        found.append(row[0])
        row = [x + y for x, y in pairwise(row)]
    return found


def _halves(b: Sequence[Any]) -> tuple[list[Any], list[Any]]:
    """Return the Bernstein coefficients on both halves of an interval (de Casteljau)."""
    if isinstance(b[0], float):
        matrix = halving_matrix(len(b))
        left = (np.array(b) @ matrix).tolist()
        return left, (np.array(b[::-1]) @ matrix).tolist()[::-1]
    row = list(b)
    left, right = [row[0]], [row[-1]]
    while len(row) > 1:
        row = [(x + y) / 2 for x, y in pairwise(row)]
        left.append(row[0])
        right.append(row[-1])
    return left, right[::-1]


def _changes(b: Sequence[Any]) -> int:
    signs = [x > 0 for x in b if x != 0]
    return sum(x != y for x, y in pairwise(signs))


def _horner(coefficients: Sequence[Any], x: Any) -> Any:
    value = 0 * x
    for c in reversed(coefficients):
        value = value * x + c
    return value


def polished(coefficients: Sequence[Any], low: float, high: float) -> Any:
    """Return the only root in an interval, by Newton's method kept inside a bracket.

    Where the polynomial is not positive at the lower end, that is the root.
    """
    zero = 0 * coefficients[-1]
    low, high = zero + low, zero + high
    if _horner(coefficients, low) <= 0:
        return low
    x = (low + high) / 2
    for _ in range(200):
        value, slope = zero, zero
        for c in reversed(coefficients):
            slope = slope * x + value
            value = value * x + c
        if value == 0:
            return x
        low, high = (x, high) if value > 0 else (low, x)
        following = x - value / slope if slope != 0 else low
        if not low < following < high:
            following = (low + high) / 2
        if following in (x, low, high):
            return following
        x = following
    return x
