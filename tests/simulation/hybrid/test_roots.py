"""First roots against mpmath's roots, Sturm's counts, and polynomials of known roots."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.polynomial import Chebyshev, Polynomial

from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid import roots
from twolink.simulation.hybrid.roots import (
    bernstein_matrix,
    first_fall,
    is_positive_until,
    lowest,
    margins_of,
    polished,
    product,
    rounding_bound,
)
from twolink.simulation.hybrid.tolerances import POLYNOMIAL

EPSILON = 2.0**-52


def bound_of(coefficients, precision="double"):
    return rounding_bound(coefficients, PRECISIONS[precision].rounding)


def are_positive(coefficients):
    margins, _, _ = margins_of(coefficients, EPSILON)
    return margins > 0


def fall(coefficients):
    return first_fall(coefficients, bound_of(coefficients))


def expanded(*factors):
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


# Simple roots.


def test_simple_roots_are_found_to_the_last_bits(random):
    falls = 0
    for _ in range(600):
        c = series_like(random, 20)
        c[0] = abs(c[0])
        roots, found = real_roots(c), fall(c)
        if not roots:
            assert found.fall is None
            continue
        slope = np.polyval(np.polyder(c[::-1]), roots[0])
        if slope > -1e-3 or roots[0] > 1 - 1e-3:
            continue
        falls += 1
        assert found.touch is None
        with mpmath.workdps(50):
            truth = exact_root(c, roots[0])
            miss = abs(float(found.fall - truth))
        # The value is known within a few roundings of its terms.
        size = sum(abs(a) * float(truth) ** k for k, a in enumerate(c))
        assert miss <= 4 * EPSILON * (size / abs(slope) + float(truth))
    assert falls > 40


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_roots_are_found_in_long_numbers(precision, random):
    number = PRECISIONS[precision].number
    with mpmath.workdps(80):
        for _ in range(5):
            place = Fraction(int(random.integers(1, 10**6)), 10**6)
            factors = [[place, -1], [1, Fraction(1, 3), Fraction(1, 7)], [2, Fraction(-1, 9)]]
            c = [number(f.numerator) / number(f.denominator) for f in expanded(*factors)]
            truth = exact_root(c, float(place))
            root = first_fall(c, 16 * PRECISIONS[precision].rounding).fall
            assert isinstance(root, number)
            assert abs(in_mpmath(root) - truth) < 8 * PRECISIONS[precision].rounding


def long_polynomials(random, number):
    """Yield polynomials of known kinds in longer numbers: series, tiny starts, and near touches."""
    for _ in range(60):
        series = series_like(random, 16)
        start = 10.0 ** -random.integers(0, 30)
        yield [number(c) for c in [abs(series[0]) * start, *series[1:]]]
        yield [number(c) for c in [start, 0.0, -abs(series[2]), *series[3:]]]
    for gap in (1e-6, 1e-9, 1e-15, 1e-17, 1e-20, 1e-25):
        place = Fraction(int(random.integers(2, 9)), 10)
        squared = [place**2, -2 * place, Fraction(1)]
        for sign in (1, -1):
            raised = [squared[0] + sign * Fraction(gap), *squared[1:]]
            for factor in ([1, Fraction(1, 3)], [Fraction(19, 20), -1]):
                yield [number(f.numerator) / number(f.denominator)
                       for f in expanded(raised, factor)]  # fmt: skip


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_the_search_in_float64_decides_as_the_one_in_long_numbers(precision, random, monkeypatch):
    """It decides most polynomials, and leaves those that are close to a touch."""
    own = PRECISIONS[precision]
    left = 0
    given = list(long_polynomials(random, own.number))
    for c in given:
        bound = bound_of([*c, own.number(0), own.number(0)], precision)
        found = first_fall(c, bound)
        left += roots._proven(c, bound) is None
        with monkeypatch.context() as patch:
            patch.setattr(roots, "_proven", lambda coefficients, bound: None)
            truth = first_fall(c, bound)
        assert (found.fall is None, found.touch, found.unsure) == (
            truth.fall is None,
            truth.touch,
            truth.unsure,
        )
        if truth.fall is not None:
            size = sum(abs(x) * truth.fall**k for k, x in enumerate(c))
            slope = abs(sum(k * x * truth.fall ** (k - 1) for k, x in enumerate(c) if k))
            allowed = 16 * own.rounding * (size / slope + truth.fall)
            assert abs(found.fall - truth.fall) <= allowed
    assert 5 <= left <= len(given) // 2


def test_the_first_of_several_falls_is_taken():
    """Falls at 0.2 and 0.7, a rise at 0.5."""
    c = as_floats(
        expanded([Fraction(1, 5), -1], [Fraction(1, 2), -1], [Fraction(7, 10), -1], [1, 0, 0])
    )
    assert fall(c) == (pytest.approx(0.2, rel=1e-14), None, False)


def test_known_bernstein_coefficients_give_the_same_fall(random):
    """One fall, several falls, and none."""
    for _ in range(50):
        c = [1.0, *random.normal(size=9)]
        known = (np.array(c) @ bernstein_matrix(10)).tolist()
        assert first_fall(c, bound_of(c), known) == fall(c)


def test_the_margin_of_a_polynomial_is_a_bound_on_its_minimum(random):
    rows = np.array([series_like(random, 12) for _ in range(50)])
    margins, bernstein, bounds = margins_of(rows, EPSILON)
    assert bounds == pytest.approx([bound_of(row) for row in rows], rel=1e-14)
    values = [Polynomial(row)(np.linspace(0, 1, 101)).min() for row in rows]
    assert (margins <= values).all()
    assert (margins <= bernstein.min(axis=1)).all()


@pytest.mark.parametrize("flight", [1e-3, 1e-7, 1e-11, 1e-15])
def test_a_flight_of_a_tiny_part_of_the_step_is_found_to_its_last_bits(flight):
    """A gap x (flight − x)(…), divided by x."""
    gap = as_floats(expanded([0, 1], [Fraction(flight), -1], [1, Fraction(3, 10), Fraction(-1, 5)]))
    assert first_fall(gap[1:], 0.0) == (pytest.approx(flight, rel=4 * EPSILON), None, False)


def test_a_dip_of_a_tiny_part_of_the_step_is_found():
    """Negative between 0.4 and 0.4 + 1e-5 only."""
    beyond = Fraction(2, 5) + Fraction(1, 10**5)
    c = as_floats(expanded([Fraction(2, 5), -1], [beyond, -1], [1, 0, 0]))
    assert fall(c) == (pytest.approx(0.4, abs=1e-10), None, False)


def test_no_root_is_seen_beyond_the_step():
    assert fall([1.0, -0.999, 0.0, 0.0]) == (None, None, False)
    assert fall([1.0, -1.5, 0.5000001, 0.0, 0.0]).fall is None


def test_roots_at_the_end_of_the_step_are_seen():
    found = fall([1.0, -1.0, 0.0, 0.0])
    place = found.touch if found.fall is None else found.fall
    assert place == pytest.approx(1.0, abs=1e-14)


# Touches.


@pytest.mark.parametrize("place", [Fraction(1, 7), Fraction(2, 5), Fraction(9, 10)])
def test_a_double_root_is_a_touch(place):
    c = as_floats(expanded([place, -1], [place, -1], [1, Fraction(1, 3)], [1, 0, 0]))
    # A value within ε is as far from the root as √ε.
    assert fall(c) == (None, pytest.approx(float(place), abs=1e-6), False)


def test_a_double_root_differs_from_two_roots_and_from_none_outside_the_bound():
    square = expanded([Fraction(2, 5), -1], [Fraction(2, 5), -1], [1, 0, 0])
    near = pytest.approx(0.4, abs=1e-6)
    fallen = pytest.approx(0.4 - math.sqrt(1e-11), abs=1e-9)
    for lift, expected in [
        (1e-11, (None, None, False)),
        (1e-17, (None, near, False)),
        (-1e-17, (None, near, False)),
        (-1e-11, (fallen, None, False)),
    ]:
        lifted = [float(square[0] + Fraction(lift)), *as_floats(square[1:])]
        assert fall(lifted) == expected


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
@pytest.mark.parametrize("offset", [0.0, 1e-9, 1e-11, -1e-9, -1e-11])
def test_a_minimum_close_to_zero_takes_few_halvings(precision, offset, random, monkeypatch):
    """((x − a)² + offset) (1 + …): a fall, a touch, or none, by the sign of the offset."""
    halvings = []
    half = roots._left_half
    monkeypatch.setattr(roots, "_left_half", lambda b: halvings.append(1) or half(b))
    number = PRECISIONS[precision].number
    for _ in range(30):
        a = Fraction(random.uniform(0.05, 0.95))
        others = [(1, Fraction(x)) for x in random.uniform(-0.3, 0.3, size=17)]
        polynomial = expanded((a * a + Fraction(offset), -2 * a, 1), *others)
        coefficients = [number(float(c)) for c in polynomial]
        coefficients = [c + number(float(e - Fraction(float(e)))) for c, e in
                        zip(coefficients, polynomial, strict=True)]  # fmt: skip
        bound = POLYNOMIAL * PRECISIONS[precision].rounding * float(sum(map(abs, coefficients)))
        halvings.clear()
        found = first_fall(coefficients, bound)
        assert len(halvings) <= 12
        assert not found.unsure
        if offset < 0:
            assert found.touch is None
            assert float(found.fall) == pytest.approx(float(a) - math.sqrt(-offset), abs=1e-8)
        else:
            assert found.fall is None
            assert (found.touch is None) == (offset > 0)
            assert offset or found.touch == pytest.approx(float(a), abs=1e-6)


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
@pytest.mark.parametrize("sign", [1, -1, 0])
def test_a_fall_from_zero_within_round_off_takes_few_halvings(precision, sign, random, monkeypatch):
    """Series that begin within their bound of zero, with a fall as t or t² and a later rise."""
    looked_at = []
    monkeypatch.setattr(roots, "product", lambda *args: looked_at.append(1) or product(*args))
    number, rounding = PRECISIONS[precision].number, PRECISIONS[precision].rounding
    for _ in range(30):
        rest = [number(x) for x in random.uniform(-1, 1, size=15)]
        start = [number(sign * rounding), -number(random.uniform(0, 1)), number(0)]
        if random.integers(2):
            start[1:] = reversed(start[1:])
        coefficients = [*start, *rest, number(0), number(0)]
        looked_at.clear()
        found = first_fall(coefficients, bound_of(coefficients, precision))
        assert len(looked_at) <= 8
        assert found.touch is None
        assert not found.unsure
        steepness = float(max(-start[1], -start[2]))
        assert 0 <= float(found.fall) <= 2 * math.sqrt(100 * rounding / steepness)


def test_a_triple_root_is_a_fall():
    c = as_floats(expanded(*[[Fraction(2, 5), -1]] * 3, [1, 0, 0]))
    # Within the cube root of the bound.
    assert fall(c) == (pytest.approx(0.4, abs=1e-4), None, False)


@pytest.mark.slow
@settings(max_examples=200)
@given(st.lists(st.integers(-6, 6), min_size=2, max_size=6))
def test_falls_and_touches_are_those_that_sturm_counts(coefficients):
    """Sturm's theorem and the multiplicity of the first root, in whole numbers."""
    assume(coefficients[0] > 0)
    assume(any(coefficients[1:]))
    polynomial = sympy.Poly(coefficients[::-1], sympy.Symbol("x"), domain="QQ")
    inside = polynomial.intervals(inf=0, sup=1, eps=sympy.Rational(1, 10**9))
    bound = 64 * EPSILON * sum(map(abs, coefficients))
    found = first_fall([float(c) for c in coefficients], bound)
    assert not found.unsure

    def is_near(place, interval, multiplicity):
        slack = 1e-8 if multiplicity == 1 else bound ** (1 / multiplicity) * 10
        return float(interval[0]) - slack <= place <= float(interval[1]) + slack

    # A root at the very end may be either.
    before_end = [(interval, m) for interval, m in inside if interval[0] < 1]
    falls = [root for root in before_end if root[1] % 2]
    if falls:
        assert is_near(found.fall, *falls[0])
    elif found.fall is not None:
        assert inside
        assert is_near(found.fall, *inside[-1])
    touches = [(i, m) for i, m in before_end if m % 2 == 0 and (not falls or i < falls[0][0])]
    if touches:
        assert is_near(found.touch, *touches[0])
    elif found.touch is not None:
        assert inside
        assert is_near(found.touch, *inside[-1])


def test_a_fall_after_a_touch_is_found():
    """A double root at 0.3 and a fall at 0.8: the polynomial is positive between them."""
    c = as_floats(expanded(*[[Fraction(3, 10), -1]] * 2, [Fraction(4, 5), -1], [1, 0, 0]))
    assert fall(c) == (
        pytest.approx(0.8, rel=1e-13),
        pytest.approx(0.3, abs=1e-6),
        False,
    )


def waves(degree, end):
    """Return 1 + T_degree/2 on [0, 1], less a high power so that it ends at `end`."""
    wave = Chebyshev.basis(degree, domain=[0, 1]).convert(kind=Polynomial).coef / 2
    return [wave[0] + 1, *wave[1:], *[0.0] * 5, end - 1.5]


def test_a_search_that_ends_undecided_is_unsure():
    """A polynomial that goes above and below its bound ten times: no halving decides it."""
    found = first_fall(waves(10, 1.5), 1.0)
    assert found.unsure
    assert found.fall is None
    assert 0 < found.touch < 0.1


def test_a_search_that_gives_up_still_finds_the_fall_of_a_piece_that_ends_below_zero():
    found = first_fall(waves(10, -2.5), 1.0)
    assert 0.7 < found.fall < 1
    assert found.touch < 0.1


# Polishing.


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


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_products_and_matrices_have_the_digits_of_their_numbers(precision):
    """(1 + x)⁴ has the Bernstein coefficients 1, 2, 4, 8 and 16."""
    number = PRECISIONS[precision].number
    matrix = bernstein_matrix(5, number)
    found = product(matrix.T, np.array([number(math.comb(4, k)) for k in range(5)]))
    for j, value in enumerate(found.tolist()):
        assert abs(float(value - number(2**j))) <= 16 * PRECISIONS[precision].rounding * 2**j


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
