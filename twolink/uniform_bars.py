"""Thin uniform bars, whose moment of inertia m L²/12 is not a float64 number."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from twolink.arithmetic import Pair
from twolink.inputs import nearest_float


def _exact(value: Any) -> Any:
    """Return a float as an exact rational, and any other type unchanged."""
    return Fraction(value) if isinstance(value, (int, float)) else value


def inertia_of_bar(mass: Any, length: Any) -> Any:
    """Return mL²/12 (kg m²) of a thin uniform bar, exact for real numbers."""
    return _exact(mass) * _exact(length) ** 2 / 12


def _is_of_bar(exact: Any, inertia: Any, mass: Any, length: Any) -> bool:
    """Return whether an exact inertia is that of a bar, and rounds to an inertia (kg m²)."""
    bar = inertia_of_bar(mass, length)
    if not isinstance(exact, Fraction) or not isinstance(bar, Fraction):
        return exact is inertia
    return exact == bar and nearest_float(exact) == inertia


def are_bars(exact: Pair, inertia: Pair, mass: Pair, length: Pair) -> bool:
    """Return whether exact moments of inertia are those of bars, and round to others (kg m²)."""
    return all(map(_is_of_bar, exact, inertia, mass, length))


def rounded(value: Any) -> Any:
    """Return the float nearest to an exact rational, and any other type unchanged."""
    return nearest_float(value) if isinstance(value, Fraction) else value
