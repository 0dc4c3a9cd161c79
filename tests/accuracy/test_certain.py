"""Comparisons of balls hold for all of their numbers, or for none, or are refused."""

import math
import operator
from fractions import Fraction

import pytest
from flint import arb

from twolink import arithmetic
from twolink.accuracy.certain import Certain, UndecidedError

ONE, WIDE, TWO = Certain(arb(1)), Certain(arb(1.5, 0.75)), Certain(arb(2.5, 0.125))
ORDERS = [operator.lt, operator.le, operator.gt, operator.ge, operator.eq, operator.ne]


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("pair", [(ONE, TWO), (TWO, ONE), (ONE, 1), (ONE, 0.5), (TWO, 3)])
def test_a_proven_comparison_is_that_of_the_midpoints(order, pair):
    middles = [float(x.ball.mid()) if isinstance(x, Certain) else x for x in pair]
    assert order(*pair) is order(*middles)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize(
    "pair", [(WIDE, 1), (TWO, WIDE + 0.5), (WIDE, WIDE), (Certain(arb("nan")), 1)]
)
def test_a_comparison_of_overlapping_balls_is_refused(order, pair):
    with pytest.raises(UndecidedError, match="too wide for a comparison"):
        order(*pair)


@pytest.mark.parametrize(
    "formula",
    [
        lambda x, y: x + y - 2 * x,
        lambda x, y: 3 - x / y + 2 / x,
        lambda x, y: (1 + x) * (y * 2) / 4 - (-y),
        lambda x, y: abs(x - y) + arithmetic.sin(x) * arithmetic.cos(y),
        lambda x, y: x**3 - (+y) ** -1 + x * Fraction(1, 3) - Fraction(1, 3) / y,
        lambda x, y: arithmetic.sqrt(x) + arithmetic.exp(y),
        lambda x, y: arithmetic.tanh(x * y),
    ],
)
def test_formulas_contain_those_of_their_numbers(formula):
    x, y = Certain(arb(1.25, 1e-3)), Certain(arb(2.5, 1e-3))
    found = formula(x, y)
    for side in (-1, 0, 1):
        assert found.ball.contains(arb(formula(1.25 + side * 0.9e-3, 2.5 - side * 0.9e-3)))
    assert float(found.ball.rad()) < 0.05


def test_a_comparison_with_a_possibly_undefined_root_or_quotient_is_refused():
    for number in (arithmetic.sqrt(Certain(arb(0, 1))), 1 / Certain(arb(0, 1))):
        assert math.isnan(float(number.ball))
        with pytest.raises(UndecidedError):
            assert number > 0
