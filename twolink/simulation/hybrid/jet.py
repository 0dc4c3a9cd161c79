"""Jets: power series in time, as a number type.

If an acceleration or a force is zero at an instant, its higher derivatives decide the mode. The
formulas of the library accept jets as any number, by `twolink.arithmetic`. A formula is evaluated
once: its jets are recorded, and get further coefficients in the order in which they were made, each
from the coefficients of those before it. The same operation on the same jets is recorded once, and
operations with an exact 0 or 1 are left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from operator import mul
from typing import Any

from twolink import arithmetic


class Recording:
    """The jets of a computation that follow from others, in the order in which they were made."""

    def __init__(self) -> None:
        """Create an empty recording."""
        self._jets: dict[tuple[type, int, int], Derived] = {}

    def __len__(self) -> int:
        """Return the number of recorded operations."""
        return len(self._jets)

    def derived(self, kind: type[Derived], of: Jet, other: Any) -> Derived:
        """Return the jet of an operation, which is recorded if it is new."""
        # A jet keeps its operands, so that no other object has their identities.
        key = kind, id(of), id(other)
        found = self._jets.get(key)
        if found is None:
            found = self._jets[key] = kind(of, other)
        return found

    def extend(self) -> None:
        """Compute the next coefficient of each jet; those that are given must have it already."""
        for jet in self._jets.values():
            terms = jet.terms
            terms.append(jet.term(len(terms)))

    @contextmanager
    def branch(self) -> Iterator[None]:
        """Forget the jets that are made within, and all coefficients but the first, afterwards."""
        count = len(self._jets)
        try:
            yield
        finally:
            while len(self._jets) > count:
                self._jets.popitem()
            for jet in self._jets.values():
                jet.forget()


class Jet:
    """A power series in time: its coefficients up to now, of numbers of any real kind.

    Jets without a `recording` have a fixed number of coefficients. All jets of a computation have
    equally many.
    """

    __slots__ = ("recording", "terms")
    # NumPy scalars defer arithmetic with a jet to the jet.
    __array_ufunc__ = None

    def __init__(self, terms: tuple[Any, ...], recording: Recording | None = None) -> None:
        """Store the coefficients."""
        self.terms: list[Any] = list(terms)
        self.recording = recording

    def forget(self) -> None:
        """Keep only the first coefficient."""
        del self.terms[1:]

    def derived(self, kind: type[Derived], other: Any = None) -> Derived:
        """Return the jet of an operation on this one and an `other` jet or number."""
        recording = self.recording
        return kind(self, other) if recording is None else recording.derived(kind, self, other)

    @property
    def circular(self) -> tuple[Jet, Jet]:
        """The sine and the cosine of the jet (rad)."""
        sine = self.derived(_Sine)
        assert isinstance(sine, _Sine)
        return sine, sine.partner

    def __add__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return self.derived(_Sum, other)
        return self if _is(other, 0) else self.derived(_Shifted, other)

    __radd__ = __add__

    def __neg__(self) -> Jet:
        return self.derived(_Negative)

    def __sub__(self, other: Any) -> Jet:
        return self.derived(_Difference, other) if isinstance(other, Jet) else self + (-other)

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, Jet):
            return self.derived(_Product, other)
        if _is(other, 0):
            return 0
        return self if _is(other, 1) else self.derived(_Multiple, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return self.derived(_Quotient, other)
        return self if _is(other, 1) else self.derived(_Part, other)

    def __rtruediv__(self, other: Any) -> Any:
        return 0 if _is(other, 0) else self.derived(_Constant, other) / self

    def __abs__(self) -> Jet:
        return self.derived(_Size)

    def __pow__(self, power: Any) -> Jet:
        if not (isinstance(power, int) and power >= 0):
            return self.derived(_Power, power)
        found: Jet = self.derived(_Constant, 1 + 0 * self.terms[0])
        for _ in range(power):
            found = found * self
        return found


def _is(number: Any, value: int) -> bool:
    return bool(number == value)


class Derived(Jet):
    """A jet that follows from another one, `of`, and from an `other` jet or number."""

    __slots__ = ("of", "other")

    def __init__(self, of: Jet, other: Any = None) -> None:
        """Compute as many coefficients as the other jet has."""
        super().__init__((), of.recording)
        self.of, self.other = of, other
        terms = self.terms
        for k in range(len(of.terms)):
            terms.append(self.term(k))

    def term(self, k: int) -> Any:
        """Return the k-th coefficient; those before it are in `terms`."""
        raise NotImplementedError


class _Constant(Derived):
    """A number, as a jet beside another one."""

    __slots__ = ()

    def term(self, k: int) -> Any:
        return 0 * self.other if k else self.other


class _Sum(Derived):
    __slots__ = ()

    def term(self, k: int) -> Any:
        return self.of.terms[k] + self.other.terms[k]


class _Difference(Derived):
    __slots__ = ()

    def term(self, k: int) -> Any:
        return self.of.terms[k] - self.other.terms[k]


class _Shifted(Derived):
    """The sum of a jet and a number."""

    __slots__ = ()

    def term(self, k: int) -> Any:
        return self.of.terms[k] if k else self.of.terms[0] + self.other


class _Negative(Derived):
    __slots__ = ()

    def term(self, k: int) -> Any:
        return -self.of.terms[k]


class _Product(Derived):
    __slots__ = ()

    def term(self, k: int) -> Any:
        return sum(map(mul, self.of.terms[: k + 1], self.other.terms[k::-1]))


class _Multiple(Derived):
    """The product of a jet and a number."""

    __slots__ = ()

    def term(self, k: int) -> Any:
        return self.of.terms[k] * self.other


class _Quotient(Derived):
    __slots__ = ()

    def term(self, k: int) -> Any:
        divisor = self.other.terms
        known = sum(map(mul, self.terms, divisor[k:0:-1]))
        return (self.of.terms[k] - known) / divisor[0]


class _Part(Derived):
    """The quotient of a jet and a number."""

    __slots__ = ()

    def term(self, k: int) -> Any:
        return self.of.terms[k] / self.other


class _Power(Derived):
    """The power of a jet: x y' = power x' y."""

    __slots__ = ()

    def term(self, k: int) -> Any:
        x, y, power = self.of.terms, self.terms, self.other
        if k == 0:
            return x[0] ** power
        known = sum([(power * (k - j) - j) * x[k - j] * y[j] for j in range(k)])
        return known / (k * x[0])


class _Size(Derived):
    """The absolute value of a jet just after its start: its first term that is not zero decides."""

    __slots__ = ()

    def term(self, k: int) -> Any:
        x = self.of.terms
        return -x[k] if leading_term(x[: k + 1])[1] < 0 else x[k]


class _Paired(Derived):
    """A jet that is computed together with a `partner`, which it extends."""

    __slots__ = ("partner",)

    def __init__(self, of: Jet, other: Any = None) -> None:
        """Compute both."""
        self.partner = Jet((), of.recording)
        super().__init__(of, other)

    def forget(self) -> None:
        """Keep only the first coefficients of both."""
        super().forget()
        self.partner.forget()


class _Sine(_Paired):
    """The sine of a jet (rad), with its cosine."""

    __slots__ = ()

    def term(self, k: int) -> Any:
        x, s, c = self.of.terms, self.terms, self.partner.terms
        if k == 0:
            c.append(arithmetic.cos(x[0]))
            return arithmetic.sin(x[0])
        sine = sum([j * x[j] * c[k - j] for j in range(1, k + 1)]) / k
        c.append(-sum([j * x[j] * s[k - j] for j in range(1, k + 1)]) / k)
        return sine


class _Sign(Derived):
    """The sign of a jet, which is constant from its start on."""

    __slots__ = ()

    def term(self, k: int) -> Any:
        x = self.of.terms
        return 0 * x[0] if k else leading_term(x)[1] + 0 * x[0]


class _Exponential(Derived):
    __slots__ = ()

    def term(self, k: int) -> Any:
        x, y = self.of.terms, self.terms
        if k == 0:
            return arithmetic.exp(x[0])
        return sum([j * x[j] * y[k - j] for j in range(1, k + 1)]) / k


class _HyperbolicTangent(_Paired):
    """The hyperbolic tangent y of a jet x, with y'/x' = 1 − y²."""

    __slots__ = ()

    def term(self, k: int) -> Any:
        x, y, slope = self.of.terms, self.terms, self.partner.terms
        if k == 0:
            found = arithmetic.tanh(x[0])
            slope.append((1 - found) * (1 + found))
            return found
        found = sum([j * x[j] * slope[k - j] for j in range(1, k + 1)]) / k
        slope.append(-2 * y[0] * found - sum([y[j] * y[k - j] for j in range(1, k)]))
        return found


class _Root(Derived):
    __slots__ = ()

    def term(self, k: int) -> Any:
        x, y = self.of.terms, self.terms
        if k == 0:
            return arithmetic.sqrt(x[0])
        known = sum([y[j] * y[k - j] for j in range(1, k)])
        return (x[k] - known) / (2 * y[0])


def constant(value: Any, length: int) -> Jet:
    """Return the jet of a constant, with a fixed number of coefficients."""
    return Jet((value, *(0 * value for _ in range(length - 1))))


def leading_term(terms: Any, noise: float = 0.0, rate: float = 1.0) -> tuple[int, int]:
    """Return the order and the sign of the first coefficient beyond round-off, sign 0 if none is.

    The k-th is known within noise · rate^k.
    """
    for k, term in enumerate(terms):
        if abs(term) > noise * rate**k:
            return k, 1 if term > 0 else -1
    return len(terms), 0


def sin(x: Jet) -> Jet:
    """Return the sine of a jet (rad)."""
    return x.circular[0]


def cos(x: Jet) -> Jet:
    """Return the cosine of a jet (rad)."""
    return x.circular[1]


def exp(x: Jet) -> Jet:
    """Return e to the power of a jet."""
    return x.derived(_Exponential)


def tanh(x: Jet) -> Jet:
    """Return the hyperbolic tangent of a jet."""
    return x.derived(_HyperbolicTangent)


def sqrt(x: Jet) -> Jet:
    """Return the square root of a jet; that of zero is the jet of zero, which is not analytic."""
    return x.derived(_Root) if x.terms[0] != 0 else x.derived(_Constant, x.terms[0])


def sign(x: Jet) -> Jet:
    """Return the sign of a jet, which is constant from its start on."""
    return x.derived(_Sign)
