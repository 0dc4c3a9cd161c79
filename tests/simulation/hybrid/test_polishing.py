"""Polished roots and lowest places of polynomials in closed form."""

import math
from fractions import Fraction

import pytest

from tests.simulation.hybrid.polynomials import as_floats, expanded
from twolink.simulation.hybrid.polishing import lowest, polished


def test_polishing_stays_inside_the_bracket():
    """Newton's method from the middle would leave it at once: there the slope is nearly zero."""
    c = as_floats(expanded([Fraction(99, 100), -1], [Fraction(1, 2), -1, 1], [1, 0]))
    x = polished(c, 0.0, 1.0)
    assert x == pytest.approx(0.99, rel=1e-13)


def test_polishing_starts_from_the_lower_end_without_positive_values():
    assert polished([-1.0, -1.0], 0.25, 0.5) == 0.25


def test_polishing_finds_roots_of_very_flat_polynomials():
    c = [1e-30, -1.0] + [0.0] * 15 + [-1e-3]
    assert polished(c, 0.0, 1.0) == pytest.approx(1e-30, rel=1e-14)


@pytest.mark.parametrize("near", [None, 0.29, 0.9, 0.0, 5.0])
def test_a_polished_root_does_not_depend_on_the_first_guess(near):
    """1 − 3 x − x²: at (√13 − 3)/2; places outside the bracket are of no use."""
    root = polished([1.0, -3.0, -1.0], 0.0, 1.0, near)
    assert root == pytest.approx((math.sqrt(13) - 3) / 2, rel=4e-16)


@pytest.mark.parametrize(
    ("coefficients", "place"),
    [
        ((0.25 + 1e-3, -1, 1), 0.5),
        # Not below the limit, and lowest at one end or at the other.
        ((0.25 + 3e-3, -1, 1), None),
        ((1e-3, 1, 1), None),
        ((1e-3 + 1, -1, 0), None),
        # Highest inside.
        ((0, 1, -1), None),
    ],
)
def test_the_lowest_place_is_a_minimum_inside_that_is_low_enough(coefficients, place):
    assert lowest(coefficients, 2e-3) == (place and pytest.approx(place))
