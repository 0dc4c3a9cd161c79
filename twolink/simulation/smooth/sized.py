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

    `error` is the round-off of the operations and constants, and zero for a number that is `exact`;
    `excess` is the part of it beyond a rounding of the value, by terms that cancel. `spread` is
    that of the arguments of sines and exponentials, which differs from state to state like a random
    number: an argument passes many roundings from one to the next. All are floats or arrays that
    broadcast. Most formulas have no excess and no spread, which are then None, and cost nothing.
    """

    __slots__ = ("_excess", "_spread", "exact", "value")

    # NumPy's arrays and scalars leave operations to this class.
    __array_ufunc__ = None

    def __init__(
        self, value: Any, excess: Any = None, spread: Any = None, *, exact: bool = True
    ) -> None:
        """Store values of numbers, by default exact ones."""
        self.value, self.exact = value, exact
        self._excess, self._spread = excess, spread

    @property
    def error(self) -> Any:
        """The round-off of the operations and constants."""
        if self.exact:
            return 0.0
        size = abs(self.value)
        return size if self._excess is None else size + self._excess

    @property
    def excess(self) -> Any:
        """The part of the error beyond a rounding of the value."""
        return 0.0 if self._excess is None else self._excess

    @property
    def spread(self) -> Any:
        """The round-off of arguments."""
        return 0.0 if self._spread is None else self._spread

    def __add__(self, other: Any) -> Sized:
        a, b = self, sized(other)
        if _is_zero(b):
            return a
        if _is_zero(a):
            return b
        total = a.value + b.value
        excess = None
        if not (a.exact and b.exact):
            # The round-off of terms is independent, and a sum of like terms has one rounding. An
            # infinite sum has no error beyond itself.
            excess = np.fmax(np.hypot(a.error, b.error) - np.abs(total), 0.0)
            # Constants without an excess cost nothing later.
            excess = None if np.ndim(excess) == 0 and excess == 0 else excess
        return Sized(total, excess, _both(a._spread, b._spread), exact=False)

    def __sub__(self, other: Any) -> Sized:
        return self + -sized(other)

    def __rsub__(self, other: Any) -> Sized:
        return -self + other

    def __mul__(self, other: Any) -> Sized:
        a, b = self, sized(other)
        if _is_zero(a) or _is_zero(b):
            return Sized(0.0)
        excess = _sum(_times(a.value, b._excess), _times(b.value, a._excess))
        spread = _both(_times(a.value, b._spread), _times(b.value, a._spread))
        return Sized(a.value * b.value, excess, spread, exact=False)

    def __truediv__(self, other: Any) -> Sized:
        a, b = self, sized(other)
        value, inverse = a.value / b.value, 1 / b.value
        # Relative errors of b: the square of its inverse would overflow.
        relative, shaken = _times(inverse, b._excess), _times(inverse, b._spread)
        excess = _sum(_times(inverse, a._excess), _times(value, relative))
        spread = _both(_times(inverse, a._spread), _times(value, shaken))
        return Sized(value, excess, spread, exact=False)

    def __rtruediv__(self, other: Any) -> Sized:
        return sized(other) / self

    def __pow__(self, exponent: Any) -> Sized:
        n = float(exponent)
        return self._mapped(lambda x: x**n, lambda x: n * x ** (n - 1) if n else 0 * x)

    def __neg__(self) -> Sized:
        return Sized(-self.value, self._excess, self._spread, exact=self.exact)

    def __pos__(self) -> Sized:
        return self

    __radd__, __rmul__ = __add__, __mul__

    # Formulas that decide by a number are not evaluated on these.
    __bool__ = None

    def _mapped(self, function: Any, slope: Any, of_argument: bool = False) -> Sized:
        """Return a function of the values, by its slope.

        With `of_argument` a rounding of the argument is no rounding of the result.
        """
        excess, spread = self._excess, self._spread
        if of_argument and not self.exact:
            spread = _both(spread, self.error)
        if excess is not None or spread is not None:
            steep = slope(self.value)
            excess, spread = _times(steep, excess), _times(steep, spread)
        return Sized(function(self.value), excess, spread, exact=False)


def _is_zero(number: Sized) -> bool:
    """Return whether a number is the constant 0, which leaves a sum as it is."""
    return number.exact and isinstance(number.value, float) and number.value == 0


def _times(factor: Any, size: Any) -> Any:
    """Return the size of a factor times that of some round-off, which may be None."""
    return None if size is None else _known(abs(factor) * size)


def _sum(one: Any, other: Any) -> Any:
    """Return the sum of two sizes, each of which may be None."""
    return one if other is None else other if one is None else one + other


def _both(one: Any, other: Any) -> Any:
    """Return the size of two independent ones, each of which may be None."""
    return one if other is None else other if one is None else np.hypot(one, other)


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
    return Sized(value) if value == number else Sized(value, abs(value), exact=False)


def sin(x: Sized) -> Sized:
    """Return the sine; `twolink.arithmetic` finds these functions by the class of a number."""
    return x._mapped(np.sin, np.cos, of_argument=True)


def cos(x: Sized) -> Sized:
    """Return the cosine."""
    return x._mapped(np.cos, np.sin, of_argument=True)


def exp(x: Sized) -> Sized:
    """Return e to the power of x."""
    return x._mapped(np.exp, np.exp, of_argument=True)


def tanh(x: Sized) -> Sized:
    """Return the hyperbolic tangent."""
    return x._mapped(np.tanh, lambda y: 1 - np.tanh(y) ** 2, of_argument=True)


def sqrt(x: Sized) -> Sized:
    """Return the square root."""
    least = np.finfo(float).tiny
    return x._mapped(np.sqrt, lambda y: 0.5 / np.sqrt(np.maximum(y, least)))
