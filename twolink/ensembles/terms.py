"""Taylor series in the time since the start of a step, whose coefficients are expressions.

The formulas of loads accept a `Series` like any scalar, by `twolink.arithmetic`. A coefficient is
made when it is asked for, from lower coefficients of other series, so that series may depend on
each other: those of a motion follow from those of its loads, and the reverse.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from twolink.arithmetic import whole_power
from twolink.ensembles.comparisons import total
from twolink.optional import heyoka

Terms = Callable[[int], Any]
"""A function of k that returns the k-th coefficient."""


class Series:
    """A series with the coefficients `term(k)`, and those of its derivative: `slope(k)`."""

    __slots__ = ("_known", "_sine_and_cosine", "_slope", "_term")

    # NumPy's scalars leave operations to this class.
    __array_ufunc__ = None

    def __init__(self, term: Terms, slope: Terms | None = None) -> None:
        """Store functions of k, the second where coefficients of the derivative are at hand."""
        self._term, self._slope = term, slope
        self._known: list[Any] = []
        self._sine_and_cosine: tuple[Series, Series] | None = None

    def term(self, k: int) -> Any:
        """Return the coefficient of t to the power of k."""
        while len(self._known) <= k:
            self._known.append(self._term(len(self._known)))
        return self._known[k]

    def terms(self, count: int) -> list[Any]:
        """Return the first coefficients."""
        return [self.term(k) for k in range(count)]

    def slope(self, k: int) -> Any:
        """Return the k-th coefficient of the derivative."""
        return (k + 1.0) * self.term(k + 1) if self._slope is None else self._slope(k)

    def _with(self, other: Any, combine: Callable[[Any, Any], Any]) -> Series:
        """Return a linear combination with a series or with a number."""
        if isinstance(other, Series):
            return Series(
                lambda k: combine(self.term(k), other.term(k)),
                lambda k: combine(self.slope(k), other.slope(k)),
            )
        return Series(
            lambda k: combine(self.term(k), 0.0 if k else other),
            lambda k: combine(self.slope(k), 0.0),
        )

    def __add__(self, other: Any) -> Series:
        return self._with(other, lambda a, b: a + b)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Series:
        return self._with(other, lambda a, b: a - b)

    def __rsub__(self, other: Any) -> Series:
        return self._with(other, lambda a, b: b - a)

    def __neg__(self) -> Series:
        return Series(lambda k: -self.term(k), lambda k: -self.slope(k))

    def __pos__(self) -> Series:
        return self

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, Series):
            return Series(lambda k: convolved(self.term, other.term, k))
        if isinstance(other, float | int) and other == 0:
            return 0.0
        return Series(lambda k: self.term(k) * other, lambda k: self.slope(k) * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, Series) else self * (1.0 / other)

    def __pow__(self, exponent: Any) -> Any:
        return whole_power(self, exponent)

    def sine_and_cosine(self) -> tuple[Series, Series]:
        """Return both, by s' = c x' and c' = −s x'; always the same series."""
        if self._sine_and_cosine is None:
            first = heyoka().sin, heyoka().cos
            sine: Series = Series(
                lambda k: convolved(cosine.term, self.slope, k - 1) / k if k else first[0](at_zero)
            )
            cosine: Series = Series(
                lambda k: -(convolved(sine.term, self.slope, k - 1) / k) if k else first[1](at_zero)
            )
            at_zero = self.term(0)
            self._sine_and_cosine = sine, cosine
        return self._sine_and_cosine


def convolved(first: Terms, second: Terms, k: int, least: int = 0) -> Any:
    """Return the k-th coefficient of a product, by default with all of its terms a_j b_(k − j).

    Those with j < `least` are left out.
    """
    return total([first(j) * second(k - j) for j in range(least, k + 1)])


def value(terms: list[Any], t: Any) -> Any:
    """Return the value of a polynomial, by Horner's scheme."""
    found = terms[-1]
    for term in terms[-2::-1]:
        found = found * t + term
    return found


def sin(x: Series) -> Series:
    """Return the sine; `twolink.arithmetic` finds these functions by the class of a number."""
    return x.sine_and_cosine()[0]


def cos(x: Series) -> Series:
    """Return the cosine."""
    return x.sine_and_cosine()[1]
