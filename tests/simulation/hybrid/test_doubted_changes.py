"""Doubts on events: what they may change, from their times on."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from tests.simulation.hybrid import BOUNCE_TIMES as TIMES
from tests.simulation.hybrid import tampered
from twolink.contact.states import EventKind
from twolink.simulation.hybrid.differences import differences
from twolink.simulation.hybrid.doubted_changes import _drift, _grown, _largest_since, with_doubts
from twolink.simulation.hybrid.mode import Doubt, Leaving, Trigger, doubt_of_rate


def test_an_undecided_impact_counts_as_an_error_from_its_time_on(run, judge):
    """A touch that may have been an impact of 1e-4 rad/s: twice that, and a tenth more."""
    doubt = Doubt(1.25, Trigger(EventKind.HITS, 0), 1e-4, 2e-4, 1.25)
    errors = differences(run, replace(judge, doubts=(doubt,)), TIMES, 1e-9)
    assert errors[TIMES < 1.2].max() < 1e-12
    assert errors[-1] == pytest.approx(2e-4)


@pytest.mark.parametrize(
    ("leaving", "motion"),
    [
        # t, from 0.5 s to 2.5 s, and t²/2; sinh(2 t)/2; and 2/ω, 2/ω² of a pose that is held back.
        (Leaving(0.0, 0.0), 2.0),
        (Leaving(2.0, 0.5), np.sinh(4.0) / 2),
        (Leaving(0.0, 20.0), 0.1),
        (Leaving(np.inf, 0.0), np.inf),
    ],
)
def test_an_acceleration_that_is_left_out_counts_as_its_motion(run, judge, leaving, motion):
    doubt = doubt_of_rate(0.5, Trigger(EventKind.BREAKS, 0, 1), 1e-7, leaving)
    errors = differences(run, replace(judge, doubts=(doubt,)), TIMES, 1e-9)
    assert errors[TIMES < 0.4].max() < 1e-12
    assert errors[-1] == pytest.approx(1e-7 * motion, rel=1e-5)
    more = replace(judge, doubts=(doubt._replace(rate=2e-7), doubt))
    assert differences(run, more, TIMES, 1e-9)[-1] == pytest.approx(2e-7 * motion, rel=1e-5)
    far = replace(judge, doubts=(doubt._replace(rate=1.0),))
    assert np.isinf(differences(run, far, TIMES, 1e-9)[-1]) == bool(leaving.growth)


def moved_by(angle, speed, rate, stages):
    """Return the largest of q and u after linear motions: q'' = k q + rate, each for a time."""
    for k, time in stages:
        rates = [[0.0, 1.0, 0.0], [k, 0.0, rate], [0.0, 0.0, 0.0]]
        angle, speed, _ = expm(np.array(rates) * time) @ [angle, speed, 1.0]
    return max(abs(angle), abs(speed))


@pytest.mark.parametrize("held", [0.7, 3.0, 40.0])
@pytest.mark.parametrize("begins", [1.0, 1.3, 2.1])
def test_a_motion_that_is_left_out_goes_on_in_later_modes(held, begins):
    """It is held back by a spring, and is free, or leaves, in the modes after it."""
    free, falls = Leaving(0.0, 0.0, 0.0), Leaving(4.0, 4.0, 4.0)
    doubt = doubt_of_rate(0.5, Trigger(EventKind.BREAKS, 0, 1), 1e-7, Leaving(0.0, held, held))
    for later, k in ((free, 0.0), (falls, 16.0)):
        times = np.linspace(begins, 3.0, 40)[1:]
        found = _drift(doubt.since(begins, later), times)
        known = [
            moved_by(0.0, 0.0, 1e-7, [(-held * held, begins - 0.5), (k, t - begins)]) for t in times
        ]
        assert (found >= known).all()
        assert found[-1] <= 60 * known[-1]
    assert (_drift(doubt.since(begins, falls)._replace(rate=1.0), times)[-1]) == np.inf
    # A change that is unknown stays so.
    unknown = doubt._replace(leaving=Leaving(np.inf, 0.0)).since(begins, free)
    assert np.isinf(_drift(unknown, times)).all()


@pytest.mark.parametrize("rate", [5.0, 300.0])
def test_a_stiff_mode_turns_an_angle_that_was_left_out_into_a_speed(rate):
    doubt = doubt_of_rate(0.5, Trigger(EventKind.BREAKS, 0, 1), 1e-7, Leaving(0.0, 0.0))
    times = np.linspace(1.5, 2.5, 100)[1:]
    found = _drift(doubt.since(1.5, Leaving(0.0, rate, rate)), times)
    stages = [[(0.0, 1.0), (-rate * rate, t - 1.5)] for t in times]
    known = [moved_by(0.0, 0.0, 1e-7, own) for own in stages]
    assert (found >= known).all()
    assert found[-1] <= 4 * max(known)


def test_a_growth_beyond_all_numbers_has_no_bound():
    doubt = doubt_of_rate(0.5, Trigger(EventKind.BREAKS, 0, 1), 1e-7, Leaving(2.0, 0.5))
    times = np.array([0.4, 1.0, 500.0, 1e4])
    assert list(np.isinf(_drift(doubt, times))) == [False, False, True, True]
    resting = doubt._replace(leaving=Leaving(0.0, np.inf)).since(0.7, Leaving(2.0, 0.5))
    assert list(np.isinf(_drift(resting, times))) == [False, False, True, True]


def test_a_doubt_counts_if_it_matters_and_is_asked_only_within_the_error(run, judge):
    asked = []

    def matters(answer):
        return lambda: asked.append(answer) or answer

    def last_error(within, answer):
        trigger = Trigger(EventKind.STOPS, 0)
        doubt = Doubt(1.25, trigger, np.inf, np.inf, 1.25, within, matters(answer))
        return differences(run, replace(judge, doubts=(doubt,)), TIMES, 1e-9)[-1]

    assert last_error(0.0, True) == np.inf
    assert last_error(0.0, False) < 1e-12
    assert asked == [True, False]
    assert last_error(1e-3, True) < 1e-12
    assert asked == [True, False]


def test_the_change_by_an_undecided_impact_grows_with_the_errors(run, judge):
    """A difference that grows from 1e-9 to 1e-7 multiplies a change after the first by 300.

    A change after both stays as it is.
    """
    apart = tampered(tampered(run, 0.5, 0, 1e-9), 1.5, 0, 1e-7)

    def by_doubt_at(time, first):
        doubt = Doubt(time, Trigger(EventKind.HITS, 0), 1e-5, 1e-5, time)
        return differences(first, replace(judge, doubts=(doubt,)), TIMES, 1e-9)

    errors = by_doubt_at(0.75, apart)
    assert errors[(TIMES > 0.8) & (TIMES < 1.0)] == pytest.approx(1e-5)
    assert errors[-1] == pytest.approx(3e-3, rel=1e-2)
    assert by_doubt_at(1.75, apart)[-1] == pytest.approx(1e-5)
    # Round-off of two runs is no growth.
    assert by_doubt_at(0.75, run)[-1] == pytest.approx(1e-5)


def test_an_earlier_peak_of_the_difference_does_not_hide_the_growth_after_a_doubt(run, judge):
    """The difference rises to 1e-6 and is 1e-13 at the doubt: from there it grows to 1e-8."""
    moments = np.linspace(0.0, 2.0, 201)
    found = np.where(moments < 0.5, 1e-6, 1e-13)
    found[150:] = 1e-8
    doubt = Doubt(1.0, Trigger(EventKind.HITS, 0), 1e-9, 1e-10, 1.0)
    errors = with_doubts(found, np.zeros(201), run, replace(judge, doubts=(doubt,)), moments)
    assert errors[60] == 1e-6
    # 1e-10 grows by 1e-8 / 1e-13, or a little less beside round-off.
    assert 1e-7 < errors[-1] < 1e-4
    without = with_doubts(found, np.zeros(201), run, replace(judge, doubts=()), moments)
    assert without[-1] == 1e-6


def test_a_change_by_earlier_doubts_has_grown_as_the_difference_since_the_largest():
    found, factors = np.array([9.0, 1.0, 4.0, 1e-9]), np.array([0.0, 2.0, 0.0, 1.0])
    assert _grown(factors, found, 1e-6) == 8.0
    assert _grown(factors[1:2], found[3:], 1e-6) == 2e-6
    assert _grown(0 * factors, found, 1e-6) == 0.0


@pytest.mark.parametrize(
    ("factors", "expected"),
    [
        ([0, 0, 0, 0, 0, 0], [5, 5, 5, 5, 5, 5]),
        ([0, 0, 2, 2, 2, 2], [5, 5, 1, 3, 3, 3]),
        ([0, 0, 2, 2, np.inf, np.inf], [5, 5, 1, 3, 2, 2]),
    ],
)
def test_the_largest_difference_is_that_since_the_last_larger_factor(factors, expected):
    found = np.array([5.0, 1.0, 1.0, 3.0, 2.0, 1.0])
    assert _largest_since(found, np.array(factors, dtype=float)).tolist() == expected
