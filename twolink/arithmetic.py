"""Functions of any scalar type: float, array, long double, mpmath, SymPy or heyoka.

Every formula of this project is written once, with + − × ÷ and the functions below. The type of the
arguments determines the result: a float, an array, fifty digits or a symbolic expression.

The library of a number's type supplies the functions. Nothing is imported here that the caller has
not imported already, so SymPy and mpmath cost nothing if they are not used.
"""

import cmath
import math
import sys
from collections.abc import Callable
from fractions import Fraction
from numbers import Integral, Rational, Real
from types import ModuleType
from typing import Any

from twolink.errors import SimulationError

# Any scalar type. It is not narrower, since no protocol covers both SymPy and NumPy.
Scalar = Any
Pair = tuple[Scalar, Scalar]
"""Two numbers: an entry for each link (q1, q2), or the x and y components of a plane vector."""
Matrix = tuple[Pair, Pair]
"""A 2 × 2 matrix as a pair of rows."""


def _library_of(x: Scalar) -> ModuleType:
    """Return the module that supplies the functions of numbers like x."""
    kind = type(x)
    if kind not in _LIBRARIES:
        _LIBRARIES[kind] = _find_library(kind)
    return _LIBRARIES[kind]


_LIBRARIES: dict[type, ModuleType] = {}

# Sines are evaluated very often: the functions of known types are looked up without a call.
_SINES: dict[type, Callable[[Scalar], Scalar]] = {}
_COSINES: dict[type, Callable[[Scalar], Scalar]] = {}


def _find_library(kind: type) -> ModuleType:
    if issubclass(kind, (float, int, Fraction)):
        return math
    if issubclass(kind, complex):
        return cmath
    package = kind.__module__.partition(".")[0]
    if package == "heyoka" and kind.__name__.startswith("real"):
        # heyoka's functions take expressions; its multiprecision numbers use NumPy's functions.
        package = "numpy"
    if package in ("jax", "jaxlib"):
        # JAX has arrays and tracers in several modules, and its functions in one.
        package = "jax.numpy"
    for name in (package, kind.__module__):
        module = sys.modules.get(name)
        if module is not None and hasattr(module, "sin"):
            return module
    if all(hasattr(kind, name) for name in _METHODS):
        return _functions_of(kind)
    raise TypeError(f"x must be of a supported number type; got {kind!r}")


# The methods of numbers that have functions as methods, such as the balls of Arb.
_METHODS = ("sin", "cos", "sqrt", "exp", "tanh")


def _functions_of(kind: type) -> ModuleType:
    """Return a module of the functions that numbers of a kind have as methods."""
    module = ModuleType(f"functions of {kind.__name__}")
    for name in _METHODS:
        setattr(module, name, getattr(kind, name))
    return module


def exactly(value: Any, number: Callable[[Any], Scalar]) -> Scalar:
    """Return a real number of Python or NumPy in numbers of a type, and other numbers as they are.

    `number` makes numbers of that type of floats and whole numbers; float64 is rounded to nearest.
    A long double is the sum of two float64 numbers.
    """
    if not isinstance(value, Real):
        return value
    if number is float:
        return float(value)
    if isinstance(value, Integral):
        return number(int(value))
    if isinstance(value, Rational):
        return number(value.numerator) / number(value.denominator)
    first = float(value)
    rest: Any = value - first if math.isfinite(first) else 0.0
    return number(first) + number(float(rest)) if rest else number(first)


def fraction_in(value: Fraction, zero: Scalar) -> Scalar:
    """Return a fraction in the type and the shape of a zero, with the digits of that type."""
    if isinstance(zero, (int, Fraction)):
        return value
    # Arrays, and numbers of NumPy and JAX, do not take whole numbers of any size.
    kind: Any = zero.dtype.type if hasattr(zero, "dtype") else type(zero)
    if kind.__name__ == "longdouble":
        return zero + kind(value.numerator) / kind(value.denominator)
    if _has_own_digits(kind):
        return (zero + value.numerator) / (zero + value.denominator)
    return zero + float(value)


def _has_own_digits(kind: type) -> bool:
    """Return whether numbers of a kind divide with more digits than those of float64.

    Expressions of heyoka do not: they divide by a number as they multiply by its reciprocal.
    """
    package = kind.__module__.partition(".")[0]
    if package == "heyoka":
        return kind.__name__.startswith("real")
    return package not in ("builtins", "numpy", "jax", "jaxlib")


def sin(x: Scalar) -> Scalar:
    """Return the sine of x (rad), in the type of x."""
    return (_SINES.get(type(x)) or _SINES.setdefault(type(x), _library_of(x).sin))(x)


def cos(x: Scalar) -> Scalar:
    """Return the cosine of x (rad), in the type of x."""
    return (_COSINES.get(type(x)) or _COSINES.setdefault(type(x), _library_of(x).cos))(x)


def sine_and_cosine(x: Scalar) -> Pair:
    """Return the sine and the cosine of x (rad), in the type of x."""
    library = _LIBRARIES.get(type(x)) or _library_of(x)
    return library.sin(x), library.cos(x)


def sqrt(x: Scalar) -> Scalar:
    """Return the square root of x, in the type of x."""
    return _library_of(x).sqrt(x)


def exp(x: Scalar) -> Scalar:
    """Return e to the power of x, in the type of x."""
    return _library_of(x).exp(x)


def tanh(x: Scalar) -> Scalar:
    """Return the hyperbolic tangent of x, in the type of x: it does not overflow as exp does."""
    return _library_of(x).tanh(x)


def whole_power(x: Scalar, exponent: Any) -> Scalar:
    """Return x to a whole power, by products, for types that have no power of their own.

    Raises `SimulationError` for other exponents.
    """
    if not isinstance(exponent, Integral):
        raise SimulationError(f"the exponent of a power must be a whole number; got {exponent!r}")
    if exponent < 0:
        return 1 / whole_power(x, -exponent)
    if exponent < 2:
        return x if exponent else x * 0 + 1
    half = whole_power(x, exponent // 2)
    return half * half * x if exponent % 2 else half * half


def sign(x: Scalar) -> Scalar:
    """Return the sign of x as -1, 0 or +1 (NaN for NaN), in the type of x."""
    library = _library_of(x)
    if library is not math:
        return library.sign(x)
    return math.copysign(1.0, x) if abs(x) > 0 else x * 0.0


def times_power_of_two(value: Any, exponent: int) -> Any:
    """Return a real number times a power of two, exactly."""
    if isinstance(value, (int, Fraction)):
        return value * Fraction(2) ** exponent
    # Two factors, as the power may be beyond the range of float64.
    half = exponent // 2
    return value * math.ldexp(1.0, half) * math.ldexp(1.0, exponent - half)
