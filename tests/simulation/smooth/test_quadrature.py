"""Gauss's quadrature in all precisions, against the exact integrals of powers."""

import math

import numpy as np
import pytest

from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth.quadrature import gauss_rule


@pytest.mark.parametrize("precision", PRECISIONS)
def test_the_rule_integrates_polynomials(precision):
    own = PRECISIONS[precision]
    one = own.number(1)
    for count in (2, 6, 8):
        rule = gauss_rule(count, precision)
        for k in range(2 * count):
            missed = np.add.reduce(rule.weights * rule.nodes**k) - one / (k + 1)
            assert abs(float(missed)) <= 4 * own.rounding


def test_the_nodes_are_those_of_numpy():
    x, weights = np.polynomial.legendre.leggauss(7)
    rule = gauss_rule(7, "double")
    assert rule.nodes == pytest.approx((x + 1) / 2, abs=1e-15)
    assert rule.weights == pytest.approx(weights / 2, abs=1e-15)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_moments_weigh_with_the_rest_of_the_interval(precision):
    """∫ (1 − τ)^k/k! τ^m dτ = m!/(m + k + 1)!."""
    rule = gauss_rule(8, precision)
    nodes = PRECISIONS["quadruple"].mixable(rule.nodes).astype(float)
    for m in range(7):
        exact = [math.factorial(m) / math.factorial(m + k + 1) for k in range(1, 9)]
        assert nodes**m @ rule.moments == pytest.approx(exact)


def test_the_error_of_a_rule_with_too_few_nodes_is_known(random):
    rule = gauss_rule(2, "double")
    coefficients = random.normal(size=9)
    slopes = np.polynomial.polynomial.polyval(
        rule.nodes, np.polynomial.polynomial.polyder(coefficients)
    )
    missed = rule.weights @ slopes - coefficients[1:].sum()
    assert coefficients @ rule.errors_of_slopes(9) == pytest.approx(missed)
    assert not gauss_rule(8, "double").errors_of_slopes(9).any()
