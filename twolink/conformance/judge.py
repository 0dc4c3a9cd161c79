"""The judge: an answer against certified values, as a mark, a factor of the bound, and digits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.conformance.bounds import EPSILONS
from twolink.conformance.quantities import QUANTITIES, Quantity
from twolink.conformance.transport import EngineFault, FaultKind
from twolink.conformance.vectors import Group, Vector
from twolink.engines.messages import Precision
from twolink.hardcases import Mark, Result
from twolink.verification.tolerance import EPSILON

Array = NDArray[np.float64]

# Digits of a binary64 number; an answer that equals the truth has no more.
_ALL_DIGITS = 16.0

_WORDS = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


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
    values: list[Any],
    *,
    from_urdf: bool,
    precision: Precision = "binary64",
    warned: bool = False,
) -> Judgement:
    """Return the judgement of an answer. Raises `EngineFault` for one of another shape."""
    quantity = QUANTITIES[vector.quantity]
    states = len(vector.states.angles)
    answer = _array(values, quantity.shape_of_answer(states, from_urdf=from_urdf), quantity)
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
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.where(error == 0, 0, error / allowed)
    factor = float(shares.max()) if finite else math.nan
    result = Result(factor, warned=warned, finite=finite)
    return Judgement(result.mark, factor, _digits(error, truth, allowed), answer, single)


def in_chain_frame(vectors: Array, group: Group, *, place: bool) -> Array:
    """Return the components along x and y of the chain's frame of vectors in the root's frame.

    A `place` is measured from A.
    """
    assert group.frame is not None
    if place:
        vectors = vectors - np.array(group.frame.origin)
    return np.einsum("pw,nw...->np...", np.array([group.frame.x, group.frame.y]), vectors)


def _array(values: list[Any], shape: tuple[int, ...], quantity: Quantity) -> Array:
    """Return nested lists as an array. Raises `EngineFault` unless they have the shape."""
    wanted = " × ".join(map(str, shape))
    found = _shape(values)
    if found is None:
        said = f"values of {quantity.name} must be numbers in rows of one length"
        raise EngineFault(FaultKind.WRONG_LENGTH, f"{said}; got others")
    if found != shape:
        got = " × ".join(map(str, found)) or "a number"
        said = f"values of {quantity.name} must be {wanted} numbers; got {got}"
        raise EngineFault(FaultKind.WRONG_LENGTH, said)
    return np.array(_numbers(values), dtype=float)


def _shape(value: Any) -> tuple[int, ...] | None:
    """Return the shape of nested lists of numbers, or None for anything else."""
    if not isinstance(value, list):
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return () if number or (isinstance(value, str) and value in _WORDS) else None
    inside = {_shape(entry) for entry in value}
    if len(inside) > 1 or None in inside:
        return None
    (rest,) = inside or {()}
    assert rest is not None
    return (len(value), *rest)


def _numbers(value: Any) -> Any:
    if isinstance(value, list):
        return [_numbers(entry) for entry in value]
    return _WORDS.get(value, value) if isinstance(value, str) else value


def _digits(error: Any, truth: Any, allowed: Array) -> float:
    """Return −log10 of the largest relative error of a state, by the states' largest entries.

    A state counts if its values exceed their bound: what rounding leaves of zero has no digits.
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
    return _ALL_DIGITS if worst == 0 else float(np.clip(-math.log10(worst), 0.0, _ALL_DIGITS))
