"""Balls whose comparisons are proven: an order that a ball leaves open raises an error.

`Certain` wraps a ball of python-flint. Formulas with branches, such as the impact laws, then take a
branch only if all numbers in the balls take it.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from twolink.arithmetic import exactly, whole_power
from twolink.errors import SimulationError


class UndecidedError(SimulationError):
    """Balls are too wide for a decision."""


class Certain:
    """All numbers in a ball; comparisons are proven for all of them, or raise an error."""

    __slots__ = ("ball",)

    def __init__(self, ball: Any) -> None:
        """Store a ball."""
        self.ball = ball

    def __add__(self, other: Any) -> Certain:
        return Certain(self.ball + self._bare(other))

    __radd__ = __add__

    def __sub__(self, other: Any) -> Certain:
        return Certain(self.ball - self._bare(other))

    def __rsub__(self, other: Any) -> Certain:
        return Certain(self._bare(other) - self.ball)

    def __mul__(self, other: Any) -> Certain:
        return Certain(self.ball * self._bare(other))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Certain:
        return Certain(self.ball / self._bare(other))

    def __rtruediv__(self, other: Any) -> Certain:
        return Certain(self._bare(other) / self.ball)

    def __pow__(self, exponent: Any) -> Certain:
        found: Certain = whole_power(self, exponent)
        return found

    def __neg__(self) -> Certain:
        return Certain(-self.ball)

    def __pos__(self) -> Certain:
        return self

    def __abs__(self) -> Certain:
        return Certain(abs(self.ball))

    def __lt__(self, other: Any) -> bool:
        return _proven(self.ball < self._bare(other), self.ball >= self._bare(other))

    def __le__(self, other: Any) -> bool:
        return _proven(self.ball <= self._bare(other), self.ball > self._bare(other))

    def __gt__(self, other: Any) -> bool:
        return not self <= other

    def __ge__(self, other: Any) -> bool:
        return not self < other

    def __eq__(self, other: object) -> bool:
        return _proven(self.ball == self._bare(other), self.ball != self._bare(other))

    __hash__ = None  # type: ignore[assignment]

    def _bare(self, number: Any) -> Any:
        """Return the ball of a number, or a number that python-flint takes exactly."""
        if isinstance(number, Certain):
            return number.ball
        return exactly(number, type(self.ball)) if isinstance(number, Fraction) else number


def sin(x: Certain) -> Certain:
    """Return the sine (rad)."""
    return Certain(x.ball.sin())


def cos(x: Certain) -> Certain:
    """Return the cosine (rad)."""
    return Certain(x.ball.cos())


def exp(x: Certain) -> Certain:
    """Return e to the power of a number."""
    return Certain(x.ball.exp())


def tanh(x: Certain) -> Certain:
    """Return the hyperbolic tangent."""
    return Certain(x.ball.tanh())


def sqrt(x: Certain) -> Certain:
    """Return the square root."""
    return Certain(x.ball.sqrt())


def _proven(holds: bool, fails: bool) -> bool:
    if holds or fails:
        return holds
    raise UndecidedError("the balls are too wide for a comparison")
