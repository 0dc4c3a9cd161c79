"""Orders of runs and of their judges, and the differences of two runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from twolink.simulation.run import Array

_LOWEST_ORDER = 7

MORE_ORDERS = 4
"""Orders of a judge above that of the run, in the same precision: an error e⁻⁸ times as large."""

MARGIN_OF_LIKE_PRECISIONS = 3.0
"""Factor on the difference from a judge of the same precision, whose error may be as large."""

MARGIN_OF_ORDERS = 2.0
"""Factor on the difference from a judge of four more orders."""

MARGIN_OF_JUDGES = 1 / 8
"""Factor on the difference that bounds the error of the judge itself, as r < 1/9."""

GROWTH = 5e3
"""The growth of the truncation error of a step over a run, before the first measurement.

It is that of one in four random chains over 10 s, since a judge that is too coarse is the next run
to be judged.
"""


def difference(first: Any, second: Any) -> Array:
    """Return the largest difference so far of any angle or speed (rad, rad/s), shape (n,).

    The runs have `q` and `u` of shape (2, n), in numbers of any precision.
    """
    earlier, later = np.concatenate([first.q, first.u]), np.concatenate([second.q, second.u])
    return np.asarray(np.maximum.accumulate(apart(earlier, later).max(axis=0)))


def apart(earlier: Any, later: Any) -> Array:
    """Return the sizes of the differences of arrays, the second in numbers as long or longer."""
    if later.dtype not in (earlier.dtype, np.longdouble):
        # NumPy does not convert between long double and heyoka's quadruple numbers.
        earlier = np.vectorize(type(later.flat[0]), otypes=[later.dtype])(earlier)
    return np.asarray(np.abs(later - earlier).astype(float))


def truncation(order: int) -> float:
    """Return the relative truncation error of a step, by heyoka's choice of steps."""
    return math.exp(-2 * (order + 1))


def order_for(error: float) -> int:
    """Return the lowest order whose `truncation` is below an error.

    An error may have underflown to 0, or overflown to infinity.
    """
    exponent = -math.log(min(max(error, math.ulp(0.0)), 1.0))
    return max(_LOWEST_ORDER, 2 * math.ceil((exponent / 2 - 2) / 2) + 1)
