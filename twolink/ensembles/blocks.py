"""Parts of motions, as polynomials with a bound on their error: shared by all kept quantities.

Runs are followed side by side in lanes. The last index of every array is the lane.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.chain import Chain
from twolink.effects import Effect
from twolink.ensembles.speeds import Speeds
from twolink.integration.precisions import PRECISIONS

Array = NDArray[np.float64]

ROUNDING = PRECISIONS["double"].rounding
"""The rounding of float64."""


class Lanes(NamedTuple):
    """Runs side by side: their numbers are arrays with an entry for each lane, or floats.

    `chain` has its rotors; `q` (rad) and `u` (rad/s) are the starts, of shape (2, lanes).
    """

    chain: Chain
    effects: tuple[Effect, ...]
    q: Array
    u: Array
    duration: float

    @property
    def width(self) -> int:
        """The number of lanes."""
        return int(self.q.shape[1])


class Block(NamedTuple):
    """Consecutive steps: starts and lengths (s), shape (n, lanes), and angles as polynomials.

    `angles` has the coefficients of q1 and q2 (rad) in the time since the start of a step, shape
    (n, 2, p + 1, lanes). Where `clocks`, of shape (n, p + 1, lanes), are given, the variable is
    another one, and they are the coefficients of the time since the start; lengths are then those
    of the variable. `errors`, shape (n, lanes), bound the errors (rad, rad/s) up to the end of each
    step. Steps of a run that has ended have length 0. `which` are the numbers of the lanes among
    those of an accumulator, shape (lanes,); one may come again with later steps. `speeds` returns
    the speeds of the same steps; it is None where not all steps of the runs are followed.
    """

    starts: Array
    lengths: Array
    angles: Array
    errors: Array
    clocks: Array | None = None
    which: Any = slice(None)
    speeds: Callable[[], Speeds] | None = None


class Spans(NamedTuple):
    """Intervals between places of some lanes, with the numbers `which`, shape (n,).

    `angles` are q1 and q2 (rad) at the m + 1 places, shape (2, m + 1, n). `paths`, shape (2, m, n),
    bound how far they turn in total in each interval (rad), and `errors`, shape (m, n), the errors
    of both (rad) at the places up to the end of each.
    """

    which: Any
    angles: Array
    paths: Array
    errors: Array


class Impacts(NamedTuple):
    """The numbers of impacts of runs and of those that measure them, shape (lanes,).

    `endless` is whether bounces die away, which are infinitely many.
    """

    own: Any
    other: Any
    endless: Any


class Ends(NamedTuple):
    """The ends of runs: q (rad) and u (rad/s), shape (2, lanes), and the bound on their errors.

    `impacts` is None in scenes without contacts.
    """

    q: Array
    u: Array
    errors: Array
    impacts: Impacts | None = None


def values_at(coefficients: Array, x: Array) -> Array:
    """Return the values of polynomials, shape (n, …, p + 1, lanes), each at its x (n, lanes).

    By Horner's scheme, entry by entry: no bit of an entry depends on its neighbours.
    """
    places: Any = x.reshape(x.shape[0], *(1,) * (coefficients.ndim - 3), x.shape[1])
    value: Array = coefficients[..., -1, :]
    for k in range(coefficients.shape[-2] - 2, -1, -1):
        value = value * places + coefficients[..., k, :]
    return value
