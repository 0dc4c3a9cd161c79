"""Checks of the parameters of a chain: pairs of numbers, their signs, and the mass matrix."""

from __future__ import annotations

import math
from fractions import Fraction
from numbers import Real
from typing import Any, NoReturn

from twolink.arithmetic import Pair
from twolink.errors import ParameterError
from twolink.inputs import as_scalar, as_tuple, nearest_float, refuse

# Within this range products in float64 neither overflow nor lose digits.
_SMALLEST, _LARGEST = 1e-290, 1e290


def positive(link: int, name: str, value: Any, unit: str) -> None:
    """Raise `ParameterError` if a real number is not positive and finite."""
    if _is_real(value) and not (value > 0 and math.isfinite(value)):
        _fail(link, name, value, f"a positive number of {unit}")


def not_negative(link: int, name: str, value: Any, unit: str) -> None:
    """Raise `ParameterError` if a real number is not zero or positive and finite."""
    if _is_real(value) and not (value >= 0 and math.isfinite(value)):
        _fail(link, name, value, f"zero or a positive number of {unit}")


def _fail(link: int, name: str, value: Any, requirement: str) -> NoReturn:
    raise ParameterError(f"link {link}: {name} must be {requirement}; got {value!r}")


def rods(mass: Any, length: Any) -> tuple[Pair, Pair]:
    """Return pairs of masses (kg) and lengths (m). Raises `ParameterError` if not positive."""
    pairs = pair_of_links("mass", mass), pair_of_links("length", length)
    for name, pair, unit in zip(("mass", "length"), pairs, ("kg", "m"), strict=True):
        for link in (1, 2):
            positive(link, name, pair[link - 1], unit)
    return pairs


def pair_of_links(name: str, pair: Any) -> Any:
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


def rotor_parameters(number: int, inertia: Any, turning: Any) -> tuple[Any, Pair]:
    """Return the inertia (kg m²) and the turning of a rotor, which are numbers.

    Raises `ParameterError` for a negative inertia, and for numbers that are not finite.
    """
    where = f"rotor {number}"
    inertia = as_scalar(f"{where}: inertia", inertia)
    if _is_real(inertia) and not (inertia >= 0 and math.isfinite(inertia)):
        refuse(f"{where}: inertia", inertia, "zero or a positive number of kg m²")
    wanted = "a pair of finite numbers"
    turns = tuple(
        as_scalar(f"{where}: turning", turn)
        for turn in as_tuple(f"{where}: turning", turning, wanted)
    )
    if len(turns) != 2 or not all(math.isfinite(turn) for turn in turns if _is_real(turn)):
        refuse(f"{where}: turning", turning, wanted)
    return inertia, turns


def check_signs(mass: Pair, length: Pair, inertia: Pair) -> None:
    """Raise `ParameterError` for a real number that is infinite, or has a sign that no link has."""
    for link in (1, 2):
        positive(link, "mass", mass[link - 1], "kg")
        not_negative(link, "inertia", inertia[link - 1], "kg m²")
    # L1 defines the elbow and the direction of link 1; L2 only defines D.
    positive(1, "length", length[0], "m")
    not_negative(2, "length", length[1], "m")


def check_positive_definite(
    mass: Pair, length: Pair, centre: tuple[Pair, Pair], inertia: Pair
) -> None:
    """Raise `ParameterError` if the mass matrix is singular in some pose."""
    # Products of floats overflow to infinity, and those of exact numbers raise an error.
    (m1, m2), (I_C1, I_C2) = map(_in_floats, (mass, inertia))
    (a1, b1), (a2, b2) = map(_in_floats, centre)
    positive(2, "inertia about B", I_C2 + m2 * (a2 * a2 + b2 * b2), "kg m²")
    # det M, at its smallest, is I_A I_B + m2 L1² I_C2.
    if _is_real(I_C2) and I_C2 == 0:
        positive(1, "inertia about A", I_C1 + m1 * (a1 * a1 + b1 * b1), "kg m²")
    _check_float_range(mass, length, centre, inertia)


def _check_float_range(mass: Pair, length: Pair, centre: tuple[Pair, Pair], inertia: Pair) -> None:
    """Raise `ParameterError` if det M of float64 parameters leaves their range in some pose."""
    given = (mass, inertia, *centre, length)
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
