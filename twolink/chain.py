"""The parameters of a planar two-link chain.

                A ──── link 1 ──── B ──── link 2 ──── D

A is fixed, B is the elbow, D the free end. Each link has a frame in the plane of motion: its
origin is the link's first joint, `along` points to B (link 1) or D (link 2), and `across` is
`along` turned by +90° in the positive sense of the angles.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from numbers import Real
from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from twolink import optional
from twolink.arithmetic import Pair, Scalar, exactly, fraction_in, sqrt, times_power_of_two
from twolink.chain_checks import (
    check_positive_definite,
    check_signs,
    pair_of_links,
    rods,
    rotor_parameters,
)
from twolink.errors import ParameterError
from twolink.files import atomic_write
from twolink.inputs import as_path, as_tuple, refuse
from twolink.tables import table
from twolink.uniform_bars import are_bars, inertia_of_bar, rounded
from twolink.urdf.spatial import STANDARD_GRAVITY, Vector3
from twolink.values import Kept

if TYPE_CHECKING:
    from twolink.urdf import LinkParameters


class Point(NamedTuple):
    """A point fixed to a link: link 1 or 2, and its coordinates `along` and `across` it (m)."""

    link: int
    along: Scalar
    across: Scalar


class Rotor(NamedTuple):
    """A rotating body on a link with angular velocity ω = w1 u1 + w2 u2, where `turning` is w.

    `inertia` is about its own axis (kg m²); its mass and position are included in the link.
    """

    inertia: Scalar
    turning: Pair


@dataclass(frozen=True)
class Chain(Kept):
    """A planar two-link chain; each field is a pair with an entry for link 1 and link 2.

    `mass` in kg; `length` in m, from A to B and from B to D; `centre`, the mass centre's `along`
    and `across` in m; `inertia` about the mass centre in kg m². `rotors` are the rotors of motors,
    if any. Every scalar type is valid (floats, mpmath, SymPy symbols). Real numbers are checked;
    `ParameterError` names the link, the requirement and the received value.
    """

    mass: Pair
    length: Pair
    centre: tuple[Pair, Pair]
    inertia: Pair
    rotors: tuple[Rotor, ...] = ()
    # A uniform bar's mL²/12 is not a float64 number. The exact value is kept for `convert`, as long
    # as the mass, the length and the inertia are those of the bar.
    _exact_inertia: Pair | None = field(default=None, repr=False, compare=False)
    # The same for a rotor on link 1 with a gear ratio n: it turns with 1 − n times u1.
    _exact_rotors: tuple[Rotor, ...] | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Check every parameter that is a real number, and keep tuples of them."""
        for name in ("mass", "length", "centre", "inertia"):
            object.__setattr__(self, name, pair_of_links(name, getattr(self, name)))
        object.__setattr__(self, "rotors", _rotors(self.rotors))
        check_signs(self.mass, self.length, self.inertia)
        check_positive_definite(self.mass, self.length, self.centre, self.inertia)
        exact = self._exact_inertia
        if exact and not are_bars(exact, self.inertia, self.mass, self.length):
            object.__setattr__(self, "_exact_inertia", None)
        if self._exact_rotors and _nearest(self._exact_rotors) != self.rotors:
            object.__setattr__(self, "_exact_rotors", None)

    def _repr_html_(self) -> str:
        """Return the drawing and a table of the parameters, for notebooks."""
        rows = [
            ("mass (kg)", *map(repr, self.mass)),
            ("length (m)", *map(repr, self.length)),
            ("mass centre, along and across (m)", *map(repr, self.centre)),
            ("inertia about the mass centre (kg m²)", *map(repr, self.inertia)),
        ]
        return optional.drawing(self) + table("Chain", ("", "link 1", "link 2"), rows).html()

    @classmethod
    def uniform_bars(cls, mass: Pair = (1.0, 1.0), length: Pair = (1.0, 1.0)) -> Chain:
        """Return a chain of thin uniform bars with the given masses (kg) and lengths (m).

        The mass centres are at mid-length and I_C = mL²/12 (section 6.1).
        """
        mass, length = rods(mass, length)
        first, second = map(inertia_of_bar, mass, length)
        return cls(
            mass=mass,
            length=length,
            centre=((length[0] / 2, length[0] * 0), (length[1] / 2, length[1] * 0)),
            inertia=(rounded(first), rounded(second)),
            _exact_inertia=(first, second),
        )

    @classmethod
    def point_masses(cls, mass: Pair = (1.0, 1.0), length: Pair = (1.0, 1.0)) -> Chain:
        """Return the classical double pendulum: point masses (kg) at the ends of rods (m)."""
        mass, length = rods(mass, length)
        zero = length[0] * 0
        return cls(
            mass, length, centre=((length[0], zero), (length[1], zero)), inertia=(zero, zero)
        )

    @classmethod
    def from_urdf(
        cls,
        path: str | PathLike[str],
        *,
        tip: str | None = None,
        gravity: Vector3 = (0.0, 0.0, -STANDARD_GRAVITY),
    ) -> Chain:
        """Return the chain of a URDF file.

        `tip` and `gravity` are those of `twolink.urdf.read_planar_urdf`, which also returns the
        position of the chain and its joint-angle convention. Raises `UrdfError` for a file that is
        not a planar two-link chain.
        """
        from twolink.urdf import read_planar_urdf

        return cls.from_links(read_planar_urdf(path, tip=tip, gravity=gravity).links)

    @classmethod
    def from_links(cls, links: tuple[LinkParameters, LinkParameters]) -> Chain:
        """Return the chain of two links in the format of `twolink.urdf`."""
        return cls(
            mass=(links[0].mass, links[1].mass),
            length=(links[0].length, links[1].length),
            centre=(links[0].centre, links[1].centre),
            inertia=(links[0].inertia, links[1].inertia),
        )

    @property
    def links(self) -> tuple[LinkParameters, LinkParameters]:
        """The parameters of the two links, as `twolink.urdf` reads and writes them."""
        from twolink.urdf import LinkParameters

        fields = zip(self.mass, self.length, self.centre, self.inertia, strict=True)
        first, second = (LinkParameters(*parameters) for parameters in fields)
        return first, second

    def to_urdf(self, path: str | PathLike[str] | None = None, *, name: str = "twolink") -> str:
        """Return the chain as URDF text, and write it to `path` if one is given.

        Reading it back gives the same parameters (kg, m, kg m²) to the last bit.
        """
        from twolink.urdf import write_planar_urdf

        text = write_planar_urdf(_plain(self).links, name=name)
        if path is not None:
            with atomic_write(as_path("path", path)) as file:
                file.write_text(text, encoding="utf-8")
        return text

    def with_rotors(self, rotors: tuple[Rotor, ...]) -> Chain:
        """Return the chain with more rotors; fractions in `turning` are rounded to float64.

        `convert` converts the fractions themselves.
        """
        rotors = _rotors(rotors)
        exact = (*(self._exact_rotors or self.rotors), *rotors)
        return replace(self, rotors=(*self.rotors, *_nearest(rotors)), _exact_rotors=exact)

    def scalar(self, value: Scalar) -> Scalar:
        """Return a real number in the scalar type of the parameters, and other numbers unchanged.

        Effects begin with it. Sums and products of their numbers then have the precision of the
        chain: two float64 torques of 0.1 and 0.2 N m would add up to a rounded sum, and fractions
        do not compute with every type.
        """
        kind = type(value)
        if kind is type(self._zero):
            return value
        if kind is float or kind is int:
            # The usual case, without the slow test of an abstract class.
            return value + self._zero
        if isinstance(value, Fraction):
            return fraction_in(value, self._zero)
        return value + self._zero if isinstance(value, Real) else value

    def scalars(self, pair: Pair) -> Pair:
        """Return a pair of real numbers in the scalar type of the parameters."""
        return self.scalar(pair[0]), self.scalar(pair[1])

    def unit(self, vector: tuple[float, float]) -> Pair:
        """Return a vector in unit length, in the scalar type of the parameters."""
        # Exact, so that no square overflows or vanishes.
        exponent = -math.frexp(max(map(abs, vector)))[1]
        x, y = (self.scalar(times_power_of_two(value, exponent)) for value in vector)
        size = sqrt(x * x + y * y)
        return x / size, y / size

    def convert(self, number: Callable[[Any], Scalar]) -> Chain:
        """Return the same chain in another scalar type, such as `mpmath.mpf` or `longdouble`.

        Each float64 parameter keeps its exact value; a uniform bar's mL²/12 is recomputed from
        the exact rational values of its mass and length. A chain of float64 numbers is its own
        conversion to float64.
        """
        if number is float and self._is_of_floats:
            return self
        if number is not np.longdouble:
            return self._converted(number)
        return self._in_long_doubles

    @cached_property
    def _in_long_doubles(self) -> Chain:
        """The same chain in long doubles, which are wanted many times."""
        return self._converted(np.longdouble)

    def _converted(self, number: Callable[[Any], Scalar]) -> Chain:
        """Return the same chain in another scalar type."""

        def pair(values: Pair) -> Pair:
            return _converted(values[0], number), _converted(values[1], number)

        rotors = self._exact_rotors or self.rotors
        return Chain(
            mass=pair(self.mass),
            length=pair(self.length),
            centre=(pair(self.centre[0]), pair(self.centre[1])),
            inertia=pair(self._exact_inertia or self.inertia),
            rotors=tuple(Rotor(_converted(j, number), pair(turning)) for j, turning in rotors),
        )

    @cached_property
    def _zero(self) -> Scalar:
        """Zero in the scalar type of the parameters."""
        return 0 * self.L1

    @cached_property
    def _is_of_floats(self) -> bool:
        turning = [entry for rotor in self.rotors for entry in (rotor.inertia, *rotor.turning)]
        numbers = (*self.mass, *self.length, *self.centre[0], *self.centre[1], *self.inertia)
        return all(type(number) is float for number in (*numbers, *turning))

    # Symbols of the equations.

    @cached_property
    def m1(self) -> Scalar:
        """Mass of link 1, kg."""
        return self.mass[0]

    @cached_property
    def m2(self) -> Scalar:
        """Mass of link 2, kg."""
        return self.mass[1]

    @cached_property
    def L1(self) -> Scalar:
        """Length of link 1, from A to B, m."""
        return self.length[0]

    @cached_property
    def L2(self) -> Scalar:
        """Length of link 2, from B to D, m."""
        return self.length[1]

    @cached_property
    def I_C1(self) -> Scalar:
        """Inertia of link 1 about its mass centre, kg m²."""
        return self.inertia[0]

    @cached_property
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


def _nearest(rotors: tuple[Rotor, ...]) -> tuple[Rotor, ...]:
    """Return rotors whose angular velocities are rounded to float64 if they are fractions."""
    return tuple(Rotor(J, (rounded(w1), rounded(w2))) for J, (w1, w2) in rotors)


def _rotors(rotors: Any) -> tuple[Rotor, ...]:
    """Return a tuple of rotors, or refuse other objects."""
    entries = as_tuple("rotors", rotors, "a sequence of rotors")
    for entry in entries:
        if not isinstance(entry, Rotor):
            refuse("rotors", entry, "a sequence of rotors")
    return tuple(Rotor(*rotor_parameters(k, *entry)) for k, entry in enumerate(entries, start=1))


def _converted(value: Any, number: Callable[[Any], Scalar]) -> Scalar:
    """Return a parameter in another scalar type, with all digits that it has in that type."""
    # Few types make numbers of fractions, and balls none of long doubles.
    return exactly(value, number) if isinstance(value, (Fraction, np.longdouble)) else number(value)


def _plain(chain: Chain) -> Chain:
    """Return a chain in float64 that a URDF describes; raises `ParameterError` for any other."""
    if chain.rotors:
        raise ParameterError(
            f"a chain must have no rotors for a URDF, which cannot describe them; got "
            f"{len(chain.rotors)}"
        )
    try:
        return chain.convert(float)
    except (TypeError, ValueError) as error:
        raise ParameterError(f"parameters must be numbers for a URDF; got {chain!r}") from error
