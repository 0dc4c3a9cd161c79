"""Limits of time and memory: runs that would take more end with an estimate."""

import math

import pytest

from twolink import limits
from twolink.errors import ParameterError, TooMuchError
from twolink.limits import UNLIMITED, Budget, Forecast, Limits, in_bytes, in_time


def test_a_forecast_uses_the_recent_pace():
    forecast = Forecast(1.0)
    assert forecast.total(0.1, 0.5) == 0.0
    assert forecast.total(0.2, 1.0) == 0.0
    # Half as fast from now on: 1 s so far, 1 s for 0.1, 7 s for the rest.
    assert forecast.total(0.3, 2.0) == pytest.approx(min(1.0 + 4.0, 2.0 + 7.0))
    assert forecast.total(0.4, 3.0) == pytest.approx(2.0 + 7.0)


def test_one_slow_part_does_not_dominate_the_forecast():
    forecast = Forecast(1.0)
    forecast.total(0.2, 1.0)
    assert forecast.total(0.2, 5.0) < 10
    assert forecast.total(0.4, 6.0) < 10


def test_the_forecast_of_a_run_without_progress_is_infinite():
    forecast = Forecast(1.0)
    forecast.total(0.2, 1.0)
    forecast.total(0.2, 2.0)
    assert forecast.total(0.2, 3.0) == math.inf


def set_clock(monkeypatch, readings, idle=0.0):
    """Let a run begin at the first of these times (s), and each report come at the next.

    The thread has been computing all the time but the first `idle` seconds.
    """
    clock = iter(readings)
    now = [0.0]

    def perf_counter():
        now[0] = next(clock)
        return now[0]

    monkeypatch.setattr(limits, "_READING", 0.0)
    monkeypatch.setattr(limits, "perf_counter", perf_counter)
    monkeypatch.setattr(limits, "thread_time", lambda: 7.0 + max(0.0, now[0] - idle))


def test_the_clock_of_a_thread_is_read_seldom(monkeypatch):
    readings = iter(range(1000))
    monkeypatch.setattr(limits, "thread_time", lambda: next(readings))
    monkeypatch.setattr(limits, "_READING", 1e3)
    report = Limits().timed("a run")
    for _ in range(100):
        report(0.5)
    assert next(readings) == 0


def test_a_run_spends_the_time_of_its_thread_after_the_first_report(monkeypatch):
    """Other work of the machine between two reports, of 100 s, does not count."""
    set_clock(monkeypatch, [0.0, 2.0, 102.0, 103.0], idle=101.0)
    clock = limits._ThreadClock()
    assert [clock.spent() for _ in range(3)] == [2.0, 3.0, 4.0]


@pytest.mark.parametrize(("share", "words"), [(1e-9, "about .* years"), (0.0, "more time")])
def test_a_run_that_is_too_long_is_ended(share, words, monkeypatch):
    set_clock(monkeypatch, range(0, 1000, 2))
    reports = []
    progress = Limits(seconds=600.0).timed("the motion", reports.append)
    progress(share)
    with pytest.raises(TooMuchError, match=rf"the motion would take {words}.*; the limit is 10 m"):
        progress(share * 2)
    assert reports[0] == share


def test_the_runs_of_a_budget_count_together(monkeypatch):
    """Each takes 500 s of the 600 s that are allowed."""
    set_clock(monkeypatch, range(0, 10_000, 250))
    budget = Budget(Limits(seconds=600.0), "the motion")
    first = budget.timed()
    for share in (0.5, 1.0):
        first(share)
    second = budget.timed()
    with pytest.raises(TooMuchError, match=r"would take about 12\.5 minutes of computing"):
        second(0.5)
    alone = Budget(Limits(seconds=600.0), "the motion").timed()
    for share in (0.5, 1.0):
        alone(share)


def test_a_limit_below_the_window_of_estimates_ends_a_run(monkeypatch):
    set_clock(monkeypatch, [0.0, 0.3, 0.6, 0.9, 1.2])
    report = Limits(seconds=1.0).timed("the motion")
    report(0.05)
    with pytest.raises(TooMuchError, match=r"about 6 s of computing; the limit is 1 s"):
        report(0.1)


def test_a_run_that_has_taken_its_limit_is_ended_without_an_estimate(monkeypatch):
    set_clock(monkeypatch, [0.0, 0.1, 1.3])
    report = Limits(seconds=1.2).timed("the motion")
    report(0.01)
    with pytest.raises(TooMuchError, match=r"the limit is 1\.2 s"):
        report(0.99)


def test_unlimited_never_ends_a_run(monkeypatch):
    set_clock(monkeypatch, range(0, 10_000, 100))
    progress = UNLIMITED.timed("the motion")
    for _ in range(50):
        progress(0.0)
    UNLIMITED.check_memory("samples", 1e300)


def test_excessive_memory_is_refused_in_one_sentence():
    Limits().check_memory("3 samples", 1e3)
    with pytest.raises(TooMuchError) as caught:
        Limits().check_memory("samples", 7e12)
    assert str(caught.value) == (
        "samples would take about 7 TB of memory; the limit is 4 GB (--force lifts it, and "
        "limits=UNLIMITED in Python)"
    )


def test_predicted_growth_of_memory_is_refused():
    growth = Forecast(1e6)
    bounds = Limits(memory=1e9)
    bounds.check_growth("the motion", growth, 0.01, 1e8)
    with pytest.raises(TooMuchError, match=r"about 10 GB of memory \(2\.0% are done\)"):
        bounds.check_growth("the motion", growth, 0.02, 2e8)
    with pytest.raises(TooMuchError, match="about 2 GB"):
        bounds.check_growth("the motion", Forecast(1e99), 0.9, 2e9)


def test_a_short_part_of_fast_growth_does_not_dominate_the_estimate():
    """Many short bounces take memory at a pace that the rest of the motion does not keep."""
    growth = Forecast(1e6)
    bounds = Limits(memory=1e9)
    for size in (1e7, 5e7, 1.2e8):
        bounds.check_growth("the motion", growth, 0.0001 * size / 1e7, size)
    bounds.check_growth("the motion", growth, 0.9, 1.3e8)


def test_sizes_and_times_are_printed_with_units():
    assert in_bytes(2.5e9) == "2.5 GB"
    assert in_bytes(12) == "12 bytes"
    assert in_time(0.25) == "0.25 s"
    assert in_time(90) == "1.5 minutes"
    assert in_time(3600) == "60 minutes"
    assert in_time(1e7) == "116 days"


def test_a_slow_part_of_a_run_does_not_end_it(monkeypatch):
    """A third of the work is done at once, and then nothing for 10 s of the 3600 s allowed."""
    set_clock(monkeypatch, [0.0, 0.1, 2.0, 4.0, 6.0, 10.0, 61.0])
    report = Limits().timed("a run")
    for share in (0.3, 0.33, 0.33, 0.33, 0.33):
        report(share)
    with pytest.raises(TooMuchError):
        report(0.33)


@pytest.mark.parametrize(
    ("limits", "sentence"),
    [
        ((math.nan,), "seconds must be a positive number, or infinity; got nan"),
        ((1.0, math.nan), "memory must be a positive number, or infinity; got nan"),
        ((0,), "seconds must be a positive number, or infinity; got 0"),
        ((1.0, -1e9), "memory must be a positive number"),
        (("a",), "seconds must be a number; got 'a'"),
        ((None,), "seconds must be a number; got None"),
    ],
)
def test_limits_that_are_no_positive_numbers_are_refused(limits, sentence):
    with pytest.raises(ParameterError, match=sentence):
        Limits(*limits)
