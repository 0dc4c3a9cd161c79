"""The judge: an answer against certified values, as a mark, a factor of the bound, and digits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.conformance.bounds import EPSILONS
from twolink.conformance.quantities import QUANTITIES
from twolink.conformance.vectors import Group, Vector
from twolink.engines.chain_engine import in_plane
from twolink.engines.marks import Mark, Result, excess
from twolink.engines.messages import Precision
from twolink.verification.tolerance import EPSILON

Array = NDArray[np.float64]

# Digits of a binary64 number; an answer that equals the truth has no more.
_ALL_DIGITS = 16.0


@dataclass(frozen=True)
class Judgement:
    """An answer against the truth.

    `factor` is the largest error in units of its bound, `digits` the number of correct digits of
    the worst state (LRE, the logarithm of the relative error; NaN where the truth is zero).
    `answer` has the components in the chain's frame, in the shape of the values; `single` states
    that all numbers of the engine are numbers of binary32.
    """

    mark: Mark
    factor: float
    digits: float
    answer: Array
    single: bool


def judged(
    vector: Vector,
    group: Group,
    answer: Array,
    *,
    from_urdf: bool,
    precision: Precision = "binary64",
    warned: bool = False,
) -> Judgement:
    """Return the judgement of an answer. Its shape is that of the quantity."""
    quantity = QUANTITIES[vector.quantity]
    with np.errstate(over="ignore"):
        single = bool((answer.astype(np.float32) == answer).all())
    if quantity.vector and from_urdf:
        answer = in_chain_frame(answer, group, place=quantity.name == "position")
    if quantity.up_to_constant:
        answer = answer - answer[0]
    truth = np.array(vector.values, dtype=np.longdouble)
    allowed = np.array(vector.bound, dtype=float) * (EPSILONS[precision] / EPSILON)
    error = np.abs(answer - truth)
    finite = bool(np.isfinite(answer).all())
    factor = float(excess(error, allowed).max()) if finite else math.nan
    result = Result(factor, warned=warned, finite=finite)
    return Judgement(result.mark, factor, _digits(error, truth, allowed), answer, single)


def in_chain_frame(vectors: Array, group: Group, *, place: bool) -> Array:
    """Return the components along x and y of the chain's frame of vectors in the root's frame.

    A `place` is measured from A.
    """
    frame = group.frame
    assert frame is not None
    return in_plane(
        vectors, np.array([frame.x, frame.y]), np.array(frame.origin) if place else None
    )


def _digits(error: Any, truth: Any, allowed: Array) -> float:
    """Return −log10 of the largest relative error of a state, by the states' largest entries.

    A state counts if its values exceed their bound: the round-off of a zero has no digits.
    """
    rows, sizes, bounds = (
        np.abs(values).reshape(len(values), -1).max(axis=1) for values in (error, truth, allowed)
    )
    counted = sizes > bounds
    if not counted.any():
        return math.nan
    worst = float((rows[counted] / sizes[counted]).max())
    if not math.isfinite(worst):
        return 0.0
    # 0 − log10(1) is 0, and −log10(1) is −0.
    return _ALL_DIGITS if worst == 0 else float(np.clip(0.0 - math.log10(worst), 0.0, _ALL_DIGITS))
