"""Power series in balls: a scalar type with rigorous bounds on truncated terms.

A `Series` represents a function that is analytic on a disc |t| ≤ ρ about 0. `terms` are balls that
contain its first coefficients, in the arithmetic of python-flint, which rounds every operation
outwards. `norm` is a ball that contains an upper bound on ‖a‖ = Σ |a_i| ρ^i over all its
coefficients, including truncated ones. By ‖a + b‖ ≤ |a_0 + b_0| + ‖a − a_0‖ + ‖b − b_0‖,
‖a b‖ ≤ ‖a‖ ‖b‖ and, with r = ‖a − a_0‖, ‖sin a‖ ≤ cosh r + sinh r = exp r (expand sin(a_0 + x) by
its addition theorem) each operation computes the norm of its result for any ρ. The truncated
terms at a time |t| ≤ h < ρ are at most Σ_{i≥n} |a_i| h^i ≤ ‖a‖ (h/ρ)^n, by Cauchy's estimate.

The formulas of this project accept a Series like any scalar, by `twolink.arithmetic`. With the two
terms (x, 1) the second term of the result is the derivative.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from twolink.arithmetic import exactly, whole_power


class Series:
    """A power series with balls as coefficients, and an upper bound on its norm."""

    __slots__ = ("_sine_and_cosine", "norm", "terms")

    def __init__(self, terms: Any, norm: Any) -> None:
        """Store python-flint's `arb_series` and `arb`."""
        self.terms, self.norm = terms, norm
        self._sine_and_cosine: tuple[Series, Series] | None = None

    def __add__(self, other: Any) -> Series:
        return self._sum(self.terms + self._parts(other)[0], other)

    __radd__ = __add__

    def __neg__(self) -> Series:
        return Series(-self.terms, self.norm)

    def __sub__(self, other: Any) -> Series:
        return self._sum(self.terms - self._parts(other)[0], other)

    def __rsub__(self, other: Any) -> Series:
        return -self + other

    def __mul__(self, other: Any) -> Series:
        terms, norm = self._parts(other)
        return Series(self.terms * terms, self.norm * norm)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Series:
        """Divide by a number or a series: ‖1/b‖ ≤ 1/(|b_0| − ‖b − b_0‖) if positive.

        All coefficients are NaN where b_0 may be zero.
        """
        if not isinstance(other, Series):
            number, size = self._parts(other)
            return Series(self.terms / number, self.norm / size)
        first = other.terms[0]
        if first.contains(0):
            return _unknown(other)
        left = _least(first) - other._beyond_the_first()
        norm = self.norm / left if left > 0 else type(left).pos_inf()
        return Series(self.terms / other.terms, norm)

    def __rtruediv__(self, other: Any) -> Series:
        number, size = self._parts(other)
        return Series(self.terms * 0 + number, size) / self

    def __pow__(self, exponent: Any) -> Series:
        found: Series = whole_power(self, exponent)
        return found

    def __pos__(self) -> Series:
        return self

    def sine_and_cosine(self) -> tuple[Series, Series]:
        """Return sine and cosine, computed together and cached."""
        if self._sine_and_cosine is None:
            sine, cosine = self.terms.sin_cos()
            norm = self._beyond_the_first().exp()
            self._sine_and_cosine = Series(sine, norm), Series(cosine, norm)
        return self._sine_and_cosine

    def exp(self) -> Series:
        """Return e to the power of the series: ‖exp a‖ ≤ |exp a_0| exp ‖a − a_0‖."""
        return Series(self.terms.exp(), self.terms[0].exp() * self._beyond_the_first().exp())

    def tanh(self) -> Series:
        """Return the hyperbolic tangent, by exponentials of at least 1."""
        if self.terms[0] < 0:
            return -(-self).tanh()
        return 1 - 2 / (1 + (2 * self).exp())

    def sqrt(self) -> Series:
        """Return the square root: with r = ‖a − a_0‖/|a_0|, ‖√a‖ ≤ √|a_0| (2 − √(1 − r))."""
        first = self.terms[0]
        if not first > 0:
            return _unknown(self)
        ratio = self._beyond_the_first() / _least(first)
        norm = first.sqrt() * (2 - (1 - ratio).sqrt())
        return Series(self.terms.sqrt(), norm if ratio < 1 else type(first).pos_inf())

    def _parts(self, other: Any) -> tuple[Any, Any]:
        """Return the terms and the norm of a series, or of a number as a series of one term."""
        if isinstance(other, Series):
            return other.terms, other.norm
        number = exactly(other, type(self.norm)) if isinstance(other, Fraction) else other
        return number, abs(number)

    def _sum(self, terms: Any, other: Any) -> Series:
        """Return the sum with another series or a number, or their difference, of its terms.

        First terms may cancel: two angles after many turns have a small difference.
        """
        beyond = self._beyond_the_first()
        if isinstance(other, Series):
            beyond += other._beyond_the_first()
        return Series(terms, abs(terms[0]) + beyond)

    def _beyond_the_first(self) -> Any:
        """Return an upper bound on ‖a − a_0‖."""
        return self.norm - _least(self.terms[0])


def sin(x: Series) -> Series:
    """Return the sine of a series (rad)."""
    return x.sine_and_cosine()[0]


def cos(x: Series) -> Series:
    """Return the cosine of a series (rad)."""
    return x.sine_and_cosine()[1]


def exp(x: Series) -> Series:
    """Return e to the power of a series."""
    return x.exp()


def tanh(x: Series) -> Series:
    """Return the hyperbolic tangent of a series."""
    return x.tanh()


def sqrt(x: Series) -> Series:
    """Return the square root of a series."""
    return x.sqrt()


def _unknown(like: Series) -> Series:
    """Return the series of a result that does not exist for all numbers in a ball: NaN."""
    kind = type(like.norm)
    return Series(type(like.terms)([kind("nan")] * like.terms.prec), kind.pos_inf())


def _least(ball: Any) -> Any:
    """Return a lower bound on the absolute value of the numbers in a ball."""
    return ball.abs_lower()
