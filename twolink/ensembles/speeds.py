"""The speeds of steps as polynomials, with bounds on their errors."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Speeds(NamedTuple):
    """Steps and states of runs in lanes, in no order: u1 and u2 (rad/s) as polynomials on [0, 1].

    `coefficients` are of shape (n, 2, p + 1, lanes), and `starts` (s) of (n, lanes). `clocks`,
    shape (n, p + 1, lanes), are the polynomials of the time (s) since the start. `errors` and
    `shifts`, shape (n, lanes), bound the errors of the speeds (rad/s) up to the end of each step,
    and the differences in the time (s) of its jumps; `cuts`, shape (n, 2, lanes), bound the
    truncation of the polynomials (rad/s). Steps of a run that has ended do not count: `counts` is
    of shape (n, lanes).
    """

    starts: Array
    clocks: Array
    coefficients: Array
    cuts: Array
    errors: Array
    shifts: Array
    counts: Any


def derivatives(angles: Any, lengths: Any, ends: Any) -> Any:
    """Return the polynomials of u on [0, 1], shape (n, 2, p + 1, …), from those of q in the time.

    `angles` are the Taylor coefficients of q, of the same shape, and `lengths` (s), shape (n, …),
    those of the steps. Numbers are of any precision. A series of q with p terms gives one of u with
    p − 1 of them. The last is chosen so that the polynomial ends at `ends` (rad/s), (n, 2, …),
    which are as accurate as the state.
    """
    last = angles.shape[2] - 1
    found = 0 * angles
    power, total = 1 + 0 * lengths, 0 * ends
    for k in range(last):
        found[:, :, k] = (k + 1) * angles[:, :, k + 1] * power[:, None]
        total = total + found[:, :, k]
        power = power * lengths
    found[:, :, last] = ends - total
    return found


def truncation_within(coefficients: Array) -> Array:
    """Return bounds on the truncation of polynomials of degree p that end at given values.

    With coefficients u_k the remainder is Σ u_j (x^j − x^p) over j > p. There |x^j − x^p| is below
    (j − p)/(e p), and u_{p+1+i} is at most A/2^i with the last two terms A, as in steps of heyoka
    terms fall to a seventh from one to the next. So the remainder is at most 4 A/(e p).
    """
    last = np.abs(coefficients[:, :, -1]) + np.abs(coefficients[:, :, -2])
    return np.asarray(_OF_THE_LAST_TERMS / (coefficients.shape[2] - 1) * last)


_OF_THE_LAST_TERMS = 4 / math.e
