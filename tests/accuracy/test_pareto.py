import math
from dataclasses import replace

import pytest

from twolink.accuracy.pareto import (
    choices,
    measured_order,
    operations_at,
    pareto_front,
    seconds_at,
)
from twolink.accuracy.work_precision import Point
from twolink.integration.operations import Extent


def point(
    error,
    seconds,
    *,
    configuration="a",
    parameter="step",
    setting=0.1,
    steps=100,
    failed="",
    arithmetic=None,
    extent=Extent.COUNTED,
):
    return Point(
        engine="twolink",
        configuration=configuration,
        method=configuration,
        equations="momenta",
        precision="double",
        order=4,
        parameter=parameter,
        setting=setting,
        error=error,
        seconds=seconds,
        spread=1.0,
        repeats=3,
        compile_seconds=0.0,
        steps=steps,
        evaluations=None,
        operations=None,
        failed=failed,
        arithmetic=arithmetic,
        extent=extent,
    )


def test_the_front_is_pareto_optimal():
    cheap, good, beaten, best = point(1e-2, 1), point(1e-5, 2), point(1e-4, 3), point(1e-9, 4)
    broken = point(math.nan, math.nan, failed="left the numbers")
    assert pareto_front([best, beaten, good, broken, cheap]) == (cheap, good, best)


def test_of_two_equally_fast_points_the_more_accurate_is_on_the_front():
    worse, better = point(1e-3, 1), point(1e-4, 1)
    assert pareto_front([worse, better]) == (better,)


def test_the_cost_of_the_next_digit_is_interpolated():
    """From 2 to 6 digits in 16 times the time: each of the four digits doubles it."""
    found = choices([point(1e-2, 1.0), point(1e-6, 16.0)])
    assert [choice.digits for choice in found] == [1, 2, 3, 4, 5, 6]
    assert found[0].next_digit == pytest.approx(2.0, rel=1e-12)
    assert found[1].point.seconds == 1.0
    assert found[2].point.seconds == 16.0
    assert found[-1].next_digit is None


def test_without_points_there_are_no_choices():
    assert choices([]) == ()
    assert choices([point(math.nan, math.nan, failed="x")]) == ()


def test_the_order_is_the_slope():
    errors = [point(3.0 / n**4, n, steps=n) for n in (10, 20, 40, 80, 160)]
    assert measured_order(errors, roundoff_floor=0.0) == pytest.approx(4.0, rel=1e-12)


def test_the_order_is_not_measured_in_rounding_nor_far_from_the_limit():
    coarse = [point(1.0, n, steps=n) for n in (1, 2, 4)]
    rounded = [point(1e-9, n, steps=n) for n in (1000, 2000, 4000)]
    inside = [point(1e2 / n**2, n, steps=n) for n in (200, 400, 800)]
    assert measured_order([*coarse, *inside, *rounded], roundoff_floor=1e-9) == pytest.approx(2.0)
    assert measured_order([*coarse, *rounded], roundoff_floor=1e-9) is None
    assert measured_order([replace(p, order=None) for p in inside], roundoff_floor=0.0) is None


def test_the_time_at_an_error_is_interpolated():
    points = [point(1e-6, 1.0), point(1e-10, 4.0)]
    assert seconds_at(points, 1e-8) == pytest.approx(2.0)
    assert seconds_at(points, 1e-10) == pytest.approx(4.0)
    assert seconds_at(points, 1e-11) is None


def test_an_error_reached_by_chance_is_ignored():
    points = [point(1e-6, 1.0), point(1e-9, 1.5), point(1e-7, 2.0), point(1e-10, 4.0)]
    assert seconds_at(points, 1e-8) > 2.0
    assert seconds_at(points[:3], 1e-8) is None


def test_operations_at_an_error_are_interpolated_as_times_are():
    points = [point(1e-6, 1.0, arithmetic=1e3), point(1e-10, 4.0, arithmetic=1e5)]
    assert operations_at(points, 1e-8) == pytest.approx(1e4)
    assert operations_at(points, 1e-11) is None
    failed = point(math.nan, math.nan, failed="left the numbers")
    assert operations_at([failed, *points], 1e-8) == pytest.approx(1e4)
    assert operations_at([*points, point(1e-12, 8.0)], 1e-8) is None
