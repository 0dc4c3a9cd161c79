"""The parameters of a planar two-link chain.

                A ──── link 1 ──── B ──── link 2 ──── D

A is fixed, B is the elbow, D the free end. Each link has a frame of its own in the plane of
motion: it starts at the link's first joint, `along` points to B (link 1) or D (link 2), and
`across` is a quarter turn further, in the positive sense of the angles.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from twolink.arithmetic import Pair, Scalar
from twolink.errors import ParameterError
from twolink.urdf import LinkParameters, read_planar_urdf, write_planar_urdf

# Between these the products of float64 neither overflow nor lose digits.
_SMALLEST, _LARGEST = 1e-290, 1e290


class Point(NamedTuple):
    """A point fixed to a link: link 1 or 2, and its coordinates `along` and `across` it (m)."""

    link: int
    along: Scalar
    across: Scalar


class Rotor(NamedTuple):
    """A body on a link that turns at speeds of its own: ω = w1 u1 + w2 u2, with `turning` w.

    `inertia` is about its own axis (kg m²); its mass and place are the link's.
    """

    inertia: Scalar
    turning: Pair


@dataclass(frozen=True)
class Chain:
    """A planar two-link chain, each field a pair with an entry for link 1 and link 2.

    `mass` in kg; `length` in m, from A to B and from B to D; `centre`, the mass centre's `along`
    and `across` in m; `inertia` about the mass centre in kg m². `rotors` turn with the motors, if
    there are any. Numbers of any kind will do (floats, mpmath, SymPy symbols); real ones are
    checked, and `ParameterError` names the link, the value received and the values allowed.
    """

    mass: Pair
    length: Pair
    centre: tuple[Pair, Pair]
    inertia: Pair
    rotors: tuple[Rotor, ...] = ()
    # A uniform bar's mL²/12 has no float64 value. Here it is kept whole, for `convert`.
    _exact_inertia: Pair | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Check every parameter that is a real number."""
        for name in ("mass", "length", "centre", "inertia"):
            _check_pair(name, getattr(self, name))
        for link in (1, 2):
            _positive(link, "mass", self.mass[link - 1], "kg")
            _not_negative(link, "inertia", self.inertia[link - 1], "kg m²")
        # L1 places the elbow and says where link 1 points; L2 only places D.
        _positive(1, "length", self.length[0], "m")
        _not_negative(2, "length", self.length[1], "m")
        self._check_that_it_resists()

    def _check_that_it_resists(self) -> None:
        """Refuse a chain whose mass matrix is singular in some pose."""
        (m1, m2), (I_C1, I_C2) = self.mass, self.inertia
        (a1, b1), (a2, b2) = self.centre
        _positive(2, "inertia about B", I_C2 + m2 * (a2 * a2 + b2 * b2), "kg m²")
        # det M, at its smallest, is I_A I_B + m2 L1² I_C2.
        if _is_real(I_C2) and I_C2 == 0:
            _positive(1, "inertia about A", I_C1 + m1 * (a1 * a1 + b1 * b1), "kg m²")
        self._check_that_floats_hold_it()

    def _check_that_floats_hold_it(self) -> None:
        """Refuse a chain of floats whose determinant of M leaves their range in some pose."""
        numbers = (*self.mass, *self.length, *self.centre[0], *self.centre[1], *self.inertia)
        if not all(isinstance(number, (float, int)) for number in numbers):
            return
        (m1, m2), (I_C1, I_C2) = self.mass, self.inertia
        reach1, reach2 = (math.hypot(*centre) for centre in self.centre)
        carried = m2 * self.L1 * self.L1
        I_A, I_B = I_C1 + m1 * reach1 * reach1, I_C2 + m2 * reach2 * reach2
        least, most = I_A * I_B + carried * I_C2, (I_A + carried) * I_B
        # Rounding may leave the least above the most, where they are nearly one.
        if not (least >= _SMALLEST and most <= _LARGEST):
            raise ParameterError(
                f"the mass matrix's determinant is {least:.3g} to {most:.3g} kg² m⁴; allowed is "
                f"{_SMALLEST:.0e} to {_LARGEST:.0e}, which float64 holds with all its digits"
            )

    @classmethod
    def uniform_bars(cls, mass: Pair = (1.0, 1.0), length: Pair = (1.0, 1.0)) -> Chain:
        """Return the source's chain: thin uniform bars of the given masses (kg) and lengths (m).

        The mass centres are at mid-length and I_C = mL²/12 (source, section 6.1).
        """
        _check_rods(mass, length)
        first, second = (_exact(m) * _exact(L) ** 2 / 12 for m, L in zip(mass, length, strict=True))
        return cls(
            mass=mass,
            length=length,
            centre=((length[0] / 2, length[0] * 0), (length[1] / 2, length[1] * 0)),
            inertia=(_rounded(first), _rounded(second)),
            _exact_inertia=(first, second),
        )

    @classmethod
    def point_masses(cls, mass: Pair = (1.0, 1.0), length: Pair = (1.0, 1.0)) -> Chain:
        """Return the textbook double pendulum: point masses (kg) at the ends of rods (m)."""
        _check_rods(mass, length)
        zero = length[0] * 0
        return cls(
            mass, length, centre=((length[0], zero), (length[1], zero)), inertia=(zero, zero)
        )

    @classmethod
    def from_urdf(cls, path: str | PathLike[str], **reading: Any) -> Chain:
        """Return the chain that a URDF file describes.

        `reading` is passed to `twolink.urdf.read_planar_urdf`, which also tells where the chain
        stands and how its joint angles are counted. Raises `UrdfError` for anything that is not
        a planar two-link chain.
        """
        return cls.from_links(read_planar_urdf(path, **reading).links)

    @classmethod
    def from_links(cls, links: tuple[LinkParameters, LinkParameters]) -> Chain:
        """Return the chain of two links as `twolink.urdf` reads and writes them."""
        return cls(
            mass=(links[0].mass, links[1].mass),
            length=(links[0].length, links[1].length),
            centre=(links[0].centre, links[1].centre),
            inertia=(links[0].inertia, links[1].inertia),
        )

    def to_urdf(self, path: str | PathLike[str] | None = None, *, name: str = "twolink") -> str:
        """Return the chain as URDF text, and write it to `path` if one is given.

        Reading it back gives the same parameters (kg, m, kg m²) to the last bit.
        """
        if self.rotors:
            raise ParameterError(
                f"a URDF of a chain with {len(self.rotors)} rotors was asked for; allowed are "
                "none, since a URDF has no place for them"
            )
        try:
            plain = self.convert(float)
        except (TypeError, ValueError) as error:
            raise ParameterError(
                f"a URDF of {self!r} was asked for; allowed are parameters that are numbers"
            ) from error
        fields = zip(plain.mass, plain.length, plain.centre, plain.inertia, strict=True)
        first, second = (LinkParameters(*parameters) for parameters in fields)
        text = write_planar_urdf((first, second), name=name)
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text

    def convert(self, number: Callable[[Any], Scalar]) -> Chain:
        """Return the same chain in another kind of number, such as `mpmath.mpf` or `longdouble`.

        Each float64 parameter keeps its exact value; a uniform bar's mL²/12 is formed anew, as
        the exact rational of its mass and length.
        """

        def converted(value: Any) -> Scalar:
            if isinstance(value, Fraction) and number is not float:
                return number(value.numerator) / number(value.denominator)
            return number(value)

        def pair(values: Pair) -> Pair:
            return converted(values[0]), converted(values[1])

        return Chain(
            mass=pair(self.mass),
            length=pair(self.length),
            centre=(pair(self.centre[0]), pair(self.centre[1])),
            inertia=pair(self._exact_inertia or self.inertia),
            rotors=tuple(Rotor(converted(j), pair(turning)) for j, turning in self.rotors),
        )

    # The source's names.

    @property
    def m1(self) -> Scalar:
        """Mass of link 1, kg."""
        return self.mass[0]

    @property
    def m2(self) -> Scalar:
        """Mass of link 2, kg."""
        return self.mass[1]

    @property
    def L1(self) -> Scalar:
        """Length of link 1, from A to B, m."""
        return self.length[0]

    @property
    def L2(self) -> Scalar:
        """Length of link 2, from B to D, m."""
        return self.length[1]

    @property
    def I_C1(self) -> Scalar:
        """Inertia of link 1 about its mass centre, kg m²."""
        return self.inertia[0]

    @property
    def I_C2(self) -> Scalar:
        """Inertia of link 2 about its mass centre, kg m²."""
        return self.inertia[1]

    @cached_property
    def C1(self) -> Point:
        """Mass centre of link 1."""
        return Point(1, *self.centre[0])

    @cached_property
    def C2(self) -> Point:
        """Mass centre of link 2."""
        return Point(2, *self.centre[1])

    @cached_property
    def B(self) -> Point:
        """The elbow, as a point of link 1."""
        return Point(1, self.L1, self.L1 * 0)

    @cached_property
    def D(self) -> Point:
        """The free end of link 2."""
        return Point(2, self.L2, self.L2 * 0)


def _is_real(value: Any) -> bool:
    return isinstance(value, Real)


def _exact(value: Any) -> Any:
    """Return a float as the exact rational that it is; leave other kinds of number alone."""
    return Fraction(value) if isinstance(value, (int, float)) else value


def _rounded(value: Any) -> Any:
    """Return the float nearest to an exact rational; leave other kinds of number alone."""
    return float(value) if isinstance(value, Fraction) else value


def _positive(link: int, name: str, value: Any, unit: str) -> None:
    """Raise `ParameterError` unless a value is positive and finite, or no real number."""
    if _is_real(value) and not (value > 0 and math.isfinite(value)):
        _refuse(link, name, value, f"a positive number of {unit}")


def _not_negative(link: int, name: str, value: Any, unit: str) -> None:
    """Raise `ParameterError` unless a value is zero or positive and finite, or no real number."""
    if _is_real(value) and not (value >= 0 and math.isfinite(value)):
        _refuse(link, name, value, f"zero or a positive number of {unit}")


def _refuse(link: int, name: str, value: Any, allowed: str) -> NoReturn:
    raise ParameterError(f"link {link}: {name} is {value!r}; allowed is {allowed}")


def _check_rods(mass: Any, length: Any) -> None:
    """Refuse what is no pair of masses (kg) and of lengths (m), all positive."""
    for name, pair, unit in (("mass", mass, "kg"), ("length", length, "m")):
        _check_pair(name, pair)
        for link in (1, 2):
            _positive(link, name, pair[link - 1], unit)


def _check_pair(name: str, pair: Any) -> None:
    """Refuse anything but two entries, and anything that is not a number."""
    entries = tuple(pair) if isinstance(pair, (tuple, list)) else ()
    if len(entries) != 2:
        raise ParameterError(
            f"{name} is {pair!r}; allowed is a pair with an entry for each of the two links"
        )
    for link, entry in enumerate(entries, start=1):
        if name == "centre":
            if not isinstance(entry, (tuple, list)) or len(entry) != 2:
                _refuse(link, name, entry, "a pair (along, across) in m")
            for coordinate in entry:
                if _is_real(coordinate) and not math.isfinite(coordinate):
                    _refuse(link, name, coordinate, "a finite number of m")
        elif isinstance(entry, (str, bytes, bool)) or entry is None:
            _refuse(link, name, entry, "a number")
