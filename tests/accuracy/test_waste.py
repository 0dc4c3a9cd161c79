"""The operations of each configuration, and how many of them are wasted."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.accuracy.test_pareto import point
from tests.test_tables import printed
from twolink.accuracy.method_configurations import MeasuredRun, MethodConfiguration
from twolink.accuracy.study import Study
from twolink.accuracy.tables import configurations_table
from twolink.accuracy.work_precision import WorkPrecision, _Measurement, work_precision
from twolink.cli import app
from twolink.environment import Load
from twolink.errors import TooMuchError
from twolink.integration.operations import Extent, Operations
from twolink.scene import Scene
from twolink.tables import length

GENERAL = Scene.load("general")


def configuration(name, *cells, extent=Extent.COUNTED):
    """Return the points of a configuration, of errors and operations."""
    return [
        point(error, 1e-3, configuration=name, steps=10**number, arithmetic=work, extent=extent)
        for number, (error, work) in enumerate(cells)
    ]


FRUGAL = configuration("frugal", (1e-4, 1e4), (1e-8, 1e5), (1e-12, 1e6))
COARSE = configuration("coarse and with a name that is very long", (1e-2, 1e6), (1e-4, 1e7))
ENGINE = configuration("engine", (1e-6, 1e8), (1e-8, 1e9), (1e-9, 2e9), extent=Extent.AT_MOST)
PARTLY = configuration("partly", (1e-8, 5e4), (1e-9, 1e5), extent=Extent.AT_LEAST)
USELESS = configuration("useless", (0.5, 1e6))


def study_of(*groups):
    points = tuple(each for group in groups for each in group)
    reference = SimpleNamespace(source="nothing")
    measured = WorkPrecision(GENERAL, points, reference, "the end")
    return Study(measured, SimpleNamespace(error=1e-15))


def test_operations_are_compared_at_the_error_of_each_line():
    lines = study_of(FRUGAL, COARSE, ENGINE, PARTLY, USELESS).configurations
    work = {line.configuration: line.work for line in lines}
    assert (work["frugal"].error, work["frugal"].operations) == (1e-8, 1e5)
    assert work["frugal"].ratio == 1
    assert work["engine"].ratio == pytest.approx(1e4)
    assert work["engine"].extent is Extent.AT_MOST
    # It ends at 1e-4, where the frugal one takes 1e4.
    (coarse,) = (each for name, each in work.items() if name.startswith("coarse"))
    assert coarse.error == 1e-4
    assert coarse.ratio == pytest.approx(1e3)
    # A lower bound is not the fewest.
    assert work["partly"].ratio == pytest.approx(0.5)
    assert work["useless"] is None


def test_lower_bounds_are_compared_with_each_other_alone():
    more = configuration("more", (1e-8, 1e5), (1e-9, 2e5), extent=Extent.AT_LEAST)
    ratios = {line.configuration: line.work.ratio for line in study_of(PARTLY, more).configurations}
    assert ratios == {"partly": 1, "more": pytest.approx(2)}


def test_the_most_wasteful_is_named():
    words = study_of(FRUGAL, COARSE, ENGINE, PARTLY).waste
    assert words == (
        "At an error of 1e-08 frugal takes the fewest floating-point operations, 1e+05, or "
        "1.2e+04 a digit. Of those counted coarse and with a name that is very long is the most "
        "wasteful: 1e+07 at an error of 1e-04, 1,000 times as many as are needed. Of those "
        "estimated engine is the most wasteful: at most 1e+09 at an error of 1e-08, up to "
        "10,000 times as many as are needed."
    )
    assert study_of(USELESS).waste == ""


def test_columns_of_operations_at_80_columns():
    lines = study_of(FRUGAL, COARSE, ENGINE, PARTLY, USELESS).configurations
    longest = [replace(line, stopped=True, ratio=123456.0) for line in lines]
    text = printed(configurations_table(longest), 80)
    assert max(length(line.rstrip()) for line in text.splitlines()) <= 80
    for cell in (
        "1.0e+05",
        "≤ 1.0e+09",
        "× 10,000",
        "1.0e+07 *",
        "× 1,000",
        "≥ 5.0e+04",
        "≥ × 0.5",
    ):
        assert cell in text
    assert "budget ended" in text
    assert "…" not in text


def test_json_and_csv_have_the_operations():
    found = study_of(FRUGAL, ENGINE)
    (line,) = (each for each in found.configurations if each.configuration == "engine")
    assert line.work.extent == "at most"
    header, first, *_ = found.csv().splitlines()
    cells = dict(zip(header.split(","), first.split(","), strict=True))
    assert (cells["arithmetic"], cells["extent"]) == ("10000.0", "counted")


def test_operations_that_are_not_counted_are_estimated_by_time_and_peak():
    tried = MethodConfiguration("theirs", "constant", "", "double", 1, "step", (1.0,), run_of(None))
    measured = _Measurement(tried, 1.0, error=1e-3, seconds=[2e-3])
    estimated = measured.point(5e9)
    assert (estimated.arithmetic, estimated.extent) == (pytest.approx(1e7), Extent.AT_MOST)
    assert measured.point(None).arithmetic is None
    measured.arithmetic = Operations(7, Extent.AT_LEAST)
    counted = measured.point(5e9)
    assert (counted.arithmetic, counted.extent) == (7, Extent.AT_LEAST)


def run_of(arithmetic):
    def run(setting, times):
        zeros = np.zeros((2, 2))
        return MeasuredRun(zeros, zeros, 1e-3, 0.0, 1, 1, arithmetic=arithmetic)

    return run


@pytest.mark.slow
@pytest.mark.parametrize("arithmetic", [None, Operations(7)])
def test_the_peak_is_measured_where_it_is_needed(arithmetic):
    run = run_of(arithmetic)
    tried = MethodConfiguration("theirs", "constant", "", "double", 1, "step", (1.0,), run)
    found = work_precision(GENERAL, (tried,), budget=0.5)
    assert (found.peak is None) is (arithmetic is not None)
    expected = 7 if arithmetic else pytest.approx(1e-3 * (found.peak or 0.0))
    assert found.points[0].arithmetic == expected


def asked(monkeypatch, load, *options):
    """Return the output of a measurement with other engines under a load; it ends at once."""

    def study(*arguments, **options):
        raise TooMuchError("the measurement has begun")

    monkeypatch.setattr("twolink.environment.load_of_machine", lambda: load)
    monkeypatch.setattr("twolink.accuracy.study.study", study)
    return CliRunner().invoke(app, ["accuracy", "general", *options])


def test_other_engines_are_not_timed_on_a_busy_machine(monkeypatch):
    result = asked(monkeypatch, Load(3.25, 2), "--engines")
    assert result.exit_code == 2
    assert "the load of the machine must be at most 1 to time other engines" in result.output
    assert "got 3.25" in result.output
    for load, *options in (
        (Load(3.25, 2), "--engines", "--busy"),
        (Load(3.25, 2),),
        (Load(0.5, 2), "--engines"),
        (None, "--engines"),
    ):
        assert "load of the machine" not in asked(monkeypatch, load, *options).output


@pytest.mark.slow
def test_the_load_and_the_waste_are_printed(monkeypatch):
    monkeypatch.setattr("twolink.environment.load_of_machine", lambda: Load(0.25, 2))
    monkeypatch.setattr("twolink.accuracy.work_precision.load_of_machine", lambda: Load(0.25, 2))
    arguments = ["accuracy", "general", "--methods", "rk4", "--budget", "0.5"]
    output = CliRunner().invoke(app, arguments).output
    assert "Load of the machine: 0.25 on 2 cores." in output
    assert "operations" in output
