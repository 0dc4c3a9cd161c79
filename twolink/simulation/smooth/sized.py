"""Arrays that carry the size of their round-off through a formula.

The round-off of a sum is that of its terms, however small the sum is, and that of a sine contains
the round-off of its argument. The loads of effects are formulas for numbers of any type: evaluated
once on these numbers, they give the size of their own round-off.
"""

from __future__ import annotations

from typing import Any

import numpy as np


class Sized:
    """Values, and the round-off of the formula that gave them, in roundings.

    `error` is the round-off of the operations and constants, and zero for a number that is exact.
    `spread` is that of the arguments of sines and exponentials, which differs from state to state
    like a random number: an argument passes many roundings from one to the next. All three are
    floats or arrays that broadcast.
    """

    __slots__ = ("error", "spread", "value")

    # NumPy's arrays and scalars leave operations to this class.
    __array_ufunc__ = None

    def __init__(self, value: Any, error: Any = 0.0, spread: Any = 0.0) -> None:
        """Store values of numbers, by default exact ones."""
        self.value, self.error, self.spread = value, error, spread

    @property
    def excess(self) -> Any:
        """The part of the error beyond a rounding of the value: by terms that cancel."""
        # An infinite value has no error beyond itself.
        return np.fmax(self.error - np.abs(self.value), 0.0)

    def __add__(self, other: Any) -> Sized:
        value, other = self.value, sized(other)
        total = value + other.value
        # The round-off of terms is independent, and a sum of like terms has one rounding.
        error = np.maximum(np.abs(total), np.hypot(self.error, other.error))
        return Sized(total, error, np.hypot(self.spread, other.spread))

    def __sub__(self, other: Any) -> Sized:
        return self + -sized(other)

    def __rsub__(self, other: Any) -> Sized:
        return -self + other

    def __mul__(self, other: Any) -> Sized:
        a, b = self, sized(other)
        value = a.value * b.value
        error = np.abs(value) + _known(np.abs(a.value) * b.excess + np.abs(b.value) * a.excess)
        return Sized(value, error, _known(np.hypot(a.value * b.spread, b.value * a.spread)))

    def __truediv__(self, other: Any) -> Sized:
        a, b = self, sized(other)
        value, inverse = a.value / b.value, 1 / b.value
        # Relative errors of b: the square of its inverse would overflow.
        excess, spread = np.abs(inverse) * b.excess, inverse * b.spread
        error = np.abs(value) + _known(np.abs(inverse) * a.excess + np.abs(value) * excess)
        return Sized(value, error, _known(np.hypot(inverse * a.spread, value * spread)))

    def __rtruediv__(self, other: Any) -> Sized:
        return sized(other) / self

    def __pow__(self, exponent: Any) -> Sized:
        n = float(exponent)
        return self._mapped(lambda x: x**n, lambda x: n * x ** (n - 1) if n else 0 * x)

    def __neg__(self) -> Sized:
        return Sized(-self.value, self.error, self.spread)

    def __pos__(self) -> Sized:
        return self

    __radd__, __rmul__ = __add__, __mul__

    def _mapped(self, function: Any, slope: Any, of_argument: bool = False) -> Sized:
        """Return a function of the values, by its slope.

        With `of_argument` a rounding of the argument is no rounding of the result.
        """
        value, steep = function(self.value), np.abs(slope(self.value))
        spread = np.hypot(self.spread, self.error) if of_argument else self.spread
        return Sized(value, np.abs(value) + _known(steep * self.excess), _known(steep * spread))


def _known(size: Any) -> Any:
    """Return sizes of round-off, zero for those of no round-off times an infinite slope."""
    return np.where(np.isnan(size), 0.0, size)


def sized(number: Any) -> Sized:
    """Return a number of a formula; one that float64 does not hold is rounded once more."""
    if isinstance(number, Sized):
        return number
    if isinstance(number, np.ndarray):
        return Sized(number)
    value = float(number)
    return Sized(value) if value == number else Sized(value, 2 * abs(value))


def sin(x: Sized) -> Sized:
    """Return the sine; `twolink.arithmetic` finds these functions by the class of a number."""
    return x._mapped(np.sin, np.cos, of_argument=True)


def cos(x: Sized) -> Sized:
    """Return the cosine."""
    return x._mapped(np.cos, np.sin, of_argument=True)


def exp(x: Sized) -> Sized:
    """Return e to the power of x."""
    return x._mapped(np.exp, np.exp, of_argument=True)


def sqrt(x: Sized) -> Sized:
    """Return the square root."""
    least = np.finfo(float).tiny
    return x._mapped(np.sqrt, lambda y: 0.5 / np.sqrt(np.maximum(y, least)))
