"""Jets against the derivatives that mpmath finds in eighty digits."""

import math
from contextlib import suppress
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from twolink import arithmetic
from twolink.simulation.hybrid import jet
from twolink.simulation.hybrid.jet import Jet, Recording, constant, leading_term

LENGTH = 7

F = (3, -1, 2, 0, 1, -2, 5)
G = (2, 1, -3, 4, 0, 1, -1)


def polynomial(terms):
    """Return the polynomial with these coefficients as a function of mpmath's numbers."""
    return lambda t: mpmath.polyval(
        [mpmath.mpf(c.numerator) / c.denominator for c in terms][::-1], t
    )


def exact(terms):
    return Jet(tuple(Fraction(c) for c in terms))


def floats(terms):
    return Jet(tuple(float(c) for c in terms))


def taylor(function):
    """Return the Taylor coefficients of a function at 0."""
    with mpmath.workdps(80):
        return mpmath.taylor(function, 0, LENGTH - 1)


def differences(exactly, expected):
    with mpmath.workdps(60):
        return [
            abs(mpmath.mpf(c.numerator) / c.denominator - e)
            for c, e in zip(exactly, expected, strict=True)
        ]


@pytest.mark.parametrize(
    "formula",
    [
        lambda f, g: f + g,
        lambda f, g: f - g,
        lambda f, g: f * g,
        lambda f, g: f / g,
        lambda f, g: -f + 2 - g * 3,
        lambda f, g: 5 - f,
        lambda f, g: 1 / f + f / 4,
        lambda f, g: f**3,
        lambda f, g: f**0 + g**1,
        lambda f, g: g**-2,
        lambda f, g: (f * g + 1) / (f * f + 2),
    ],
)
def test_arithmetic_gives_exactly_the_taylor_coefficients(formula):
    found = formula(exact(F), exact(G))
    f, g = polynomial(F), polynomial(G)
    expected = taylor(lambda t: formula(f(t), g(t)))
    assert max(differences(found.terms, expected)) < 1e-25


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        (arithmetic.sin, mpmath.sin),
        (arithmetic.cos, mpmath.cos),
        (arithmetic.exp, mpmath.exp),
        (arithmetic.sqrt, mpmath.sqrt),
        (arithmetic.tanh, mpmath.tanh),
        (lambda f: f**1.5, lambda f: f ** mpmath.mpf(1.5)),
        (lambda f: f ** (-0.25), lambda f: f ** mpmath.mpf(-0.25)),
    ],
    ids=["sin", "cos", "exp", "sqrt", "tanh", "power 3/2", "power -1/4"],
)
@pytest.mark.parametrize("terms", [F, G])
def test_functions_give_the_taylor_coefficients(ours, theirs, terms):
    """The library's own functions find those of jets, as of any kind of number."""
    scaled = [Fraction(c, 4 * math.factorial(k)) for k, c in enumerate(terms)]
    found = ours(floats(scaled))
    f = polynomial(scaled)
    expected = [float(c) for c in taylor(lambda t: theirs(f(t)))]
    assert found.terms == pytest.approx(expected, rel=1e-13, abs=1e-14)


def test_numpys_numbers_leave_arithmetic_to_the_jet():
    f = floats(F)
    for found in (np.float64(2) * f, np.longdouble(2) * f):
        assert isinstance(found, Jet)
        assert [float(c) for c in found.terms] == [2.0 * c for c in F]
    assert (np.float64(2) - f).terms == (2 - f).terms
    assert (np.float64(2) / f).terms == (2 / f).terms


def test_long_doubles_stay_long_doubles():
    third = np.longdouble(1) / 3
    found = arithmetic.sin(Jet((third, third, 0 * third)))
    assert all(isinstance(c, np.longdouble) for c in found.terms)
    # The derivative of sin at 1/3 times 1/3, in more digits than a float64 has.
    with mpmath.workdps(30):
        expected = mpmath.cos(mpmath.mpf(1) / 3) / 3
        assert abs(mpmath.mpf(str(found.terms[1])) - expected) < 3e-19


def test_a_constant_has_no_slope():
    assert constant(Fraction(2, 3), 4).terms == [Fraction(2, 3), 0, 0, 0]


def test_the_size_of_a_jet_is_that_of_the_time_just_after_zero():
    assert abs(Jet((0, 0, -2, 7))).terms == [0, 0, 2, -7]
    assert abs(Jet((0, 3, -2, 7))).terms == [0, 3, -2, 7]
    assert arithmetic.sign(Jet((0.0, 0.0, -2.0))).terms == [-1.0, 0.0, 0.0]
    assert arithmetic.sign(Jet((0.0, 0.0, 0.0))).terms == [0.0, 0.0, 0.0]


def test_the_root_of_no_jet_at_all_is_zero():
    assert jet.sqrt(Jet((0.0, 0.0, 0.0))).terms == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("terms", "noise", "rate", "expected"),
    [
        ((0, 0, -3), 0, 1, -1),
        ((1e-9, -1.0), 0, 1, 1),
        ((1e-9, -1.0), 1e-8, 1, -1),
        ((1e-9, 5.0, -1.0), 1e-8, 1e9, 0),
        ((-1e-9, 50.0), 1e-8, 1e9, 1),
        ((0, 0, 0), 0, 1, 0),
    ],
)
def test_the_sign_of_the_leading_term_is_that_of_the_first_term_beyond_rounding(
    terms, noise, rate, expected
):
    """The k-th term counts if it is above noise · rate^k."""
    assert leading_term(terms, noise, rate)[1] == expected


@pytest.mark.parametrize(
    "formula",
    [
        lambda f, g: -f + 2 - g * 3 + (f - g) / 4,
        lambda f, g: f * g / (f * f + 2) - 1 / g,
        lambda f, g: f**3 + f**0 + f**1.5,
        lambda f, g: arithmetic.sin(f) * arithmetic.cos(f) + arithmetic.cos(g),
        lambda f, g: arithmetic.exp(g) + arithmetic.sqrt(f),
        lambda f, g: abs(-f) + abs(f * 1),
    ],
)
def test_a_recorded_formula_gets_its_coefficients_one_by_one(formula):
    """It is evaluated once, with the first coefficients only."""
    terms = [[c / math.factorial(k) for k, c in enumerate(every)] for every in (F, G)]
    recording = Recording()
    f, g = (Jet((own[0],), recording) for own in terms)
    found = formula(f, g)
    for k in range(1, LENGTH):
        f.terms.append(terms[0][k])
        g.terms.append(terms[1][k])
        recording.extend()
    assert found.terms == formula(*(Jet(tuple(own)) for own in terms)).terms
    assert len(found.terms) == LENGTH


def test_a_branch_leaves_the_recording_as_it_was():
    """Also where it ends in an error."""
    recording = Recording()
    f = Jet((0.5,), recording)
    sine = arithmetic.sin(f)
    found = []
    for slope in (1.0, 2.0):
        with suppress(ZeroDivisionError), recording.branch():
            product = arithmetic.cos(f) * sine
            f.terms.append(slope)
            recording.extend()
            found.append(product.terms[1])
            if slope == 2.0:
                product / 0
        f.forget()
        assert (sine.terms, arithmetic.cos(f).terms) == ([math.sin(0.5)], [math.cos(0.5)])
        assert len(recording) == 1
    assert found == pytest.approx([math.cos(1.0), 2 * math.cos(1.0)])


def test_an_operation_is_recorded_once_and_not_at_all_with_0_or_1():
    recording = Recording()
    f, g = Jet((2.0,), recording), Jet((3.0,), recording)
    assert f * g is f * g
    assert f * g is not f / g
    assert arithmetic.sin(f) is arithmetic.sin(f)
    assert f * 1 is f + 0 is f / 1 is f
    assert f * 0 == 0
    assert 0 / f == 0
