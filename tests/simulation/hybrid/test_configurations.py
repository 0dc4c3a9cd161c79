"""Which pair of runs is expected to suffice, for errors that grow by known laws."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.hybrid import system_of
from twolink.simulation.hybrid.configurations import Configuration, Seen, configurations

TIMES = np.linspace(0.0, 4.0, 401)
LOW, LOW_IN_LONG, DOUBLE, DOUBLE_IN_LONG, LONG, FIRST, SECOND, LAST = configurations(1e-9)


def growing(configuration, rate):
    """Return the errors of runs whose errors grow exponentially until they are of order one."""
    return np.minimum(configuration.step_error * np.exp(rate * TIMES), 0.3)


def taken(configuration, errors, accuracy):
    """Return the pair that follows one with these errors."""
    seen = Seen(configuration, TIMES, errors)
    rest = [LOW, DOUBLE, LONG, FIRST, SECOND, LAST]
    rest = rest[rest.index(configuration) + 1 :]
    return next((each for each in rest if seen.expected(each) <= accuracy), LAST)


def test_the_pairs_become_more_precise_and_judges_do_not_share_orders():
    every = list(configurations(1e-9))
    errors = [each.step_error for each in every if not each.shares_judge]
    assert errors == sorted(errors, reverse=True)
    assert all(each.order != each.judging_order for each in every)
    assert [each.is_long for each in every] == [False] * 5 + [True] * 3


@pytest.mark.parametrize("accuracy", [1e-3, 1e-9, 1e-11, 1e-13])
def test_a_run_in_long_doubles_follows_each_in_double_precision_with_the_same_judge(accuracy):
    every = list(configurations(accuracy))
    doubles = [place for place, each in enumerate(every) if each.precision == "double"]
    assert doubles
    for place in doubles:
        run, beside = every[place : place + 2]
        assert (run.judge, run.judging_order) == (beside.judge, beside.judging_order)
        assert beside.precision == beside.judge == "long double"
        assert beside.shares_judge


@pytest.mark.parametrize(("bounces", "part"), [(False, 0.05), (True, 0.2)])
def test_errors_in_long_doubles_are_expected_to_be_a_part_of_those_in_double_precision(
    bounces, part
):
    """Of a pair with the same judge, where they are known."""
    errors = np.where(TIMES < 2, 1e-14, 4e-9)
    seen = Seen(LOW, TIMES, errors, bounces=bounces)
    assert seen.in_long_doubles == pytest.approx(part * errors, rel=1e-15)
    assert seen.expected(LOW_IN_LONG) == pytest.approx(part * 4e-9)
    assert seen.expected(DOUBLE_IN_LONG) == np.inf
    other = Seen(DOUBLE, TIMES, errors, bounces=bounces)
    assert other.expected(DOUBLE_IN_LONG) == pytest.approx(part * 4e-9)
    assert Seen(LOW_IN_LONG, TIMES, errors).expected(LOW_IN_LONG) == np.inf
    unknown = np.where(TIMES < 2, 1e-14, np.inf)
    assert Seen(LOW, TIMES, unknown).expected(LOW_IN_LONG) == np.inf
    # A run that ended early has no errors after that.
    assert Seen(LOW, TIMES, errors[:100]).expected(LOW_IN_LONG) == np.inf


@pytest.mark.parametrize("accuracy", [1e-3, 1e-9, 1e-11, 1e-13])
def test_the_states_of_a_judge_in_long_doubles_are_known_to_round_off(accuracy):
    for each in configurations(accuracy):
        if each.judge == "long double":
            system = replace(system_of(precision=each.judge), order=each.judging_order)
            assert system.scales.resolution == system.rounding


@pytest.mark.parametrize(("accuracy", "first"), [(1e-3, 15), (1e-11, 19), (1e-13, 21)])
def test_the_first_order_suffices_for_the_accuracy(accuracy, first):
    assert next(configurations(accuracy)).order == first


def test_the_least_accuracy_has_configurations():
    """A thousandth of it is no number of float64."""
    assert [each.order for each in configurations(5e-324)] == [23, 31, 35, 41]


@pytest.mark.parametrize(
    ("configuration", "apart", "expected"),
    [(DOUBLE, 1e-17, False), (FIRST, 1e-17, True), (FIRST, 0.0, False), (FIRST, 1e-36, False)],
)
def test_errors_of_a_start_that_was_moved_onto_a_contact_are_alike_in_every_precision(
    configuration, apart, expected
):
    errors = np.full(401, 1e-8)
    assert Seen(configuration, TIMES, errors, apart).is_of_start is expected
    errors[300:] = np.inf
    assert not Seen(configuration, TIMES, errors, apart).is_of_start


@pytest.mark.parametrize(
    ("rate", "following"), [(2.0, DOUBLE), (4.5, FIRST), (8.0, SECOND), (10.0, LAST)]
)
def test_an_error_that_grows_exponentially_is_expected_to_go_on(rate, following):
    """The true error at the end, 4 s, is that of a step times exp(4 rate), here up to 2e17."""
    errors = growing(LOW, rate)
    assert taken(LOW, errors, 1e-9) == following
    seen = Seen(LOW, TIMES, errors)
    for each in (DOUBLE, FIRST, SECOND, LAST):
        exact = each.step_error * math.exp(4 * rate)
        assert seen.expected(each) == pytest.approx(exact * (100 if rate > 6 else 1), rel=0.5)


def test_the_end_of_bounces_goes_with_the_root_of_round_off():
    """In double precision 1e-6, in long double precision 2e-8, in quadruple precision nothing."""
    errors = np.where(TIMES < 2, 1e-14, 1e-6)
    seen = Seen(DOUBLE, TIMES, errors)
    assert seen.expected(LONG) == pytest.approx(1e-6 * 2**-5.5, rel=1e-12)
    assert taken(DOUBLE, errors, 1e-9) == FIRST
    assert taken(DOUBLE, errors, 1e-7) == LONG


def test_the_part_before_the_end_of_a_judge_counts():
    errors = np.where(TIMES < 2, 1e-14, np.inf)
    assert Seen(DOUBLE, TIMES, errors).expected(LONG) < 1e-15
    assert Seen(DOUBLE, TIMES, np.full(401, np.inf)).expected(LONG) == 0
    assert Seen(DOUBLE, TIMES, np.zeros(401)).expected(LONG) == 0


def test_an_error_that_is_unknown_in_quadruple_precision_is_left_to_the_last_pair():
    errors = np.where(TIMES < 2, 1e-24, np.inf)
    assert Seen(FIRST, TIMES, errors).expected(SECOND) == np.inf
    assert taken(FIRST, errors, 1e-9) == LAST


def test_a_motion_that_is_chaotic_from_its_start_has_a_finite_expectation():
    errors = np.where(TIMES > 0, 0.3, 0.0)
    assert math.isfinite(Seen(LOW, TIMES, errors).expected(LAST))
    assert taken(LOW, errors, 1e-9) == LAST


def test_rounding_is_that_of_the_result():
    assert Configuration("long double", 23, "quadruple", 25).rounding == 2.0**-63


def known_until(time, error, configuration, **more):
    """Return a pair that shows an error until a time (s), after which it is unknown."""
    return Seen(configuration, TIMES, np.where(time >= TIMES, error, np.inf), **more)


# The change of a start that is moved onto a contact (rad).
MOVED = 1e-16


@pytest.mark.parametrize(
    ("earlier", "later", "expected"),
    [
        ((9.0, 3e-8), (9.0, 2e-8), True),
        ((9.0, 3e-8), (9.0, 1e-8), False),
        # More than that of the start.
        ((9.0, 3e-8), (9.0, 7e-8), False),
        ((2.0, 3e-8), (2.0, 2e-8), True),
        # It is known for longer.
        ((2.0, 3e-8), (2.1, 2e-8), False),
        ((2.0, 3e-8), (1.0, 2e-8), True),
        # Round-off of float64, and errors of order one, show nothing.
        ((2.0, 4e-16), (2.0, 3e-16), False),
        ((9.0, 0.4), (9.0, 0.4), False),
    ],
)
def test_an_error_that_stays_in_longer_numbers_is_that_of_the_start(earlier, later, expected):
    before = known_until(*earlier, DOUBLE)
    assert known_until(*later, LONG, apart=MOVED).stays_as(before, 1e-9) is expected
    assert not known_until(*later, LONG, apart=1e-17).stays_as(before, 1e-9)
    # Two runs in double precision may share their round-off.
    before = known_until(*earlier, LOW)
    assert not known_until(*later, DOUBLE, apart=MOVED).stays_as(before, 1e-9)


def test_a_judge_that_ends_early_shows_only_an_error_that_is_too_large():
    """Later, where the earlier pair has errors of 1e-7, longer numbers may have smaller ones."""
    before = Seen(DOUBLE, TIMES, np.where(TIMES <= 2, 6e-12, 1e-7))
    early = known_until(2.0, 4e-12, LONG, apart=MOVED)
    assert not early.stays_as(before, 1e-9)
    assert early.stays_as(before, 1e-12)
    assert early.stays_as(known_until(2.0, 6e-12, DOUBLE), 1e-9)


@pytest.mark.parametrize(
    ("pair", "undecided", "expected"),
    [(DOUBLE, True, False), (LONG, True, True), (LONG, False, False), (FIRST, False, True)],
)
def test_only_the_last_pair_may_decide_what_113_bits_leave_open(pair, undecided, expected):
    seen = known_until(2.0, 1e-16, pair, undecided=undecided)
    assert seen.leaves_open is expected
    assert (seen.expected(LAST) == math.inf) is expected
    assert known_until(9.0, 1e-16, pair, undecided=undecided).expected(LAST) < 1e-15
