"""First roots against mpmath's roots, Sturm's counts, and polynomials of known roots."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from twolink.simulation.hybrid.roots import (
    are_positive,
    bernstein_matrix,
    first_fall,
    polished,
    rounding_bounds,
)
from twolink.simulation.smooth.taylor import number_type, rounding

EPSILON = 2.0**-52


def bound_of(coefficients, precision="double"):
    row = np.array([coefficients])
    return float(rounding_bounds(row, rounding(precision))[0])


def fall(coefficients):
    return first_fall(coefficients, bound_of(coefficients))


def product(*factors):
    """Return the coefficients of a product of polynomials, each rounded once."""
    total = [Fraction(1)]
    for factor in factors:
        grown = [Fraction(0)] * (len(total) + len(factor) - 1)
        for i, a in enumerate(total):
            for j, b in enumerate(factor):
                grown[i + j] += a * Fraction(b)
        total = grown
    return total


def as_floats(coefficients):
    return [float(c) for c in coefficients]


def series_like(random, count):
    """Return coefficients that shrink as those of a step that goes to rounding."""
    return list(random.normal(size=count) * np.exp(-1.7 * np.arange(count)))


def in_mpmath(number):
    return mpmath.mpf(number) if isinstance(number, float) else mpmath.mpf(str(number))


def exact_root(coefficients, near):
    """Return the root of a polynomial near a place, in the digits that mpmath works with."""
    high_first = [in_mpmath(c) for c in reversed(coefficients)]
    return mpmath.findroot(lambda x: mpmath.polyval(high_first, x), mpmath.mpf(near))


def real_roots(coefficients):
    """Return the real roots in [0, 1] that NumPy finds."""
    roots = np.roots(coefficients[::-1])
    real = roots.real[abs(roots.imag) < 1e-6]
    return sorted(real[(real > -1e-6) & (real < 1 + 1e-6)])


# The Bernstein form.


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


# The proof that there is no root.


@settings(max_examples=300)
@given(
    st.floats(0, 1),
    st.lists(st.floats(-1e3, 1e3, allow_subnormal=False), min_size=1, max_size=18),
)
def test_no_polynomial_with_a_root_is_proven_positive(root, others):
    exactly = product([-Fraction(root), 1], others)
    coefficients = np.array([as_floats(exactly)])
    assert not are_positive(coefficients, EPSILON)[0]
    assert not are_positive(-coefficients, EPSILON)[0]


def test_polynomials_that_are_well_above_zero_are_proven_positive(random):
    rows = np.array([series_like(random, 20) for _ in range(200)])
    values = np.array([np.polyval(row[::-1], np.linspace(0, 1, 101)) for row in rows])
    rows[:, 0] += 0.5 - values.min(axis=1)
    assert are_positive(rows, EPSILON).all()


def test_each_polynomial_is_judged_for_itself():
    rows = np.array([[1.0, 1.0, 0, 0], [1.0, -2.0, 0, 0], [0.5, -1.5, 1.0, 0]])
    rows = np.hstack([rows, np.zeros((3, 2))])
    assert are_positive(rows, EPSILON).tolist() == [True, False, False]


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


# Simple roots.


def test_simple_roots_are_found_to_the_last_bits(random):
    falls = 0
    for _ in range(600):
        c = series_like(random, 20)
        c[0] = abs(c[0])
        roots, root = real_roots(c), fall(c)
        if not roots:
            assert root is None
            continue
        slope = np.polyval(np.polyder(c[::-1]), roots[0])
        if slope > -1e-3 or roots[0] > 1 - 1e-3:
            continue
        falls += 1
        assert not root.touches
        with mpmath.workdps(50):
            truth = exact_root(c, roots[0])
            miss = abs(float(root.x - truth))
        # The value is known within a few roundings of its terms.
        size = sum(abs(a) * float(truth) ** k for k, a in enumerate(c))
        assert miss <= 4 * EPSILON * (size / abs(slope) + float(truth))
    assert falls > 40


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_roots_are_found_in_long_numbers(precision, random):
    number = number_type(precision)
    with mpmath.workdps(80):
        for _ in range(5):
            place = Fraction(int(random.integers(1, 10**6)), 10**6)
            factors = [[place, -1], [1, Fraction(1, 3), Fraction(1, 7)], [2, Fraction(-1, 9)]]
            c = [number(f.numerator) / number(f.denominator) for f in product(*factors)]
            truth = exact_root(c, float(place))
            root = first_fall(c, 16 * rounding(precision))
            assert isinstance(root.x, number)
            assert abs(in_mpmath(root.x) - truth) < 8 * rounding(precision)


def test_the_first_of_several_falls_is_taken():
    """Falls at 0.2 and 0.7, a rise at 0.5."""
    c = as_floats(
        product([Fraction(1, 5), -1], [Fraction(1, 2), -1], [Fraction(7, 10), -1], [1, 0, 0])
    )
    root = fall(c)
    assert not root.touches
    assert root.x == pytest.approx(0.2, rel=1e-14)


@pytest.mark.parametrize("flight", [1e-3, 1e-7, 1e-11, 1e-15])
def test_a_flight_of_a_tiny_part_of_the_step_is_found_to_its_last_bits(flight):
    """A gap x (flight − x)(…), divided by x."""
    gap = as_floats(product([0, 1], [Fraction(flight), -1], [1, Fraction(3, 10), Fraction(-1, 5)]))
    root = first_fall(gap[1:], 0.0)
    assert not root.touches
    assert root.x == pytest.approx(flight, rel=4 * EPSILON)


def test_a_dip_of_a_tiny_part_of_the_step_is_found():
    """Negative between 0.4 and 0.4 + 1e-5 only."""
    beyond = Fraction(2, 5) + Fraction(1, 10**5)
    c = as_floats(product([Fraction(2, 5), -1], [beyond, -1], [1, 0, 0]))
    root = fall(c)
    assert not root.touches
    assert root.x == pytest.approx(0.4, abs=1e-10)


def test_no_root_is_seen_beyond_the_step():
    assert fall([1.0, -0.999, 0.0, 0.0]) is None
    assert fall([1.0, -1.5, 0.5000001, 0.0, 0.0]) is None


def test_roots_at_the_end_of_the_step_are_seen():
    assert fall([1.0, -1.0, 0.0, 0.0]).x == pytest.approx(1.0, abs=1e-14)


# Touches.


@pytest.mark.parametrize("place", [Fraction(1, 7), Fraction(2, 5), Fraction(9, 10)])
def test_a_double_root_is_a_touch(place):
    c = as_floats(product([place, -1], [place, -1], [1, Fraction(1, 3)], [1, 0, 0]))
    root = fall(c)
    assert root.touches
    # A value within ε is as far from the root as √ε.
    assert root.x == pytest.approx(float(place), abs=1e-6)


def test_a_double_root_is_told_apart_from_two_and_from_none_outside_the_bound():
    square = product([Fraction(2, 5), -1], [Fraction(2, 5), -1], [1, 0, 0])
    for lift, touches in [(1e-11, None), (1e-17, True), (-1e-17, True), (-1e-11, False)]:
        lifted = [float(square[0] + Fraction(lift)), *as_floats(square[1:])]
        root = fall(lifted)
        assert (root.touches if root else None) is touches
        if touches is False:
            assert root.x == pytest.approx(0.4 - math.sqrt(1e-11), abs=1e-9)


def test_a_triple_root_is_a_fall():
    c = as_floats(product(*[[Fraction(2, 5), -1]] * 3, [1, 0, 0]))
    root = fall(c)
    assert not root.touches
    # Within the cube root of the bound.
    assert root.x == pytest.approx(0.4, abs=1e-4)


@settings(max_examples=200)
@given(st.lists(st.integers(-6, 6), min_size=2, max_size=6))
def test_falls_and_touches_are_those_that_sturm_counts(coefficients):
    """Sturm's theorem and the multiplicity of the first root, in whole numbers."""
    assume(coefficients[0] > 0)
    assume(any(coefficients[1:]))
    polynomial = sympy.Poly(coefficients[::-1], sympy.Symbol("x"), domain="QQ")
    inside = polynomial.intervals(inf=0, sup=1, eps=sympy.Rational(1, 10**9))
    bound = 64 * EPSILON * sum(map(abs, coefficients))
    root = first_fall([float(c) for c in coefficients], bound)
    if not inside:
        assert root is None
        return
    (low, high), multiplicity = inside[0]
    assert root is not None
    slack = 1e-8 if multiplicity == 1 else bound ** (1 / multiplicity) * 10
    assert float(low) - slack <= root.x <= float(high) + slack
    if low < 1:
        assert root.touches == (multiplicity % 2 == 0)


# Polishing.


def test_polishing_stays_inside_the_bracket():
    """Newton's method from the middle would leave it at once: there the slope is nearly zero."""
    c = as_floats(product([Fraction(99, 100), -1], [Fraction(1, 2), -1, 1], [1, 0]))
    x = polished(c, 0.0, 1.0)
    assert x == pytest.approx(0.99, rel=1e-13)


def test_polishing_starts_from_the_lower_end_where_nothing_is_positive():
    assert polished([-1.0, -1.0], 0.25, 0.5) == 0.25


def test_polishing_finds_roots_of_very_flat_polynomials():
    c = [1e-30, -1.0] + [0.0] * 15 + [-1e-3]
    assert polished(c, 0.0, 1.0) == pytest.approx(1e-30, rel=1e-14)
