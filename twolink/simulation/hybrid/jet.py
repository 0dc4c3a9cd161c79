"""Jets: truncated power series in time, as a number type.

If an acceleration or a force is zero at an instant, its higher derivatives decide the mode. The
formulas of the library accept jets as any number, by `twolink.arithmetic`.
"""

from __future__ import annotations

import operator
from typing import Any

from twolink import arithmetic


class Jet:
    """The first coefficients of a power series in time, of numbers of any real kind."""

    __slots__ = ("_circular", "terms")
    # NumPy scalars defer arithmetic with a jet to the jet.
    __array_ufunc__ = None

    def __init__(self, terms: tuple[Any, ...]) -> None:
        """Store the coefficients; all jets of a computation have equally many."""
        self.terms = terms
        self._circular: tuple[Jet, Jet] | None = None

    @property
    def circular(self) -> tuple[Jet, Jet]:
        """The sine and the cosine of the jet (rad), cached because angles recur."""
        if self._circular is None:
            self._circular = _sine_and_cosine(self)
        return self._circular

    def __add__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return Jet(tuple(map(operator.add, self.terms, other.terms)))
        return Jet((self.terms[0] + other, *self.terms[1:]))

    __radd__ = __add__

    def __neg__(self) -> Jet:
        return Jet(tuple(map(operator.neg, self.terms)))

    def __sub__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return Jet(tuple(map(operator.sub, self.terms, other.terms)))
        return self + (-other)

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(tuple([a * other for a in self.terms]))
        a, b = self.terms, other.terms
        return Jet(tuple([sum(map(operator.mul, a[: k + 1], b[k::-1])) for k in range(len(a))]))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(tuple(a / other for a in self.terms))
        found: list[Any] = []
        for k, a in enumerate(self.terms):
            known = _sum(found[j] * other.terms[k - j] for j in range(k))
            found.append((a - known) / other.terms[0])
        return Jet(tuple(found))

    def __rtruediv__(self, other: Any) -> Jet:
        return constant(other, len(self.terms)) / self

    def __abs__(self) -> Jet:
        return -self if leading_term(self.terms)[1] < 0 else self

    def __pow__(self, power: Any) -> Jet:
        if isinstance(power, int) and power >= 0:
            found = constant(1 + 0 * self.terms[0], len(self.terms))
            for _ in range(power):
                found = found * self
            return found
        # x y' = power x' y.
        x = self.terms
        y = [x[0] ** power]
        for k in range(1, len(x)):
            known = _sum((power * (k - j) - j) * x[k - j] * y[j] for j in range(k))
            y.append(known / (k * x[0]))
        return Jet(tuple(y))


def _sum(terms: Any) -> Any:
    return sum(terms, 0)


def constant(value: Any, length: int) -> Jet:
    """Return the jet of a constant."""
    return Jet((value, *(0 * value for _ in range(length - 1))))


def leading_term(terms: tuple[Any, ...], noise: float = 0.0, rate: float = 1.0) -> tuple[int, int]:
    """Return the order and the sign of the first coefficient beyond round-off, sign 0 if none is.

    The k-th is known within noise · rate^k.
    """
    for k, term in enumerate(terms):
        if abs(term) > noise * rate**k:
            return k, 1 if term > 0 else -1
    return len(terms), 0


def _sine_and_cosine(x: Jet) -> tuple[Jet, Jet]:
    s, c = [arithmetic.sin(x.terms[0])], [arithmetic.cos(x.terms[0])]
    for k in range(1, len(x.terms)):
        s.append(_sum(j * x.terms[j] * c[k - j] for j in range(1, k + 1)) / k)
        c.append(-_sum(j * x.terms[j] * s[k - j] for j in range(1, k + 1)) / k)
    return Jet(tuple(s)), Jet(tuple(c))


def sin(x: Jet) -> Jet:
    """Return the sine of a jet (rad)."""
    return x.circular[0]


def cos(x: Jet) -> Jet:
    """Return the cosine of a jet (rad)."""
    return x.circular[1]


def exp(x: Jet) -> Jet:
    """Return e to the power of a jet."""
    y = [arithmetic.exp(x.terms[0])]
    for k in range(1, len(x.terms)):
        y.append(_sum(j * x.terms[j] * y[k - j] for j in range(1, k + 1)) / k)
    return Jet(tuple(y))


def sqrt(x: Jet) -> Jet:
    """Return the square root of a jet; that of zero is the jet of zero, which is not analytic."""
    if x.terms[0] == 0:
        return constant(x.terms[0], len(x.terms))
    y = [arithmetic.sqrt(x.terms[0])]
    for k in range(1, len(x.terms)):
        known = _sum(y[j] * y[k - j] for j in range(1, k))
        y.append((x.terms[k] - known) / (2 * y[0]))
    return Jet(tuple(y))


def sign(x: Jet) -> Jet:
    """Return the sign of a jet, which is constant from its start on."""
    return constant(leading_term(x.terms)[1] + 0 * x.terms[0], len(x.terms))
