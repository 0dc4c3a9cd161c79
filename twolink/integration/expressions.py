"""heyoka's expressions in formulas, for numbers of any precision.

heyoka writes the quotient of an expression and a float as a product with the reciprocal in float64,
also in code for longer numbers: x / 3.0 would have 16 digits in a run of fifty. The symbols given
here convert numbers to the precision of the run before an operation.

Its Taylor series of a power, other than a square, divides by the base, which may be zero. The
symbols write powers with whole exponents as products.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from twolink.arithmetic import exactly, whole_power
from twolink.optional import heyoka

# The largest whole exponent of which heyoka's series holds for a base of zero.
_SQUARE = 2


class Precise:
    """An expression of heyoka that is combined with numbers in the precision of a run."""

    __slots__ = ("expression", "number")

    # NumPy's scalars leave operations to this class.
    __array_ufunc__ = None

    def __init__(self, expression: Any, number: Callable[[Any], Any]) -> None:
        """Store an expression and the function that converts numbers."""
        self.expression, self.number = expression, number

    def _of(self, expression: Any) -> Precise:
        return Precise(expression, self.number)

    def _operand(self, other: Any) -> Any:
        """Return an operand for heyoka: an expression, or a float for float64."""
        if isinstance(other, Precise):
            return other.expression
        if self.number is float:
            return exactly(other, float)
        kind = heyoka().expression
        return other if isinstance(other, kind) else kind(exactly(other, self.number))

    def __add__(self, other: Any) -> Precise:
        return self._of(self.expression + self._operand(other))

    def __radd__(self, other: Any) -> Precise:
        return self._of(self._operand(other) + self.expression)

    def __sub__(self, other: Any) -> Precise:
        return self._of(self.expression - self._operand(other))

    def __rsub__(self, other: Any) -> Precise:
        return self._of(self._operand(other) - self.expression)

    def __mul__(self, other: Any) -> Precise:
        return self._of(self.expression * self._operand(other))

    def __rmul__(self, other: Any) -> Precise:
        return self._of(self._operand(other) * self.expression)

    def __truediv__(self, other: Any) -> Precise:
        return self._of(self.expression / self._operand(other))

    def __rtruediv__(self, other: Any) -> Precise:
        return self._of(self._operand(other) / self.expression)

    def __pow__(self, exponent: Any) -> Precise:
        if isinstance(exponent, int) and exponent > _SQUARE:
            return self._of(whole_power(self.expression, exponent))
        known = isinstance(exponent, (int, float))
        return self._of(self.expression ** (exponent if known else self._operand(exponent)))

    def __neg__(self) -> Precise:
        return self._of(-self.expression)

    def __pos__(self) -> Precise:
        return self


def precise(expression: Any, number: Any) -> Precise:
    """Return an expression for formulas in numbers of a type."""
    return Precise(expression, number)


def plain(value: Any) -> Any:
    """Return the expression of heyoka for the result of a formula, which may be a number."""
    kind = heyoka().expression
    if isinstance(value, Precise):
        return value.expression
    return value if isinstance(value, kind) else kind(value)


def sin(x: Precise) -> Precise:
    """Return the sine; `twolink.arithmetic` finds these functions by the class of a number."""
    return Precise(heyoka().sin(x.expression), x.number)


def cos(x: Precise) -> Precise:
    """Return the cosine."""
    return Precise(heyoka().cos(x.expression), x.number)


def sqrt(x: Precise) -> Precise:
    """Return the square root."""
    return Precise(heyoka().sqrt(x.expression), x.number)


def exp(x: Precise) -> Precise:
    """Return e to the power of x."""
    return Precise(heyoka().exp(x.expression), x.number)


def tanh(x: Precise) -> Precise:
    """Return the hyperbolic tangent of x."""
    return Precise(heyoka().tanh(x.expression), x.number)
