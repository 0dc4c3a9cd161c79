"""Quadrature on steps, against exact integrals and NumPy's nodes."""

import math

import numpy as np
import pytest

from twolink.simulation.smooth.quadrature import gauss_nodes, residual_rule


@pytest.mark.parametrize("count", [2, 3, 4, 7])
def test_the_nodes_are_those_of_numpy(count):
    x, _ = np.polynomial.legendre.leggauss(count)
    assert gauss_nodes(count) == pytest.approx((x + 1) / 2, abs=1e-15)


@pytest.mark.parametrize("order", [7, 13, 21, 41])
def test_moments_of_residuals_are_exact(order):
    """∫ (1 − τ)^k/k! τ^j dτ = j!/(j + k + 1)!, for k = 0 as well."""
    rule = residual_rule(order)
    for j in (0, 1, 2, order):
        exact = [math.factorial(j) / math.factorial(j + k + 1) for k in range(9)]
        assert rule.nodes**j @ rule.integral[:, 0] == pytest.approx(exact[0], rel=1e-12)
        assert rule.nodes**j @ rule.firsts.sum(axis=1) == pytest.approx(exact[1], rel=1e-12)
        assert rule.nodes**j @ rule.moments == pytest.approx(exact[2:], rel=1e-12)


@pytest.mark.parametrize("order", [7, 13, 21, 41])
def test_the_parts_of_the_first_moment_serve_for_any_quadratic_factor(order):
    """∫ J(τ) ∫_0^τ s^j ds dτ, for J(τ) = a + b τ + c τ² by its values at Gauss's nodes."""
    rule, factor = residual_rule(order), np.polynomial.Polynomial([0.3, -1.2, 0.7])
    for j in (0, 1, 2, order):
        integrand = factor * np.polynomial.Polynomial([0] * (j + 1) + [1 / (j + 1)])
        found = rule.nodes**j @ rule.firsts @ factor(gauss_nodes(3))
        assert found == pytest.approx(integrand.integ()(1.0), rel=1e-10)


@pytest.mark.parametrize("order", [7, 13, 21, 41])
def test_the_truncated_part_is_that_of_the_highest_power(order):
    rule = residual_rule(order)
    for j in (0, 1, 2):
        assert abs(rule.nodes**j @ rule.integral[:, 1]) < 1e-14
    assert rule.nodes**order @ rule.integral[:, 1] == pytest.approx(1 / (order + 1))


@pytest.mark.parametrize("order", range(7, 26, 2))
def test_the_terms_beside_the_largest_are_integrated_well(order):
    """The third power of the round-off, and the terms of truncation after the first."""
    rule = residual_rule(order)
    weights = rule.integral[:, 0]
    assert abs(1 - 4 * weights @ rule.nodes**3) < 0.1
    assert abs(1 - (order + 2) * weights @ rule.nodes ** (order + 1)) < 0.03
    assert abs(1 - (order + 3) * weights @ rule.nodes ** (order + 2)) < 0.07


@pytest.mark.parametrize("order", range(7, 34, 2))
def test_the_margin_of_the_estimate_serves_for_residuals_of_another_form(order):
    """The estimate has a margin of a quarter: all powers are integrated to a fifth.

    That includes those of a step that is too long, where the terms after τ^p do not decay.
    """
    rule = residual_rule(order)
    for power in range(order + 6):
        assert abs(1 - (power + 1) * rule.integral[:, 0] @ rule.nodes**power) < 0.2


def test_the_round_off_of_values_is_averaged():
    for order in (7, 21, 41):
        rule = residual_rule(order)
        assert rule.integral[:, 0].sum() == pytest.approx(1.0)
        assert 0.5 <= rule.noise < 0.6
