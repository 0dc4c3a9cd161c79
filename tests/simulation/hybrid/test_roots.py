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

from tests.simulation.hybrid.polynomials import EPSILON, as_floats, bound_of, expanded, series_like
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid import bernstein, polishing, roots
from twolink.simulation.hybrid.bernstein import bernstein_matrix
from twolink.simulation.hybrid.roots import Search, first_fall, spread_of_fall, with_rest
from twolink.simulation.hybrid.tolerances import POLYNOMIAL


def fall(coefficients):
    return first_fall(coefficients, bound_of(coefficients))


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


def test_the_search_for_a_simple_root_begins_near_it(random, monkeypatch):
    """By the polygon of the Bernstein coefficients and its bend; by the polygon alone 2e-3 away."""
    begun = []

    def bracketed(coefficients, low, high, near):
        found = polishing.bracketed(coefficients, low, high, near)
        begun.append(abs(near - found))
        return found

    monkeypatch.setattr(roots, "bracketed", bracketed)
    for _ in range(600):
        fall([0.5 * random.uniform(), *series_like(random, 20)[1:]])
    assert len(begun) > 50
    assert np.median(begun) < 1e-4


@pytest.mark.parametrize("scale", ["1e-4900", "1e4900"])
@pytest.mark.parametrize("degree", [1, 2, 21])
def test_a_search_begins_alike_beyond_the_range_of_float64(scale, degree):
    """For (0.3 − x)(1 + x/2)^(n − 1): as in float64."""
    factors = [[Fraction(3, 10), -1], *[[1, Fraction(1, 2)]] * (degree - 1)]
    c = as_floats(expanded(*factors))
    near = roots._only_fall(bernstein.bernstein_of(c), 0.0)
    scaled = [np.longdouble(x) * np.longdouble(scale) for x in c]
    found = roots._only_fall(bernstein.bernstein_of(scaled), 0.0)
    assert found == pytest.approx(near, rel=1e-12)


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
def test_a_descent_to_zero_at_the_end_of_the_step_takes_no_halvings(precision, monkeypatch):
    """(1 − x)(1 + x/3): the touch is where it falls to its bound."""

    def halved(b):
        raise AssertionError

    for module in (bernstein, roots):
        monkeypatch.setattr(module, "left_half", halved)
    number, rounding = PRECISIONS[precision].number, PRECISIONS[precision].rounding
    polynomial = expanded([1, -1], [1, Fraction(1, 3)])
    c = [number(f.numerator) / number(f.denominator) for f in polynomial]
    bound = 1e3 * max(rounding, EPSILON)
    found = first_fall([*c, number(0), number(0)], bound)
    assert (found.fall, found.unsure) == (None, False)
    assert 1 - found.touch == pytest.approx(bound * 3 / 4, rel=1e-2)


def test_the_end_of_a_descent_is_where_halving_finds_it(random, monkeypatch):
    """Convex and concave ones that end at zero, or within the bound on either side of it."""
    tried = 0
    for _ in range(300):
        degree, bound = int(random.integers(2, 12)), 10.0 ** random.uniform(-13, -3)
        b = np.cumsum(random.uniform(0.1, 1.0, degree) ** 3)[::-1]
        b = [*b.tolist(), 0.0]
        shift = random.uniform(-0.9, 0.9) * bound
        c = (np.array(b) @ np.linalg.inv(bernstein.bernstein_matrix(degree + 1))).tolist()
        c[0] += shift
        found = first_fall(c, bound)
        with monkeypatch.context() as patch:
            patch.setattr(roots, "_end_of_descent", lambda *piece: None)
            halved = first_fall(c, bound)
        assert (found.fall is None, found.unsure) == (halved.fall is None, halved.unsure)
        if found.touch is not None:
            tried += 1
            assert abs(polishing.horner(c, found.touch)) <= 2 * bound
            assert abs(polishing.horner(c, halved.touch)) <= 2 * bound
    assert tried > 200


@pytest.mark.slow_but_first
@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
@pytest.mark.parametrize("offset", [0.0, 1e-9, 1e-11, -1e-9, -1e-11])
def test_a_minimum_close_to_zero_takes_few_halvings(precision, offset, random, monkeypatch):
    """((x − a)² + offset) (1 + …): a fall, a touch, or none, by the sign of the offset."""
    halvings = []
    half = bernstein.left_half
    for module in (bernstein, roots):
        monkeypatch.setattr(module, "left_half", lambda b: halvings.append(1) or half(b))
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
    product = bernstein.product
    monkeypatch.setattr(bernstein, "product", lambda *args: looked_at.append(1) or product(*args))
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


REST = Fraction(1, 16)


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
@pytest.mark.parametrize(
    ("sum_of", "expected"),
    [
        # 1/16 + x (1/2 − x): at (1/2 + √(1/4 + 1/4)) / 2, where the sum falls at 1/2.
        (("1/2", "-1"), Search(0.6035533905932737)),
        # 1/16 + x (31/32 − x) is 1/32 at 1.
        (("31/32", "-1"), Search()),
        # 1/16 + x (1/2 − 2 x + 7/4 x²) has no root, and the sum falls at (4 − √2)/7.
        (("1/2", "-2", "7/4"), Search(None, 0.3693980625181293)),
        # 1/16 + x (1/2 − 3 x + 11/4 x²) falls and rises; the sum falls at 2/11.
        (("1/2", "-3", "11/4"), Search(0.32935801040374285)),
        # Neither falls.
        (("1/2", "0"), Search()),
    ],
)
def test_the_fall_of_a_gap_counts_the_rest_that_division_by_time_omits(precision, sum_of, expected):
    number = PRECISIONS[precision].number
    coefficients = [number(float(Fraction(c))) for c in sum_of] + [number(0)]
    found = with_rest(first_fall(coefficients, 0.0), coefficients, number(float(REST)))
    assert not found.unsure
    for own, exact in zip(found[:2], expected[:2], strict=True):
        in_float = None if own is None else float(own)
        assert in_float == (None if exact is None else pytest.approx(exact, rel=1e-14))


@pytest.mark.parametrize("power", [1, 3, 5])
def test_a_flat_fall_may_be_as_far_as_its_polynomial_is_within_the_bound(power):
    """(x₀ − x)^n is within a bound as far as its nth root from x₀."""
    place, bound, steep = 0.5, 1e-15, 1e-8
    coefficients = [
        math.comb(power, k) * place ** (power - k) * (-1) ** k for k in range(power + 1)
    ]
    found = spread_of_fall(coefficients, place, bound, steep)
    if power == 1:
        assert found == 0
    else:
        assert bound ** (1 / power) <= found <= 2 * bound ** (1 / power)


def test_the_slope_of_a_flat_fall_in_113_bits_is_not_that_of_round_off_in_float64():
    number = PRECISIONS["quadruple"].number
    place, bound = number(7) / 10, 1e-33
    coefficients = [math.comb(5, k) * (-1) ** k * place ** (5 - k) for k in range(6)]
    found = spread_of_fall(coefficients, place, bound, 1e-17)
    assert bound**0.2 <= found <= 2 * bound**0.2


def test_a_fall_of_a_polynomial_within_its_bound_may_be_anywhere():
    assert spread_of_fall([1e-16, -1e-16], 1.0, 1e-15, 1e-8) >= 1
