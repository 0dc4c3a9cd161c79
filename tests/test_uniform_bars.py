"""The exact moments of inertia of uniform bars."""

from fractions import Fraction

import pytest

from twolink.uniform_bars import are_bars, inertia_of_bar, rounded


def test_the_moment_is_exact_for_numbers_of_float64():
    third = inertia_of_bar(0.1, 2)
    assert third == Fraction(0.1) * 4 / 12
    assert rounded(third) == float(third) != third


@pytest.mark.parametrize(
    ("inertia", "mass", "bars"),
    [
        ((1 / 12, 1 / 12), (1.0, 1.0), True),
        ((1 / 12, 1 / 11), (1.0, 1.0), False),
        ((1 / 12, 1 / 12), (1.0, 2.0), False),
    ],
)
def test_moments_are_those_of_bars_if_mass_length_and_rounding_agree(inertia, mass, bars):
    exact = Fraction(1, 12), Fraction(1, 12)
    assert are_bars(exact, inertia, mass, (1.0, 1.0)) == bars


def test_other_numbers_are_unchanged():
    assert rounded(0.3) == 0.3
    assert rounded("x") == "x"
