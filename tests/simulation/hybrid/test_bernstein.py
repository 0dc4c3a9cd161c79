"""Bounds by Bernstein coefficients, against exact values and polynomials of known roots."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from tests.simulation.hybrid.polynomials import EPSILON, as_floats, bound_of, expanded, series_like
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid.bernstein import (
    bernstein_matrix,
    is_positive_until,
    margins_of,
    product,
)


def are_positive(coefficients):
    margins, _, _ = margins_of(coefficients, EPSILON)
    return margins > 0


@pytest.mark.parametrize("length", [1, 2, 5, 20, 24])
def test_bernstein_coefficients_give_the_polynomial(length, random):
    """Σ b_j B_j(x) is Σ c_k x^k, at as many places as the degree has and one more."""
    c = random.normal(size=length)
    b, degree = c @ bernstein_matrix(length), length - 1
    for x in np.linspace(0, 1, length + 1):
        basis = [math.comb(degree, j) * x**j * (1 - x) ** (degree - j) for j in range(length)]
        assert b @ basis == pytest.approx(np.polyval(c[::-1], x), rel=1e-13, abs=1e-13)


def test_bernstein_coefficients_at_the_ends_are_the_values_there(random):
    c = random.normal(size=12)
    b = c @ bernstein_matrix(12)
    assert b[0] == c[0]
    assert b[-1] == pytest.approx(c.sum(), rel=1e-14)


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_products_and_matrices_have_the_digits_of_their_numbers(precision):
    """(1 + x)⁴ has the Bernstein coefficients 1, 2, 4, 8 and 16."""
    number = PRECISIONS[precision].number
    matrix = bernstein_matrix(5, number)
    found = product(matrix.T, np.array([number(math.comb(4, k)) for k in range(5)]))
    for j, value in enumerate(found.tolist()):
        assert abs(float(value - number(2**j))) <= 16 * PRECISIONS[precision].rounding * 2**j


@pytest.mark.slow
@settings(max_examples=300)
@given(
    st.floats(0, 1),
    st.lists(st.floats(-1e3, 1e3, allow_subnormal=False), min_size=1, max_size=18),
)
def test_no_polynomial_with_a_root_is_proven_positive(root, others):
    exactly = expanded([-Fraction(root), 1], others)
    coefficients = np.array([as_floats(exactly)])
    assert not are_positive(coefficients)[0]
    assert not are_positive(-coefficients)[0]


def test_polynomials_that_are_well_above_zero_are_proven_positive(random):
    rows = np.array([series_like(random, 20) for _ in range(200)])
    values = np.array([np.polyval(row[::-1], np.linspace(0, 1, 101)) for row in rows])
    rows[:, 0] += 0.5 - values.min(axis=1)
    assert are_positive(rows).all()


def test_each_polynomial_is_judged_for_itself():
    rows = np.array([[1.0, 1.0, 0, 0], [1.0, -2.0, 0, 0], [0.5, -1.5, 1.0, 0]])
    rows = np.hstack([rows, np.zeros((3, 2))])
    assert are_positive(rows).tolist() == [True, False, False]


def test_the_bound_covers_the_rounding_of_the_values(random):
    """Values in float64 differ from exact ones by no more than the bound."""
    for _ in range(50):
        c = series_like(random, 20)
        bound = bound_of(c)
        for x in random.uniform(size=5):
            exact = sum(Fraction(a) * Fraction(x) ** k for k, a in enumerate(c))
            assert abs(Fraction(np.polyval(c[::-1], x)) - exact) <= bound


def test_the_bound_covers_the_terms_that_a_step_cuts_off():
    """The last two terms are of the order of those that a series goes on with."""
    assert bound_of([1.0, 0.0, 0.0, 1e-3, -2e-3]) >= 3e-3


def test_the_margin_of_a_polynomial_is_a_bound_on_its_minimum(random):
    rows = np.array([series_like(random, 12) for _ in range(50)])
    margins, bernstein, bounds = margins_of(rows, EPSILON)
    assert bounds == pytest.approx([bound_of(row) for row in rows], rel=1e-14)
    values = [Polynomial(row)(np.linspace(0, 1, 101)).min() for row in rows]
    assert (margins <= values).all()
    assert (margins <= bernstein.min(axis=1)).all()


@pytest.mark.parametrize("number", [float, np.longdouble], ids=("double", "long double"))
def test_a_polynomial_is_proven_positive_before_its_first_root(number):
    for seed in range(200):
        random = np.random.default_rng(seed)
        first = random.uniform(0.1, 0.9)
        others = [(-x, 1) for x in random.uniform(first, 2, size=3)]
        coefficients = [number(c) for c in expanded((first, -1), *others, others[0])]
        sign = 1 if coefficients[0] > 0 else -1
        polynomial = [sign * c for c in coefficients]
        bound = 1e-13
        assert not is_positive_until(polynomial, first * (1 + 1e-9), bound), seed
        assert not is_positive_until(polynomial, 1.0, bound), seed
        if is_positive_until(polynomial, 0.9 * first, bound):
            assert min(as_floats(np.polyval(polynomial[::-1], np.linspace(0, 0.9 * first, 99)))) > 0
        assert is_positive_until(polynomial, 1e-3 * first, bound), seed
        assert not is_positive_until(polynomial, 1e-3 * first, bound, float(polynomial[0])), seed


def test_a_touch_before_the_end_is_not_proven_positive():
    touching = expanded((Fraction(1, 4), -1), (Fraction(1, 4), -1), (2, -1))
    assert is_positive_until(as_floats(touching), 0.2, 1e-13)
    assert not is_positive_until(as_floats(touching), 0.5, 1e-13)
