import math

import numpy as np
import pytest

from tests.ensembles.evaluated import evaluated
from twolink.arithmetic import cos, sin
from twolink.ensembles.terms import Series, convolved, value
from twolink.optional import heyoka

COUNT = 8

X = Series(lambda k: heyoka().expression([0.3, -1.2, 0.5, 0.7][k] if k < 4 else 0.0))
Y = Series(lambda k: heyoka().expression(1 / math.factorial(k)))


def numbers(series, count=COUNT):
    return evaluated(series.terms(count))


def of_function(function, count=COUNT):
    """Return Taylor coefficients at 0 by the values on a small circle."""
    n, radius = 64, 0.5
    points = radius * np.exp(2j * np.pi * np.arange(n) / n)
    found = np.fft.fft(function(points)).real / n
    return (found / radius ** np.arange(n))[:count]


def x(t):
    return 0.3 - 1.2 * t + 0.5 * t**2 + 0.7 * t**3


@pytest.mark.parametrize(
    ("series", "function"),
    [
        (X + Y, lambda t: x(t) + np.exp(t)),
        (2.0 - X, lambda t: 2 - x(t)),
        (X - Y, lambda t: x(t) - np.exp(t)),
        (-(X * 3.0), lambda t: -3 * x(t)),
        (X / 4.0, lambda t: x(t) / 4),
        (X * Y, lambda t: x(t) * np.exp(t)),
        (+(X**3), lambda t: x(t) ** 3),
        (sin(X), lambda t: np.sin(x(t))),
        (cos(2.0 * X + 1.0), lambda t: np.cos(2 * x(t) + 1)),
        (sin(X - Y), lambda t: np.sin(x(t) - np.exp(t))),
    ],
)
def test_the_terms_are_those_of_the_function(series, function):
    expected = of_function(function)
    assert numbers(series) == pytest.approx(expected, abs=1e-12)
    slopes = Series(series.slope)
    assert numbers(slopes, COUNT - 1) == pytest.approx(
        expected[1:] * np.arange(1, COUNT), abs=1e-11
    )


def test_a_product_with_zero_is_a_number():
    assert X * 0 == 0.0
    assert isinstance(X * 0, float)


def test_sine_and_cosine_are_made_once():
    assert sin(X) is sin(X)
    assert cos(X) is X.sine_and_cosine()[1]


def test_other_functions_are_refused():
    for refused in (lambda: X / Y, lambda: 1.0 / X):
        with pytest.raises(TypeError):
            refused()


def test_a_convolution_may_leave_terms_out():
    whole, rest = (convolved(X.term, Y.term, 4, least=least) for least in (0, 2))
    (found,) = evaluated([whole - rest])
    assert found == pytest.approx(0.3 / 24 - 1.2 / 6)


def test_the_value_of_a_polynomial():
    assert value([1.0, -2.0, 3.0], 0.5) == 1 - 1 + 0.75
