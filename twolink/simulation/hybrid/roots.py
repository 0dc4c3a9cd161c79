"""The first root of an event function on a step: proven absent, or isolated and polished.

An event function is a polynomial of the step's Taylor coefficients. If all of its Bernstein
coefficients on [0, 1] are positive there is no root, and if they change sign once there is exactly
one. Otherwise the interval is halved. Round-off is a bound on the coefficients, so that a touch of
zero and a crossing are distinguished only if they differ by more than the bound.
"""

from __future__ import annotations

import functools
import itertools
import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from twolink.simulation.hybrid.bernstein import (
    EPSILON,
    bernstein_of,
    last_half_until,
    left_half,
    right_half,
    until,
)
from twolink.simulation.hybrid.polishing import bracketed, horner, polished
from twolink.simulation.hybrid.tolerances import MOST_HALVINGS, MOST_PIECES, POLYNOMIAL

# Number of slopes of unknown sign with which a polynomial is still known to have one minimum.
_MOST_FLAT = 2


class Search(NamedTuple):
    """The first place x in [0, 1] where a polynomial falls through zero, and a touch before it.

    `fall` is None if the polynomial does not fall. `touch` is the first place before the fall at
    which the polynomial is zero within its bound without a proven fall, or None. `unsure`
    says that the search ended before all pieces were decided.
    """

    fall: Any | None = None
    touch: float | None = None
    unsure: bool = False


# An interval (low, high) in which a polynomial falls, and a place near the fall if it is the only
# one in it, else None. A tuple is made three times faster than a named one.
_Piece = tuple[float, float, float | None]

# The Bernstein coefficients of a piece, computed when it is looked at, and its interval.
_Waiting = tuple[Callable[[], Sequence[Any]], float, float]

# The length of the shortest piece of [0, 1].
_SHORTEST = 2.0**-MOST_HALVINGS

# The interval of the first fall, if there is one, and the rest of a `Search`.
_Isolated = tuple[_Piece | None, float | None, bool]


def first_fall(
    coefficients: Sequence[Any], bound: float, bernstein: Sequence[Any] | None = None
) -> Search:
    """Find the first place in [0, 1] at which Σ c_k x^k falls through zero, and a touch before it.

    The polynomial is positive at first. `bound` is that on the error of its values; `bernstein`
    are its Bernstein coefficients, if they are known in the precision of the coefficients.
    """
    found = None if isinstance(coefficients[0], float) else _proven(coefficients, bound)
    if found is None:
        known = bernstein_of(coefficients) if bernstein is None else bernstein
        found = _isolated(coefficients, known, lambda high: bound)
    piece, touch, unsure = found
    if piece is None:
        return Search(None, touch, unsure)
    low, high, near = piece
    if near is None:
        return Search(polished(coefficients, low, high), touch, unsure)
    return Search(bracketed(coefficients, low, high, near), touch, unsure)


def with_rest(search: Search, coefficients: Sequence[Any], rest: Any) -> Search:
    """Return the search for the fall of rest + x Σ c_k x^k, by that for the fall of the sum.

    The rest and the first coefficient are positive, so that the sum falls first. Where it is
    positive again at 1 and the rest has kept the whole from zero, its fall is a touch.
    """
    if search.fall is None:
        return search
    fall = first_fall([rest, *coefficients], 0.0).fall
    if fall is None and search.touch is None and sum(coefficients) > 0:
        return search._replace(fall=None, touch=float(search.fall))
    return search._replace(fall=fall)


def spread_of_fall(coefficients: Sequence[Any], x: Any, bound: float, steep: float) -> float:
    """Return how far from a fall at x the root may be, where the polynomial is flat there, else 0.

    `bound` is that on the error of its values. A polynomial is flat if it falls by less than that
    within a part `steep` of [0, 1].
    """
    # In float64 the terms of a slope that is nearly zero would cancel.
    slope = horner([k * c for k, c in enumerate(coefficients)][1:], x)
    if not bound > steep * abs(float(slope)):
        return 0.0
    width = steep
    while width < 1 and abs(horner(coefficients, x - width)) <= bound:
        width *= 2
    return width


def _proven(coefficients: Sequence[Any], bound: float) -> _Isolated | None:
    """Return the first fall of a polynomial in longer numbers, if float64 suffices to prove it.

    Numbers longer than float64 take fifty times as long, and matter only close to a touch.
    """
    sizes = [POLYNOMIAL * EPSILON * abs(float(c)) for c in coefficients]

    @functools.cache
    def rounding_until(end: float) -> float:
        """Return the bound on [0, end], and so on its parts, whose coefficients are averages."""
        return bound + horner(sizes, end)

    in_floats = [float(c) for c in coefficients]
    piece, touch, unsure = _isolated(
        in_floats,
        bernstein_of(in_floats),
        lambda high: rounding_until(2.0 ** math.ceil(math.log2(high))),
        strict=True,
    )
    alone = piece is None or piece[2] is not None
    return (piece, touch, unsure) if alone and touch is None and not unsure else None


def _isolated(
    coefficients: Sequence[Any],
    bernstein: Sequence[Any],
    bound_until: Callable[[float], float],
    *,
    strict: bool = False,
) -> _Isolated:
    """Isolate the first fall of a polynomial by halving the interval.

    `bound_until` maps the upper end of an interval to the bound on the error of its coefficients.
    In a `strict` search no coefficient within this bound has a known sign, and the first doubt ends
    it.
    """
    hidden = abs(coefficients[0]) <= bound_until(_SHORTEST)
    if hidden and strict:
        return (None, None, True)
    if hidden:
        waiting = _pieces_from_zero(coefficients, bound_until(1.0))
    else:
        waiting = [(lambda: bernstein, 0.0, 1.0)]
    return _first_in(waiting, coefficients, bound_until, strict)


def _first_in(
    waiting: list[_Waiting],
    coefficients: Sequence[Any],
    bound_until: Callable[[float], float],
    strict: bool,
) -> _Isolated:
    """Isolate the first fall of a polynomial in consecutive pieces, of which the last is first."""
    touch: float | None = None
    doubtful: float | None = None
    pieces = 0
    while waiting:
        on_piece, low, high = waiting.pop()
        b, bound = on_piece(), bound_until(high)
        pieces += 1
        tired = pieces > MOST_PIECES
        # The end coefficients are the values at both ends.
        clear = b[0] > bound and b[-1] > bound
        if clear and min(b) > bound:
            # An undecided interval that ends above zero was a touch.
            touch, doubtful = doubtful if touch is None else touch, None
            continue
        if b[-1] < -bound:
            fall = _fall_in(b, low, high, bound, doubtful, tired, bound if strict else 0.0)
            if fall is not None:
                return (fall, touch, tired)
        in_doubt = _doubt_in(b, coefficients, low, high, bound, doubtful, tired)
        if in_doubt is not None:
            if strict:
                return (None, None, True)
            doubtful = in_doubt if doubtful is None else doubtful
            continue
        passes = clear and doubtful is None
        dip = _only_dip(b, bound, coefficients, low, high) if passes else None
        if dip is not None:
            if dip.value < -dip.bound:
                return ((low, dip.place, (low + dip.place) / 2), touch, tired)
            if dip.value <= dip.bound:
                touch = dip.place if touch is None else touch
            continue
        middle = (low + high) / 2
        waiting.append((functools.partial(right_half, b), middle, high))
        waiting.append((functools.partial(left_half, b), low, middle))
    return (None, doubtful if touch is None else touch, pieces > MOST_PIECES)


def _pieces_from_zero(coefficients: Sequence[Any], bound: float) -> list[_Waiting]:
    """Return the pieces [0, h], [h, 2 h], … [1/2, 1], the first one last.

    For a polynomial that is zero within its bound at 0. Only where all of it is within the bound is
    a piece from 0 decided, in doubt, and h is the largest power of 1/2 at which it may be.
    """
    sizes = [abs(float(c)) for c in coefficients][1:]

    def may_decide(halvings: int) -> bool:
        end = 0.5**halvings
        return horner(sizes, end) * end <= bound

    count = bisect_left(range(MOST_HALVINGS + 1), True, key=may_decide)
    ends = [0.5**halvings for halvings in range(count + 1)]
    waiting: list[_Waiting] = [
        (functools.partial(last_half_until, coefficients, end), end / 2, end) for end in ends[:-1]
    ]
    end = ends[-1]
    waiting.append((functools.partial(until, coefficients, end), 0.0, end))
    return waiting


def _fall_in(
    b: Sequence[Any],
    low: float,
    high: float,
    bound: float,
    doubtful: float | None,
    tired: bool,
    clear_of: float,
) -> _Piece | None:
    """Return the interval of the fall in a piece that ends below zero, None if it must be halved.

    It begins where the sign was lost to round-off, at `doubtful`, if it was. A search that is
    `tired` halves no more. Coefficients within `clear_of` have no known sign.
    """
    if tired or max(b) <= bound:
        # To the left the sign is lost to round-off: the computed sign decides.
        return (low if doubtful is None else doubtful, high, None)
    near = _only_fall(b, clear_of) if doubtful is None and b[0] > bound else None
    return None if near is None else (low, high, low + near * (high - low))


def _doubt_in(
    b: Sequence[Any],
    coefficients: Sequence[Any],
    low: float,
    high: float,
    bound: float,
    doubtful: float | None,
    tired: bool,
) -> float | None:
    """Return where a piece that is not halved is zero within the bound, None if it is halved."""
    if (min(b) >= -bound and max(b) <= bound) or tired or high - low < _SHORTEST:
        return low
    if doubtful is None and -bound <= b[-1] <= bound < b[0]:
        return _end_of_descent(b, coefficients, low, high, bound)
    return None


def _end_of_descent(
    b: Sequence[Any], coefficients: Sequence[Any], low: float, high: float, bound: float
) -> float | None:
    """Return where a polynomial falls to its bound, None unless it falls on all of a piece.

    It ends within the bound: halving would take as many steps as the place has digits. `b` are the
    Bernstein coefficients on [low, high]; differences that round-off hides count as zero.
    """
    slopes = [after - before for before, after in itertools.pairwise(b)]
    flat = sum(abs(slope) <= 2 * bound for slope in slopes)
    if flat > _MOST_FLAT or any(slope > 2 * bound for slope in slopes) or slopes[-1] >= -2 * bound:
        return None
    # On the tangent at the end, whose slope is far above the bound.
    near = high + (high - low) * float((bound - b[-1]) / slopes[-1]) / len(slopes)
    return float(bracketed([coefficients[0] - bound, *coefficients[1:]], low, high, near))


class _Dip(NamedTuple):
    """The place and the value of a minimum, and the bound on the error of the value."""

    place: float
    value: Any
    bound: float


def _only_dip(
    b: Sequence[Any], bound: float, coefficients: Sequence[Any], low: float, high: float
) -> _Dip | None:
    """Return the minimum of a polynomial that falls to it and rises from it, None for any other.

    Its value decides at once: close to a touch, halving would take a hundred steps. `b` are the
    Bernstein coefficients on [low, high], whose differences are those of the derivative. Where
    round-off hides the sign of a difference, it counts as zero.
    """
    if not (b[1] <= b[0] and b[-2] < b[-1]):
        return None
    unsure = 2 * bound
    slopes = [after - before for before, after in itertools.pairwise(b)]
    rises = [slope > 0 for slope in slopes if abs(slope) > unsure]
    flat = len(slopes) - len(rises)
    if flat > _MOST_FLAT or rises[0] or not rises[-1] or rises != sorted(rises):
        return None
    near = low + (high - low) * b.index(min(b)) / len(slopes)
    descent = [-k * c for k, c in enumerate(coefficients) if k]
    place = bracketed(descent, low, high, near)
    return _Dip(float(place), horner(coefficients, place), bound + flat * unsure)


def _only_fall(b: Sequence[Any], clear_of: float) -> float | None:
    """Return a place in [0, 1] near the only fall of a polynomial, None if there may be others.

    `b` are its Bernstein coefficients. The first one is positive, and the last negative, beyond a
    bound below which they have no known sign.
    """
    before = 0
    while b[before + 1] > clear_of:
        before += 1
    if max(b[before + 1 :]) > -clear_of:
        return None
    degree = len(b) - 1
    # As parts of the difference, which numbers beyond the range of float64 have as well.
    size = b[before] - b[before + 1]
    share = float(b[before] / size)
    x = (before + share) / degree
    # The polygon of the coefficients falls there. To the next order in 1/n, the polynomial differs
    # from it by the second difference (Voronovskaya's theorem).
    k = min(max(before, 1), degree - 1)
    bend = float((b[k - 1] - 2 * b[k] + b[k + 1]) / size) if degree > 1 else 0.0
    return x + bend / 2 * (degree * x * (1 - x) - share * (1 - share)) / degree
