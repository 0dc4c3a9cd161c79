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
from itertools import starmap
from numbers import Real
from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

from twolink import optional
from twolink.arithmetic import Pair, Scalar, exactly, fraction_in, sqrt
from twolink.errors import ParameterError
from twolink.files import atomic_write
from twolink.inputs import as_path, as_scalar, as_tuple, nearest_float, refuse
from twolink.tables import table
from twolink.urdf.spatial import STANDARD_GRAVITY, Vector3

if TYPE_CHECKING:
    from twolink.urdf import LinkParameters

# Within this range products in float64 neither overflow nor lose digits.
_SMALLEST, _LARGEST = 1e-290, 1e290


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
class Chain:
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
            object.__setattr__(self, name, _pair(name, getattr(self, name)))
        object.__setattr__(self, "rotors", _rotors(self.rotors))
        for link in (1, 2):
            _positive(link, "mass", self.mass[link - 1], "kg")
            _not_negative(link, "inertia", self.inertia[link - 1], "kg m²")
        # L1 defines the elbow and the direction of link 1; L2 only defines D.
        _positive(1, "length", self.length[0], "m")
        _not_negative(2, "length", self.length[1], "m")
        _check_positive_definite(self)
        if not self._is_of_bars():
            object.__setattr__(self, "_exact_inertia", None)
        if not _are_rounded(self._exact_rotors or (), self.rotors):
            object.__setattr__(self, "_exact_rotors", None)

    def _is_of_bars(self) -> bool:
        """Return whether exact inertias are given that are those of the present parameters."""
        if self._exact_inertia is None:
            return False
        parameters = zip(self._exact_inertia, self.inertia, self.mass, self.length, strict=True)
        return all(starmap(_is_of_bar, parameters))

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
        mass, length = _rods(mass, length)
        first, second = map(_inertia_of_bar, mass, length)
        return cls(
            mass=mass,
            length=length,
            centre=((length[0] / 2, length[0] * 0), (length[1] / 2, length[1] * 0)),
            inertia=(_rounded(first), _rounded(second)),
            _exact_inertia=(first, second),
        )

    @classmethod
    def point_masses(cls, mass: Pair = (1.0, 1.0), length: Pair = (1.0, 1.0)) -> Chain:
        """Return the classical double pendulum: point masses (kg) at the ends of rods (m)."""
        mass, length = _rods(mass, length)
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

        if self.rotors:
            raise ParameterError(
                f"a chain must have no rotors for a URDF, which cannot describe them; got "
                f"{len(self.rotors)}"
            )
        try:
            plain = self.convert(float)
        except (TypeError, ValueError) as error:
            raise ParameterError(f"parameters must be numbers for a URDF; got {self!r}") from error
        text = write_planar_urdf(plain.links, name=name)
        if path is not None:
            with atomic_write(as_path("path", path)) as file:
                file.write_text(text, encoding="utf-8")
        return text

    def with_rotors(self, rotors: tuple[Rotor, ...]) -> Chain:
        """Return the chain with more rotors; fractions in `turning` are rounded to float64.

        `convert` converts the fractions themselves.
        """
        rounded = tuple(Rotor(J, (_rounded(w1), _rounded(w2))) for J, (w1, w2) in rotors)
        exact = (*(self._exact_rotors or self.rotors), *rotors)
        return replace(self, rotors=(*self.rotors, *rounded), _exact_rotors=exact)

    def scalar(self, value: Scalar) -> Scalar:
        """Return a real number in the scalar type of the parameters, and other numbers unchanged.

        Effects begin with it. Sums and products of their numbers then have the precision of the
        chain: two float64 torques of 0.1 and 0.2 N m would add up to a rounded sum, and fractions
        do not compute with every type.
        """
        if type(value) is type(self._zero):
            return value
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
        x, y = (self.scalar(_multiplied(value, exponent)) for value in vector)
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

        def converted(value: Any) -> Scalar:
            return exactly(value, number) if isinstance(value, Fraction) else number(value)

        def pair(values: Pair) -> Pair:
            return converted(values[0]), converted(values[1])

        rotors = self._exact_rotors or self.rotors
        return Chain(
            mass=pair(self.mass),
            length=pair(self.length),
            centre=(pair(self.centre[0]), pair(self.centre[1])),
            inertia=pair(self._exact_inertia or self.inertia),
            rotors=tuple(Rotor(converted(j), pair(turning)) for j, turning in rotors),
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


def _check_positive_definite(chain: Chain) -> None:
    """Raise `ParameterError` if the mass matrix is singular in some pose."""
    # Products of floats overflow to infinity, and those of exact numbers raise an error.
    (m1, m2), (I_C1, I_C2) = map(_in_floats, (chain.mass, chain.inertia))
    (a1, b1), (a2, b2) = map(_in_floats, chain.centre)
    _positive(2, "inertia about B", I_C2 + m2 * (a2 * a2 + b2 * b2), "kg m²")
    # det M, at its smallest, is I_A I_B + m2 L1² I_C2.
    if _is_real(I_C2) and I_C2 == 0:
        _positive(1, "inertia about A", I_C1 + m1 * (a1 * a1 + b1 * b1), "kg m²")
    _check_float_range(chain)


def _check_float_range(chain: Chain) -> None:
    """Raise `ParameterError` if det M of float64 parameters leaves their range in some pose."""
    given = (chain.mass, chain.inertia, *chain.centre, chain.length)
    (m1, m2), (I_C1, I_C2), C1, C2, (L1, _) = map(_in_floats, given)
    if not all(isinstance(number, float) for number in (m1, m2, I_C1, I_C2, *C1, *C2, L1)):
        return
    reach1, reach2 = math.hypot(*C1), math.hypot(*C2)
    carried = m2 * L1 * L1
    I_A, I_B = I_C1 + m1 * reach1 * reach1, I_C2 + m2 * reach2 * reach2
    least, most = I_A * I_B + carried * I_C2, (I_A + carried) * I_B
    # If both bounds are nearly equal, rounding may exchange their order.
    if not (least >= _SMALLEST and most <= _LARGEST):
        raise ParameterError(
            f"the mass matrix's determinant must be {_SMALLEST:.0e} to {_LARGEST:.0e} kg² m⁴, "
            f"the range of float64 with all digits; got {least:.3g} to {most:.3g}"
        )


def _is_real(value: Any) -> bool:
    return isinstance(value, Real)


def _in_floats(pair: Pair) -> Pair:
    """Return exact numbers as floats, and any other type unchanged."""
    first, second = (nearest_float(x) if isinstance(x, (int, Fraction)) else x for x in pair)
    return first, second


def _exact(value: Any) -> Any:
    """Return a float as an exact rational, and any other type unchanged."""
    return Fraction(value) if isinstance(value, (int, float)) else value


def _inertia_of_bar(mass: Any, length: Any) -> Any:
    """Return mL²/12 (kg m²) of a thin uniform bar, exact for real numbers."""
    return _exact(mass) * _exact(length) ** 2 / 12


def _is_of_bar(exact: Any, inertia: Any, mass: Any, length: Any) -> bool:
    """Return whether an exact inertia is that of a bar, and rounds to an inertia (kg m²)."""
    bar = _inertia_of_bar(mass, length)
    if not isinstance(exact, Fraction) or not isinstance(bar, Fraction):
        return exact is inertia
    return exact == bar and nearest_float(exact) == inertia


def _are_rounded(exact: tuple[Rotor, ...], rotors: tuple[Rotor, ...]) -> bool:
    """Return whether rotors are exact ones with angular velocities rounded to float64."""
    rounded = (Rotor(J, (_rounded(w1), _rounded(w2))) for J, (w1, w2) in exact)
    return tuple(rounded) == rotors


def _multiplied(value: Any, exponent: int) -> Any:
    """Return a real number times a power of two, exactly."""
    if isinstance(value, (int, Fraction)):
        return value * Fraction(2) ** exponent
    # Two factors, as the power may be beyond the range of float64.
    half = exponent // 2
    return value * math.ldexp(1.0, half) * math.ldexp(1.0, exponent - half)


def _rounded(value: Any) -> Any:
    """Return the float nearest to an exact rational, and any other type unchanged."""
    return nearest_float(value) if isinstance(value, Fraction) else value


def _positive(link: int, name: str, value: Any, unit: str) -> None:
    """Raise `ParameterError` if a real number is not positive and finite."""
    if _is_real(value) and not (value > 0 and math.isfinite(value)):
        _fail(link, name, value, f"a positive number of {unit}")


def _not_negative(link: int, name: str, value: Any, unit: str) -> None:
    """Raise `ParameterError` if a real number is not zero or positive and finite."""
    if _is_real(value) and not (value >= 0 and math.isfinite(value)):
        _fail(link, name, value, f"zero or a positive number of {unit}")


def _fail(link: int, name: str, value: Any, requirement: str) -> NoReturn:
    raise ParameterError(f"link {link}: {name} must be {requirement}; got {value!r}")


def _rods(mass: Any, length: Any) -> tuple[Pair, Pair]:
    """Return pairs of masses (kg) and lengths (m). Raises `ParameterError` if not positive."""
    pairs = _pair("mass", mass), _pair("length", length)
    for name, pair, unit in zip(("mass", "length"), pairs, ("kg", "m"), strict=True):
        for link in (1, 2):
            _positive(link, name, pair[link - 1], unit)
    return pairs


def _pair(name: str, pair: Any) -> Any:
    """Return two entries, or refuse anything else, and anything that is not a number."""
    wanted = "a pair with an entry for each of the two links"
    entries = as_tuple(name, pair, wanted)
    if len(entries) != 2:
        refuse(name, pair, wanted)
    return tuple(_entry(link, name, entry) for link, entry in enumerate(entries, start=1))


def _entry(link: int, name: str, entry: Any) -> Any:
    """Return a number, or a mass centre's pair of finite numbers."""
    where = f"link {link}: {name}"
    if name != "centre":
        return as_scalar(where, entry)
    wanted = "a pair (along, across) in m"
    pair = tuple(as_scalar(where, coordinate) for coordinate in as_tuple(where, entry, wanted))
    if len(pair) != 2:
        refuse(where, entry, wanted)
    for coordinate in pair:
        if _is_real(coordinate) and not math.isfinite(coordinate):
            _fail(link, name, coordinate, "a finite number of m")
    return pair


def _rotors(rotors: Any) -> tuple[Rotor, ...]:
    """Return a tuple of rotors, or refuse other objects."""
    entries = as_tuple("rotors", rotors, "a sequence of rotors")
    for entry in entries:
        if not isinstance(entry, Rotor):
            refuse("rotors", entry, "a sequence of rotors")
    return entries
