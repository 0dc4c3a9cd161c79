"""Tables of studies at 80 columns: every number whole."""

import re

import pytest

from tests.test_tables import printed
from twolink.accuracy.drift import energy_drift
from twolink.accuracy.study import study
from twolink.accuracy.tables import (
    choices_table,
    configurations_table,
    drifts_table,
    events_table,
    time_in_words,
)
from twolink.scene import Scene
from twolink.tables import length

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def found():
    return study(Scene.load("drop"), methods=("taylor",), budget=0.5)


def test_tables_of_a_study_at_80_columns(found):
    for made in (choices_table(found), configurations_table(found.configurations)):
        text = printed(made, 80)
        assert max(length(line.rstrip()) for line in text.splitlines()) <= 80
        assert "…" not in text
    for line in found.configurations:
        assert f"{line.best:.1e}" in printed(configurations_table(found.configurations), 80)
    text = printed(events_table(found), 80)
    for point in found.points:
        if point.events is not None and not point.failed:
            assert f"{point.error:.1e}" in text
    assert "…" not in text


def test_a_method_without_budget_is_distinguished_from_one_that_fails():
    measured = study(Scene.load("free_fall"), methods=("rk4",), budget=0.1)
    (line,) = measured.configurations
    assert measured.work_precision.stopped
    assert line.stopped
    assert line.why_no_time == "budget ended"
    assert "budget ended" in printed(configurations_table(measured.configurations), 80)
    (note,) = measured.work_precision.notes
    assert re.match(r"Stopped by the time budget \(--budget\): rk4 on momenta at step ", note)


def test_the_drift_table_at_80_columns():
    found = energy_drift(Scene.load("small_swings"), seconds=200.0, methods=("rk4",))
    text = printed(drifts_table(found.drifts), 80)
    assert f"{found.drifts[0].errors[-1]:.1e}" in text
    assert max(length(line.rstrip()) for line in text.splitlines()) <= 80


def test_times_have_a_unit_and_a_mark():
    assert time_in_words(2e-5) == "20 µs"
    assert time_in_words(0.0123, repeatable=False) == "12.3 ms ±"
    assert time_in_words(4.0) == "4 s"
