"""Bounds of series against mpmath's 50 digits."""

from fractions import Fraction

import flint
import mpmath
import pytest
from flint import arb, arb_series

from twolink.accuracy.series import Series
from twolink.arithmetic import cos, exp, sin, sqrt, tanh
from twolink.errors import SimulationError

RADIUS, TERMS = 0.5, 12

# Each as the same text for both kinds of number.
TEXTS = {
    "sum": lambda x, y: 2 + x - 3 * y - 1,
    "product": lambda x, y: x * y * x * 0.25,
    "sine": lambda x, y: sin(x * 2 + y),
    "cosine": lambda x, y: y * cos(x - y) - (-x),
    "quotient": lambda x, y: (x + y) / (x * x + 3) / 2,
    "reciprocal": lambda x, y: 1 / (y + 4),
    "exponential": lambda x, y: exp(x - 2 * y),
    "root": lambda x, y: sqrt(x * y + 4),
    "hyperbolic tangent": lambda x, y: tanh(x - 2 * y),
    "power": lambda x, y: x**5 - (y + 4) ** -3 + x**0,
    "difference": lambda x, y: 1.5 - sin(y) * 4,
}
X, Y = [0.3, -1.25, 0.5, 2.0], [1.0, 0.75, -0.125]


def series(coefficients):
    norm = sum(abs(c) * RADIUS**power for power, c in enumerate(coefficients))
    return Series(arb_series(coefficients, TERMS), arb(norm))


def true_coefficients(text, count):
    with mpmath.workdps(50):
        return mpmath.taylor(
            lambda t: text(mpmath.polyval(X[::-1], t), mpmath.polyval(Y[::-1], t)), 0, count
        )


@pytest.fixture(autouse=True)
def precision():
    cap = flint.ctx.cap
    with flint.ctx.workprec(120):
        flint.ctx.cap = TERMS
        yield
        flint.ctx.cap = cap


@pytest.mark.parametrize("name", TEXTS)
def test_terms_are_right_and_norms_are_bounds(name):
    text = TEXTS[name]
    found = text(series(X), series(Y))
    true = true_coefficients(text, 40)
    for index in range(TERMS):
        within = arb(mpmath.nstr(true[index], 45), 1e-25)
        assert within.contains(found.terms[index].mid())
        assert found.terms[index].rad() < 1e-25
    norm = float(found.norm)
    assert sum(abs(c) * RADIUS**power for power, c in enumerate(true)) <= norm * (1 + 1e-12)
    # The truncated terms, at a time within the disc, are below the bound of the norm.
    h = RADIUS / 2
    tail = abs(sum(c * h**power for power, c in enumerate(true) if power >= TERMS))
    assert tail <= norm * 0.5**TERMS


def test_the_norm_of_a_sum_whose_first_terms_cancel_is_that_of_the_rest():
    """The elbow of a chain that has turned often is a small difference of large angles."""
    x, y = series([628.5, *X[1:]]), series([628.25, *Y[1:]])
    rest = float(series([0.0, *X[1:]]).norm + series([0.0, *Y[1:]]).norm)
    for found in (x - y, x + -y, -(y - x)):
        assert float(found.norm) == pytest.approx(0.25 + rest, rel=1e-12)
    assert float((x - 628).norm) == pytest.approx(0.5 + float(series([0.0, *X[1:]]).norm))


def test_two_terms_are_a_value_and_its_derivative():
    x = Series(arb_series([0.7, 1], 2), arb(0.7))
    found = sin(x * x) / x
    for index, true in enumerate(mpmath.taylor(lambda t: mpmath.sin(t * t) / t, 0.7, 1)):
        assert float(found.terms[index]) == pytest.approx(float(true), rel=1e-14)


def test_a_divisor_that_may_vanish_on_the_disc_has_no_bound():
    """1/(1 − 4t) is endless at t = 1/4, which the disc of 1/2 contains; its terms are there."""
    found = 1 / series([1.0, -4.0])
    assert not found.norm.is_finite()
    assert float(found.terms[3]) == 64.0


def test_a_root_that_may_vanish_on_the_disc_has_no_bound():
    found = sqrt(series([1.0, -4.0]))
    assert not found.norm.is_finite()
    assert float(found.terms[1]) == -2.0


def test_fractions_are_exact():
    x, third = series(X), Fraction(1, 3)
    for found, exact in (
        (x + third, X[0] + arb(1) / 3),
        (third - x, arb(1) / 3 - X[0]),
        (third * x, X[0] * arb(1) / 3),
        (x / third, X[0] * arb(3)),
        (third / x, arb(1) / 3 / X[0]),
    ):
        assert found.terms[0].overlaps(exact)
        assert found.terms[0].rad() < 1e-30


def test_other_powers_are_refused_in_one_sentence():
    with pytest.raises(SimulationError, match=r"exponent of a power must be a whole number; got 0"):
        series(X) ** 0.5


@pytest.mark.parametrize("first", [arb(0), arb(0, 1), arb(0.5, 1)])
@pytest.mark.parametrize("operation", [lambda x: 1 / x, lambda x: series([1.0, 2.0]) / x, sqrt])
def test_a_result_that_may_not_exist_is_nan(operation, first):
    """python-flint would raise an error: a bound that is not known is no fault."""
    found = operation(Series(arb_series([first, 1], TERMS), arb(2)))
    assert all(found.terms[k].is_nan() for k in range(TERMS))
    assert not found.norm.is_finite()
