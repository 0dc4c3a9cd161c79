"""Contacts are proven to stay open, or to close once in a short bracket."""

import math
import random

import flint
import mpmath
import pytest
from flint import arb, arb_poly

from twolink.accuracy import enclosed_run
from twolink.accuracy.certain import UndecidedError
from twolink.accuracy.defect_bound import Step
from twolink.accuracy.frames import Frame
from twolink.accuracy.gap_bound import Crossing, GapBound, bracket, gradients
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elements import RigidContact
from twolink.effects.gravity import Gravity

CHAIN = Chain((1.25, 0.75), (0.75, 0.5), ((0.4, 0.1), (0.3, -0.05)), (0.06, 0.03))
FLOOR = RigidContact("floor", PointCoordinate("D", (0.6, -0.8)), -0.9, 0.5)
STOP = RigidContact("stop", JointCoordinate("B", -1), -0.7, 0.5)
TUBE = arb(2.0**-24)
HALVINGS = 60


def bound(coefficients, error=0.0):
    """Return a bound of a given gap, in a step of 1 s."""
    gap = arb_poly(coefficients)
    zero, off = arb(0), arb(error)
    return GapBound(FLOOR, gap, gap.derivative(), zero, off, off, off)


def roots(numbers):
    """Return the coefficients of a product of t − r."""
    product = [1.0]
    for root in numbers:
        product = [a - root * b for a, b in zip([0.0, *product], [*product, 0.0], strict=True)]
    return product


@pytest.mark.parametrize("seed", range(60))
def test_the_first_of_random_roots_is_found(seed):
    numbers = random.Random(seed)
    count = numbers.randint(1, 5)
    found = sorted(numbers.uniform(0.02, 1.6) for _ in range(count))
    coefficients = roots(found)
    # Positive at the start.
    sign = 1.0 if coefficients[0] > 0 else -1.0
    given = bound([sign * c for c in coefficients])
    crossing = given.first_crossing(arb(1), HALVINGS)
    if found[0] > 1:
        assert crossing is None
        return
    assert crossing.start < found[0] < crossing.end
    assert all(not crossing.start < other < crossing.end for other in found[1:])
    assert abs(float(given.root(crossing)) - found[0]) < 1e-9


def test_a_gap_that_has_just_opened_is_not_closed_again():
    """t (0.25 − t): zero at the start, where the rate is positive."""
    assert bound([0.0, 0.25, -0.125]).first_crossing(arb(1), HALVINGS) is None
    crossing = bound([0.0, 0.25, -1.0]).first_crossing(arb(1), HALVINGS)
    assert crossing.start > 0
    assert crossing.start < 0.25 < crossing.end


@pytest.mark.parametrize("touch", [0.0, 1e-12, -1e-12])
def test_grazing_is_refused(touch):
    """(t − 1/3)² with an error that is larger than its distance from zero."""
    with pytest.raises(UndecidedError, match="gap of floor is too small to decide"):
        bound([1 / 9 + touch, -2 / 3, 1.0], error=1e-10).first_crossing(arb(1), HALVINGS)


def test_near_misses_are_decided():
    assert bound([1 / 9 + 1e-12, -2 / 3, 1.0]).first_crossing(arb(1), HALVINGS) is None
    assert bound([1 / 9 - 1e-12, -2 / 3, 1.0]).first_crossing(arb(1), HALVINGS) is not None


def test_the_error_of_the_gap_matters():
    """A gap that stays above 1e-3 is open if it is known that well."""
    gap = [0.001, 0.0, 1.0]
    assert bound(gap, error=0.9e-3 / 2).first_crossing(arb(1), HALVINGS) is None
    with pytest.raises(UndecidedError):
        bound(gap, error=1.1e-3).first_crossing(arb(1), HALVINGS)


def a_step(seed, length=0.05):
    """Return a step of polynomials that are near a motion, with their frame."""
    numbers = random.Random(seed)
    q = tuple([numbers.uniform(-2, 2) for _ in range(6)] for _ in range(2))
    chain = CHAIN.convert(arb)
    exact = tuple([arb(c) for c in row] for row in q)
    return q, Step(flint, chain, (Gravity(),), exact, arb(0), arb(length), 120, 40)


@pytest.mark.parametrize("contact", [FLOOR, STOP], ids=["floor", "stop"])
@pytest.mark.parametrize("seed", range(3))
def test_gap_and_rate_are_bounded_along_a_step(seed, contact):
    """For the polynomials and for motions that are off by the errors."""
    numbers = random.Random(seed)
    q, step = a_step(seed)
    with enclosed_run.balls(flint, 120, 40):
        errors = [arb(numbers.choice([1e-9, 1e-4])) for _ in range(4)]
        found = GapBound.of(step, contact, Frame.around(flint, errors), errors)
        for _ in range(30):
            a, b = sorted(numbers.uniform(0, 0.05) for _ in range(2))
            t = numbers.uniform(a, b)
            x = [mpmath.polyval([mpmath.mpf(c) for c in row[::-1]], t) for row in q]
            x += [mpmath.diff(lambda s, row=row: mpmath.polyval(row[::-1], s), t) for row in q]
            x = [
                y + numbers.choice([-0.99, 0.99]) * float(e) for y, e in zip(x, errors, strict=True)
            ]
            gap = contact.normal.coordinate(CHAIN, x[:2]) - contact.bound
            rate = contact.normal.speed(CHAIN, x[:2], x[2:])
            start, end = arb(a), arb(b)
            assert found.gap_during(start, end).contains(arb(mpmath.nstr(gap, 30)))
            assert found.gap_at(arb(t)).contains(arb(mpmath.nstr(gap, 30)))
            assert found.rate_during(start, end).contains(arb(mpmath.nstr(rate, 30)))
            assert found.rate_during(arb(t), arb(t)).contains(arb(mpmath.nstr(rate, 30)))


def test_gradients_are_derivatives():
    numbers = random.Random(1)
    x = [numbers.uniform(-2, 2) for _ in range(4)]
    by_gap, by_rate = gradients(FLOOR, CHAIN.convert(arb), [arb(y) for y in x])
    functions = (
        lambda *y: FLOOR.normal.coordinate(CHAIN, y[:2]),
        lambda *y: FLOOR.normal.speed(CHAIN, y[:2], y[2:]),
    )
    for function, gradient in zip(functions, (by_gap, by_rate), strict=True):
        for k in range(4):
            order = tuple(int(i == k) for i in range(4))
            assert float(gradient[k]) == pytest.approx(float(mpmath.diff(function, x, order)))


def test_a_bracket_contains_the_instants_of_all_motions():
    """Links that turn evenly: the gap of a stop is linear, and each error moves its zero."""
    balanced = Chain((1.0, 2.0), (1.0, 0.5), ((0.5, 0.0), (0.0, 0.0)), (0.1, 0.2))
    stop = RigidContact("stop", JointCoordinate("B", -1), -0.75, 0.5)
    q = ([arb(0.0), arb(1.0)], [arb(0.5), arb(3.0)])
    with enclosed_run.balls(flint, 200, 40):
        step = Step(flint, balanced.convert(arb), (), q, arb(0), arb(0.5), 200, 40)
        error = 1e-10
        before = Frame.around(flint, [arb(error)] * 4)
        known = GapBound.of(step, stop, before, step.after(before, TUBE).errors)
        crossing = known.first_crossing(arb(0.5), HALVINGS)
        assert crossing.start < 0.125 < crossing.end
        found = bracket(step, known, crossing, before, TUBE)
        for first, second, slow, fast in ((1, -1, 1, -1), (-1, 1, -1, 1), (1, 1, 1, 1)):
            gap = 0.25 - error * (second - first)
            time = gap / (2.0 + error * (fast - slow))
            assert float(found.start) < time < float(found.end)
        assert float(found.length) < 10 * error
        assert all(float(bound) >= error for bound in found.passage.errors)


def test_a_crossing_at_the_very_end_of_a_step_is_refused():
    balanced = Chain((1.0, 2.0), (1.0, 0.5), ((0.5, 0.0), (0.0, 0.0)), (0.1, 0.2))
    stop = RigidContact("stop", JointCoordinate("B", -1), -0.75, 0.5)
    q = ([arb(0.0), arb(1.0)], [arb(0.5), arb(3.0)])
    with enclosed_run.balls(flint, 200, 40):
        step = Step(flint, balanced.convert(arb), (), q, arb(0), arb(0.125), 200, 40)
        before = Frame.around(flint, [arb(1e-10)] * 4)
        known = GapBound.of(step, stop, before, step.after(before, TUBE).errors)
        with pytest.raises(UndecidedError, match="impact on stop cannot be bracketed"):
            bracket(step, known, Crossing(arb(0), arb(0.125)), before, TUBE)
        assert math.isclose(float(known.gap_at(arb(0.125)).mid()), 0.0, abs_tol=1e-12)
