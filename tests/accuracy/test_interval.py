"""Decimal intervals contain all numbers of the balls from which they are made."""

import random
from fractions import Fraction

import flint
import pytest
from flint import arb

from twolink.accuracy import interval as module
from twolink.accuracy.interval import Interval, interval
from twolink.errors import ParameterError


def test_intervals_are_rounded_outwards():
    numbers = random.Random(3)
    with flint.ctx.workprec(200):
        for _ in range(300):
            size = 10.0 ** numbers.uniform(-60, 1)
            ball = arb(numbers.uniform(-20, 20), size / 7)
            bound = arb(size)
            found = interval(ball, bound)
            whole = module._exact(bound) + module._exact(ball.rad())
            middle = module._exact(ball.mid())
            assert middle + whole in found
            assert middle - whole in found
            assert float(found.radius) <= 1.2 * float(whole)


@pytest.mark.parametrize(
    ("number", "inside"), [("0.1", True), (Fraction(1, 8), True), (0.2, False)]
)
def test_numbers_of_any_exact_kind_are_compared(number, inside):
    assert (number in Interval("0.11", "0.02")) is inside


@pytest.mark.parametrize("number", ["a", "1/0", float("nan"), float("inf"), None, [0.1], 1j])
def test_an_interval_is_asked_about_numbers_alone(number):
    wanted = "a number of an interval must be a finite real number, or one in decimal digits; got"
    with pytest.raises(ParameterError, match=wanted):
        number in Interval("0.11", "0.02")  # noqa: B015


def test_an_exact_number_has_no_radius():
    with flint.ctx.workprec(200):
        assert interval(arb(1) / 1024, arb(0)) == Interval("0.0009765625", "0")
