"""Arguments of users as values: numbers, pairs and tuples that nothing can change afterwards.

Sequences, arrays and generators become tuples, and NumPy's scalars Python's. Numbers may be of any
kind (float, long double, mpmath, SymPy symbols); anything else is refused by name.
"""

from __future__ import annotations

import functools
import inspect
import math
import sys
import types
from collections.abc import Callable, Iterable, Mapping, Set
from dataclasses import fields
from datetime import timedelta
from decimal import Decimal
from fractions import Fraction
from itertools import islice
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import Any, Literal, NoReturn, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from twolink.errors import ParameterError
from twolink.text import choice, quoted

Name = TypeVar("Name", bound=str)

# Beyond this number of entries a generator is taken to be endless.
MOST_ENTRIES = 10_000_000


def refuse(name: str, value: Any, wanted: str) -> NoReturn:
    """Raise `ParameterError`: an argument must be something else."""
    raise ParameterError(f"{name} must be {wanted}; got {quoted(value)}")


def as_number(name: str, value: Any) -> Any:
    """Return a number of any kind; those of NumPy that float64 holds as Python's.

    Decimal numbers become fractions, which have their value and compute with floats.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (np.bool_, bool)) or not is_number(value):
        refuse(name, value, "a number")
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, (np.float64, np.float32, np.float16)):
        return float(value)
    if isinstance(value, Decimal):
        return _as_fraction(name, value)
    if isinstance(value, (int, Fraction)) and not -_LARGEST <= value <= _LARGEST:
        refuse(name, value, "a number that float64 can hold")
    return value


_LARGEST = int(np.finfo(float).max)
# A decimal number with exponents beyond these has a fraction of that many digits.
_LEAST_EXPONENT, _GREATEST_EXPONENT = -400, 307


def _as_fraction(name: str, value: Decimal) -> Fraction | float:
    """Return the value of a decimal number; infinity and NaN as floats."""
    if not value.is_finite():
        return math.nan if value.is_nan() else float(value)
    if value and not _LEAST_EXPONENT <= value.adjusted() <= _GREATEST_EXPONENT:
        refuse(name, value, "a number that float64 can hold")
    return Fraction(value) if value else Fraction(0)


def as_scalar(name: str, value: Any) -> Any:
    """Return a number of any kind, complex too, or a copy of an array of numbers."""
    if isinstance(value, np.ndarray) and value.ndim and value.dtype.kind in "iufcO":
        if value.dtype.kind == "O":
            for entry in value.flat:
                as_number(name, entry)
        return value.copy()
    if isinstance(value, (complex, np.complexfloating)):
        return value
    return as_number(name, value)


_NO_NUMBERS = (
    *(str, bytes, bytearray, list, tuple, np.ndarray, type),
    *(complex, np.complexfloating, timedelta, np.datetime64, np.timedelta64),
)


def is_number(value: Any) -> bool:
    """Return whether an object can be computed with, and is no collection, complex or a time."""
    if isinstance(value, _NO_NUMBERS):
        return False
    return hasattr(type(value), "__mul__") and hasattr(type(value), "__sub__")


def nearest_float(number: Any) -> float:
    """Return a real number in float64; infinity beyond its range, NaN for any other object."""
    if not isinstance(number, Real):
        return math.nan
    try:
        return float(number)
    except OverflowError:
        return math.inf


def as_real(name: str, value: Any) -> float:
    """Return a finite real number in float64."""
    number = nearest_float(as_number(name, value))
    if not math.isfinite(number):
        refuse(name, value, "a finite real number")
    return number


def as_positive(name: str, value: Any) -> float:
    """Return a positive and finite real number in float64."""
    number = nearest_float(as_number(name, value))
    if not 0 < number < math.inf:
        refuse(name, value, "a positive number")
    return number


LEAST_DURATION = 1e-290
"""The shortest duration (s): the steps and samples of a shorter one would not be normal numbers."""


def as_duration(name: str, value: Any) -> float:
    """Return a duration (s) of `LEAST_DURATION` or more in float64."""
    seconds = as_positive(name, value)
    if seconds < LEAST_DURATION:
        refuse(name, value, f"{LEAST_DURATION:g} s or more")
    return seconds


def as_count(name: str, value: Any, least: int = 0, most: int | None = None, why: str = "") -> int:
    """Return a whole number that is not below the least one, nor above the `most`.

    `why` says why there are no more.
    """
    expected = f"of {least} or more" if most is None else f"from {least} to {most}{why}"
    number = None if isinstance(value, (bool, np.bool_)) else value
    try:
        count = number.__index__()  # type: ignore[union-attr]
    except (AttributeError, TypeError):
        refuse(name, value, f"a whole number {expected}")
    if count < least or (most is not None and count > most):
        refuse(name, value, f"a whole number {expected}")
    if count > sys.maxsize:
        refuse(name, value, f"a whole number of {sys.maxsize} or less")
    return int(count)


def as_flag(name: str, value: Any) -> bool:
    """Return True or False."""
    if not isinstance(value, (bool, np.bool_)):
        refuse(name, value, "True or False")
    return bool(value)


def as_word(name: str, value: Any) -> str:
    """Return a string."""
    if not isinstance(value, str):
        refuse(name, value, "a string")
    return value


def as_choice(name: str, value: Any, known: Iterable[Name]) -> Name:
    """Return one of the known names."""
    names, word = list(known), as_word(name, value)
    if word not in names:
        raise ParameterError(choice(name, word, names))
    return names[names.index(word)]


def as_words(name: str, value: Any) -> tuple[str, ...]:
    """Return the entries of a sequence of strings."""
    entries = as_tuple(name, value, "a sequence of strings")
    return tuple(as_word(f"{name}[{k}]", word) for k, word in enumerate(entries))


def as_path(name: str, value: Any) -> Path:
    """Return the path of a file or folder, which is a string or an object that has one."""
    try:
        if isinstance(value, (str, PathLike)):
            return Path(value)
    except TypeError:
        # A path of bytes.
        pass
    refuse(name, value, "a path")


def check_instance(name: str, value: Any, kind: type) -> None:
    """Raise `ParameterError` for an object that is no instance of a class."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        refuse(name, value, f"{article} {kind.__name__}")


def check_callback(name: str, value: Any, arguments: tuple[str, ...]) -> None:
    """Raise `ParameterError` for an object that is neither a function of arguments nor None."""
    if value is not None and not (callable(value) and _takes(value, len(arguments))):
        refuse(name, value, f"a function of {' and '.join(arguments)}, or None")


def _takes(function: Callable[..., object], count: int) -> bool:
    """Return whether a function takes a number of arguments, as far as that is known."""
    try:
        inspect.signature(function).bind(*range(count))
    except TypeError:
        return False
    except ValueError:
        # Some functions written in C have no signature.
        return True
    return True


def as_tuple(name: str, value: Any, wanted: str) -> tuple[Any, ...]:
    """Return the entries of a sequence, an array or a generator."""
    unordered = isinstance(value, (str, bytes, bytearray, Mapping, Set))
    if unordered or not hasattr(value, "__iter__") or isinstance(value, type):
        refuse(name, value, wanted)
    try:
        entries = tuple(islice(value, MOST_ENTRIES + 1))
    except TypeError:
        # An array without dimensions has `__iter__`, and raises an error in it.
        refuse(name, value, wanted)
    if len(entries) > MOST_ENTRIES:
        raise ParameterError(f"{name} must have {MOST_ENTRIES} entries or fewer; got more")
    return entries


def as_pair(name: str, value: Any, wanted: str = "a pair of numbers") -> tuple[Any, Any]:
    """Return a pair of numbers of any kind."""
    entries = as_tuple(name, value, wanted)
    if len(entries) != 2:
        refuse(name, value if isinstance(value, (tuple, list)) else entries, wanted)
    first, second = (as_number(f"{name}[{k}]", entry) for k, entry in enumerate(entries))
    return first, second


def as_times(value: Any) -> np.ndarray[Any, Any]:
    """Return one time, or a row of them (s), as an array of shape (n,)."""
    wanted = "a number of seconds, or a row of them"
    if hasattr(value, "__next__"):
        value = as_tuple("times", value, wanted)
    found = np.atleast_1d(as_floats("times", value, wanted))
    if found.ndim != 1 or isinstance(value, (str, bytes)):
        refuse("times", value, wanted)
    return found


def as_floats(name: str, value: Any, wanted: str = "an array of numbers") -> np.ndarray[Any, Any]:
    """Return a copy of an array of numbers, in float64; those too large for it are infinite."""
    if value is None or _is_masked(value):
        refuse(name, value, wanted)
    try:
        with np.errstate(over="ignore"):
            given = np.asarray(value)
            if given.dtype.kind == "O":
                given = np.vectorize(_in_float64, [float])(given)
            if given.dtype.kind in "iuf":
                return np.array(given, dtype=float)
    except (TypeError, ValueError, OverflowError):
        pass
    # Truth values, texts, complex numbers and times could be converted, but are no real numbers.
    refuse(name, value, wanted)


def _in_float64(number: Any) -> float:
    """Return a number of any kind as a float, or raise `TypeError` or `OverflowError`."""
    if isinstance(number, (bool, np.bool_)) or not is_number(number):
        raise TypeError
    return float(number)


def _is_masked(value: Any) -> bool:
    """Return whether something is masked, of which NumPy would take the number beneath."""
    # NumPy imports this module on demand, which takes 30 ms.
    masked = sys.modules.get("numpy.ma")
    if masked is None:
        return False
    entries = value if isinstance(value, (list, tuple)) else ()
    return any(isinstance(entry, masked.MaskedArray) for entry in (value, *entries))


def take_fields(owner: Any, where: str, *, real: bool = False) -> None:
    """Set the fields of a frozen data class to the values of its arguments.

    The annotations give the type of each: a number, a pair or a tuple of numbers, a truth value, a
    string, or a tuple of strings. Long doubles that float64 does not hold become fractions, which
    compute with numbers of every type. With `real`, numbers must be real, as those that are
    compared. Raises `ParameterError` for anything else.
    """
    kind: Any = type(owner)
    number = _as_ordered if real else _as_field
    for name, annotation in _annotations(kind).items():
        value = _taken(f"{where}: {name}", getattr(owner, name), annotation, number)
        object.__setattr__(owner, name, value)


@functools.cache
def _annotations(kind: type) -> dict[str, Any]:
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind) if field.init}


def _as_ordered(name: str, value: Any) -> Any:
    """Return a real number, which may be infinite or NaN."""
    number = _as_field(name, value)
    if not isinstance(number, Real):
        refuse(name, value, "a real number")
    return number


def _as_field(name: str, value: Any) -> Any:
    """Return a number; a long double as a float, or as the fraction that it is."""
    number = as_number(name, value)
    if not isinstance(number, np.longdouble):
        return number
    if float(number) == number or np.isnan(number):
        return float(number)
    return as_number(name, Fraction(*number.as_integer_ratio()))


def _taken(name: str, value: Any, annotation: Any, as_number: Callable[[str, Any], Any]) -> Any:
    """Return an argument as a value of its annotation."""
    if get_origin(annotation) in (Union, types.UnionType):
        if value is None:
            return None
        (annotation,) = (part for part in get_args(annotation) if part is not type(None))
    if annotation is bool:
        if not isinstance(value, (bool, np.bool_)):
            refuse(name, value, "True or False")
        return bool(value)
    if annotation is str or get_origin(annotation) is Literal:
        return as_word(name, value)
    if get_origin(annotation) is not tuple:
        return as_number(name, value)
    kind, *rest = get_args(annotation)
    if rest == [kind]:
        return tuple(as_number(f"{name}[{k}]", x) for k, x in enumerate(as_pair(name, value)))
    word = get_origin(kind) is Literal
    entries = as_tuple(name, value, "a sequence of strings" if word else "a sequence of numbers")
    return tuple(_taken(f"{name}[{k}]", entry, kind, as_number) for k, entry in enumerate(entries))
