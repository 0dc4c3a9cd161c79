"""Proof that a contact stays open during a step, or closes once within a short bracket.

Along the polynomials of a step, the gap of a contact and its rate are power series, with a bound on
the terms left out. The errors of the motion change both by no more than their gradients allow. On a
part of the step whose start has no negative gap, no contact closes if the gap is positive, if its
rate is positive, or if the rate is negative and the gap at the end is positive. It closes exactly
once if the rate is negative and so is the gap at the end. A part for which none of this can be
proven is halved. So each impact is transversal, and no impact is missed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from twolink.accuracy.certain import Certain, UndecidedError
from twolink.accuracy.defect_bound import DISC, Passage, Step
from twolink.accuracy.dual import slopes, variables
from twolink.accuracy.frames import Frame
from twolink.accuracy.series import Series
from twolink.contact.elements import RigidContact

# Parts are divided near, but not at the middle, where a root may well be.
_PART = 0.4857

# Newton's iterations for the middle of a bracket; it takes about ten.
_MOST_ITERATIONS = 100


class Crossing(NamedTuple):
    """Times (s) since the start of a step between which a gap falls to zero and below."""

    start: Any
    end: Any


class Bracket(NamedTuple):
    """Exact times (s) since the start of a step, about the instant at which a contact closes.

    `passage` has the errors of the motion until the end, and their frame at the middle.
    """

    start: Any
    middle: Any
    end: Any
    passage: Passage

    @property
    def length(self) -> Any:
        """An upper bound on the length of the bracket (s)."""
        return (self.end - self.start).upper()


@dataclass(frozen=True)
class GapBound:
    """The gap of a contact (m or rad) and its rate along a step: polynomials and error bounds.

    `first_error` is the error of the gap at the start, `gap_error` that during the step. Both are
    beside the `gap_tail` of terms left out.
    """

    contact: RigidContact
    gap: Any
    rate: Any
    gap_tail: Any
    first_error: Any
    gap_error: Any
    rate_error: Any

    @classmethod
    def of(cls, step: Step, contact: RigidContact, before: Frame, errors: list[Any]) -> GapBound:
        """Return the bound for a motion with errors in a frame before the step, bounded during it.

        The unit of errors is rad and rad/s.
        """
        q, u = step.series()
        normal, chain = contact.normal, step.chain
        gap, gap_tail = _polynomial(step, normal.coordinate(chain, q) - contact.bound)
        rate, rate_tail = _polynomial(step, normal.speed(chain, q, u))
        box = step.box(step.flint.arb(0), step.length, errors)
        by_gap, by_rate = gradients(contact, chain, box)
        zero = step.flint.arb(0)
        by_first_gap, _ = gradients(contact, chain, step.box(zero, zero, before.bounds()))
        return cls(
            contact,
            gap,
            rate,
            gap_tail,
            before.bound_along(by_first_gap),
            _change(by_gap, errors),
            rate_tail + _change(by_rate, errors),
        )

    def gap_at(self, time: Any) -> Any:
        """Return a ball that contains the gap at a time (s) after the start of the step."""
        return self.gap(time) + self._error_until(time)

    def gap_during(self, start: Any, end: Any) -> Any:
        """Return a ball that contains the gap between two times (s)."""
        return _range(self.gap, start, end) + self._error_until(end)

    def _error_until(self, time: Any) -> Any:
        """Return a ball about zero with the error of the gap until a time (s)."""
        grown = self.first_error + self.rate_error * time
        return (self.gap_tail + grown.min(self.gap_error)) * _either_sign(time)

    def rate_during(self, start: Any, end: Any) -> Any:
        """Return a ball that contains the rate of the gap between two times (s)."""
        return _range(self.rate, start, end) + self.rate_error * _either_sign(start)

    def first_crossing(self, until: Any, halvings: int) -> Crossing | None:
        """Return times (s) between which the gap first becomes negative, or None if it does not.

        The gap at the start of the step is known not to be negative. Raises `UndecidedError` if
        parts that were halved so often are too long for a proof.
        """
        left = [(0 * until, until, 0)]
        while left:
            start, end, depth = left.pop()
            rate = self.rate_during(start, end)
            if rate > 0 or self.gap_during(start, end) > 0:
                continue
            if rate < 0:
                last = self.gap_at(end)
                if last > 0:
                    continue
                if last < 0:
                    return Crossing(start, end)
            if depth == halvings:
                raise UndecidedError(
                    f"the gap of {self.contact.name} is too small to decide whether it closes"
                )
            middle = (start + _PART * (end - start)).mid()
            left += [(middle, end, depth + 1), (start, middle, depth + 1)]
        return None

    def root(self, crossing: Crossing) -> Any:
        """Return a time (s) at which the gap is nearly zero, by Newton's method."""
        low, high = crossing
        middle = ((low + high) / 2).mid()
        for _ in range(_MOST_ITERATIONS):
            value = self.gap(middle)
            if abs(value.mid()) <= value.rad() + self.gap_tail:
                break
            low, high = (middle, high) if value.mid() > 0 else (low, middle)
            middle = (middle - value / self.rate(middle)).mid()
            if not low < middle < high:
                middle = ((low + high) / 2).mid()
        return middle


def bracket(step: Step, bound: GapBound, crossing: Crossing, before: Frame, tube: Any) -> Bracket:
    """Return a bracket about as short as the errors allow, of a crossing in a step.

    `before` has the errors at the start of the step. Raises `UndecidedError` if the gap cannot be
    proven to fall from a positive to a negative number in it.
    """
    middle = bound.root(crossing)
    here = step.after(before, tube, middle)
    by_gap, _ = gradients(bound.contact, step.chain, step.box(middle, middle, here.errors))
    # The frame knows errors along the gap much better than a box.
    error = here.frame.bound_along(by_gap) + bound.gap_tail
    rate = abs(bound.rate_during(middle, middle)).lower()
    half = (2 * (abs(bound.gap(middle)) + error) / rate).upper()
    start, end = (middle - half).mid(), (middle + half).mid()
    # The error of the gap changes by that of its rate.
    error = (error + bound.rate_error * (end - start)) * _either_sign(half)
    falls = bound.gap(start) + error > 0 and bound.gap(end) + error < 0
    if not (start > 0 and end < step.length and falls and bound.rate_during(start, end) < 0):
        raise UndecidedError(f"the time of an impact on {bound.contact.name} cannot be bracketed")
    return Bracket(start, middle, end, here._replace(errors=step.after(before, tube, end).errors))


def gradients(contact: RigidContact, chain: Any, box: list[Any]) -> tuple[list[Any], list[Any]]:
    """Return balls with the derivatives of a gap and its rate by q1, q2, u1, u2 in a box."""
    state = [Certain(ball) for ball in box]
    q1, q2, u1, u2 = variables(state)
    gap = contact.normal.coordinate(chain, (q1, q2))
    rate = contact.normal.speed(chain, (q1, q2), (u1, u2))
    by_gap, by_rate = ([slope.ball for slope in slopes(n, state)] for n in (gap, rate))
    return by_gap, by_rate


def _polynomial(step: Step, series: Series) -> tuple[Any, Any]:
    """Return the polynomial of a series, and a bound on the terms left out during the step."""
    tail = series.norm / step.flint.arb(DISC) ** series.terms.prec
    return step.flint.arb_poly(series.terms.coeffs()), tail.upper()


def _change(gradient: list[Any], errors: list[Any]) -> Any:
    return sum(abs(x) * error for x, error in zip(gradient, errors, strict=True)).upper()


def _either_sign(like: Any) -> Any:
    """Return the ball from −1 to 1."""
    return type(like)(0, 1)


def _range(polynomial: Any, start: Any, end: Any) -> Any:
    """Return a ball that contains a polynomial between two exact times: the tighter of two."""
    wide, middle = start.union(end), ((start + end) / 2).mid()
    plain = polynomial(wide)
    centred = polynomial(middle) + polynomial.derivative()(wide) * (wide - middle)
    return plain if plain.rad() < centred.rad() else centred
