import math
from fractions import Fraction

import flint
import heyoka
import mpmath
import numpy as np
import pytest
import sympy as sp

from twolink import kane, kinematics, lagrange
from twolink.arithmetic import (
    cos,
    exactly,
    exp,
    fraction_in,
    sign,
    sin,
    sine_and_cosine,
    sqrt,
    tanh,
    times_power_of_two,
)
from twolink.chain import Chain
from twolink.effects.gravity import Gravity

CHAIN = Chain((1.3, 0.7), (0.9, 1.4), ((0.35, 0.12), (0.55, -0.21)), (0.11, 0.23))

KINDS = {
    "float": float,
    "numpy float": np.float64,
    "long double": np.longdouble,
    "array": lambda x: np.array([x, 2 * x, -x]),
    "batch of any shape": lambda x: np.full((2, 1, 3), x),
    "mpmath": mpmath.mpf,
    "SymPy": sp.Float,
    "complex": complex,
}


@pytest.mark.parametrize("number", KINDS.values(), ids=KINDS)
@pytest.mark.parametrize("formulation", [kane, lagrange], ids=["kane", "lagrange"])
def test_one_formula_works_in_any_arithmetic(number, formulation):
    """The same function bodies run on every kind of number, and give that kind back."""
    chain = CHAIN.convert(number)
    q, u, du = ((number(a), number(b)) for a, b in ((0.3, -0.4), (1.1, -0.7), (2.0, 0.5)))
    expected_loads = Gravity(9.81).loads(CHAIN, (0.3, -0.4), (1.1, -0.7))
    expected = formulation.inverse_dynamics(
        CHAIN, (0.3, -0.4), (1.1, -0.7), (2.0, 0.5), expected_loads
    )
    # An effect has real numbers; the chain may have arrays and complex ones.
    g = number(9.81)
    loads = Gravity(9.81 if isinstance(g, (np.ndarray, complex)) else g).loads(chain, q, u)
    found = formulation.inverse_dynamics(chain, q, u, du, loads)
    for value, exact in zip(found, expected, strict=True):
        first = np.ravel(value)[0] if isinstance(value, np.ndarray) else value
        assert complex(first) == pytest.approx(exact, rel=1e-13)
    rates = formulation.forward_dynamics(chain, q, u, loads)
    assert type(rates[0]) is type(rates[1])


def test_long_double_keeps_its_digits():
    third = np.longdouble(1) / 3
    assert isinstance(sin(third), np.longdouble)
    with mpmath.workdps(30):
        exact = mpmath.sin(mpmath.mpf(1) / 3)
        assert abs(mpmath.mpf(np.format_float_positional(sin(third), 25)) - exact) < 1e-18


@pytest.mark.parametrize(
    "x", [0.7, np.longdouble("0.7"), mpmath.mpf("0.7"), sp.Rational(7, 10), 0.7 + 0.2j]
)
def test_sine_and_cosine_are_those_of_the_library_of_a_number(x):
    s, c = sine_and_cosine(x)
    assert (s, c) == (sin(x), cos(x))
    assert type(s) is type(sin(x))


def test_mpmath_keeps_its_digits():
    with mpmath.workdps(50):
        assert abs(sin(mpmath.pi / 6) - mpmath.mpf(1) / 2) < mpmath.mpf("1e-49")


def test_balls_have_their_functions_as_methods():
    ball = flint.arb(2)
    for function in (sin, cos, sqrt, exp, tanh):
        found = function(ball)
        assert isinstance(found, flint.arb)
        assert abs(float(found) - getattr(math, function.__name__)(2)) < 1e-15
    with pytest.raises(AttributeError):
        sign(ball)


LONG = Fraction(10**80 + 1, 3 * 10**80)


@pytest.mark.parametrize(
    ("number", "digits"),
    [
        (float, 16),
        (np.longdouble, 19),
        (heyoka.real128, 34),
        (lambda x: heyoka.real(x, 200), 59),
        (mpmath.mpf, 14),
        (flint.arb, 14),
    ],
)
def test_a_fraction_has_the_digits_of_a_type(number, digits):
    for found in (exactly(LONG, number), fraction_in(LONG, 0 * number(1))):
        assert type(found) is type(number(1))
        left = abs(found * number(3 * 10**15) - number(10**15)) / number(10**15)
        assert float(left) < 2 * 10.0**-digits


@pytest.mark.parametrize("kind", [np.float64, np.longdouble])
def test_a_fraction_in_arrays_has_their_type_and_shape(kind):
    found = fraction_in(LONG, np.zeros((2, 3), kind))
    assert found.dtype == kind
    assert found.shape == (2, 3)
    assert np.all(found == kind(1) / kind(3))


def test_a_fraction_is_exact_among_fractions_and_symbols():
    assert fraction_in(LONG, Fraction(0)) == LONG
    assert fraction_in(LONG, sp.Integer(0)) == sp.Rational(LONG.numerator, LONG.denominator)
    assert str(fraction_in(Fraction(1, 4), heyoka.expression(0.0))) == "0.25000000000000000"


def test_functions_of_fractions_are_those_of_floats():
    assert sqrt(Fraction(1, 2)) == math.sqrt(0.5)


@pytest.mark.parametrize("x", [-2.5, 0.0, 3.0, math.inf, -math.inf])
def test_sign(x):
    expected = 0.0 if x == 0 else math.copysign(1.0, x)
    if math.isfinite(x):
        assert sign(x) == expected
        assert float(sign(sp.Float(x))) == expected
    assert sign(np.array([x]))[0] == expected
    assert sign(mpmath.mpf(x)) == expected


def test_sign_of_nan_is_nan():
    assert math.isnan(sign(math.nan))


def test_an_unknown_kind_is_refused():
    with pytest.raises(TypeError, match="must be of a supported number type"):
        cos("0.3")


def test_kinematics_takes_arrays():
    q = (np.linspace(0, 1, 4), np.linspace(1, 2, 4))
    x, y = kinematics.position(CHAIN, q, CHAIN.D)
    assert x.shape == y.shape == (4,)


@pytest.mark.parametrize("value", [3, Fraction(1, 3), 0.1])
@pytest.mark.parametrize("exponent", [-1100, -3, 0, 5, 60])
def test_a_power_of_two_multiplies_exactly(value, exponent):
    found = times_power_of_two(value, exponent)
    exact = Fraction(value) * Fraction(2) ** exponent
    assert found == (exact if not isinstance(value, float) else float(exact))
