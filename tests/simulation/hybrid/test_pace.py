"""The pace of arcs on pressed surfaces, by hand."""

import math

import pytest

from twolink.simulation.hybrid.pace import factors_of_pace, product


@pytest.mark.parametrize(
    ("roots", "pace"),
    [([0.3], 0.3), ([0.3, 0.2], 0.06), ([0.3, 0.2, 0.6], 0.036 / 0.7), ([1e-8] * 6, 1e-16 / 36)],
)
def test_the_pace_is_as_small_as_two_roots(roots, pace):
    assert product(factors_of_pace(roots)) == pytest.approx(pace, rel=1e-14)


def test_the_first_factors_are_the_roots():
    """The rate of a root has the others."""
    assert factors_of_pace([2.0, 3.0, 6.0]) == [2.0, 3.0, 6.0, pytest.approx(1 / 7, rel=1e-15)]
    assert math.prod(factors_of_pace([2.0])) == 2
