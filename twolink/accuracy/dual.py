"""Dual numbers a + b ε with ε² = 0: b is the derivative, by the rules of differentiation.

Their parts are scalars of any type, such as the power series of `twolink.accuracy.series`, so that
the formulas of this project give the derivative of a formula along a motion. Their order is that of
their values.

The slope may be a number, or the `Slopes` by several variables, with which the values of a formula
are computed once for all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from twolink import arithmetic


class Dual:
    """A number `value` + `slope` ε."""

    __slots__ = ("slope", "value")

    def __init__(self, value: Any, slope: Any) -> None:
        """Store both parts."""
        self.value, self.slope = value, slope

    def __add__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.slope + other.slope)
        return Dual(self.value + other, self.slope)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Any) -> Dual:
        return self + (-other)

    def __rsub__(self, other: Any) -> Dual:
        return -self + other

    def __mul__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return Dual(
                self.value * other.value, self.slope * other.value + other.slope * self.value
            )
        return Dual(self.value * other, self.slope * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            quotient = self.value / other.value
            return Dual(quotient, (self.slope - other.slope * quotient) / other.value)
        return Dual(self.value / other, self.slope / other)

    def __pow__(self, exponent: Any) -> Dual:
        found: Dual = arithmetic.whole_power(self, exponent)
        return found

    def __pos__(self) -> Dual:
        return self

    def __abs__(self) -> Dual:
        return self if self.value >= 0 else -self

    def __lt__(self, other: Any) -> bool:
        return bool(self.value < _value(other))

    def __le__(self, other: Any) -> bool:
        return bool(self.value <= _value(other))

    def __gt__(self, other: Any) -> bool:
        return bool(self.value > _value(other))

    def __ge__(self, other: Any) -> bool:
        return bool(self.value >= _value(other))

    def __eq__(self, other: object) -> bool:
        return bool(self.value == _value(other))

    __hash__ = None  # type: ignore[assignment]

    def __rtruediv__(self, other: Any) -> Dual:
        quotient = other / self.value
        return Dual(quotient, -(self.slope * quotient) / self.value)


class Slopes:
    """The derivatives by several variables, of which those that are zero are left out."""

    __slots__ = ("by",)

    def __init__(self, by: dict[int, Any]) -> None:
        """Store the derivatives by the numbers of the variables."""
        self.by = by

    def __add__(self, other: Slopes) -> Slopes:
        found = dict(self.by)
        for k, slope in other.by.items():
            found[k] = found[k] + slope if k in found else slope
        return Slopes(found)

    def __neg__(self) -> Slopes:
        return Slopes({k: -slope for k, slope in self.by.items()})

    def __sub__(self, other: Slopes) -> Slopes:
        return self + (-other)

    def __mul__(self, factor: Any) -> Slopes:
        return Slopes({k: slope * factor for k, slope in self.by.items()})

    def __truediv__(self, divisor: Any) -> Slopes:
        return Slopes({k: slope / divisor for k, slope in self.by.items()})


def variables(values: Sequence[Any]) -> list[Dual]:
    """Return the variables by which a formula has slopes, at their values."""
    return [Dual(x, Slopes({k: x * 0 + 1})) for k, x in enumerate(values)]


def slopes(number: Any, values: Sequence[Any]) -> list[Any]:
    """Return the derivatives of the result of a formula by its `variables`."""
    by = number.slope.by if isinstance(number, Dual) else {}
    return [by[k] if k in by else x * 0 for k, x in enumerate(values)]


def _value(x: Any) -> Any:
    return x.value if isinstance(x, Dual) else x


def sin(x: Dual) -> Dual:
    """Return the sine of a dual number (rad)."""
    return Dual(arithmetic.sin(x.value), x.slope * arithmetic.cos(x.value))


def cos(x: Dual) -> Dual:
    """Return the cosine of a dual number (rad)."""
    return Dual(arithmetic.cos(x.value), -(x.slope * arithmetic.sin(x.value)))


def exp(x: Dual) -> Dual:
    """Return e to the power of a dual number."""
    value = arithmetic.exp(x.value)
    return Dual(value, x.slope * value)


def tanh(x: Dual) -> Dual:
    """Return the hyperbolic tangent of a dual number."""
    value = arithmetic.tanh(x.value)
    return Dual(value, x.slope * (1 - value * value))


def sqrt(x: Dual) -> Dual:
    """Return the square root of a dual number."""
    value = arithmetic.sqrt(x.value)
    return Dual(value, x.slope / (2 * value))
