"""Runs by Taylor series: long ones in parts, optimised by the number of their steps alone."""

from dataclasses import replace

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.integration.precisions import PRECISIONS
from twolink.scene import Scene
from twolink.simulation.smooth import taylor
from twolink.simulation.smooth.taylor import taylor_run

SCENE = Scene(Chain.uniform_bars(), (0.3, 0.5), (0.2, -0.1), 5.0, (Gravity(),))
TIMES = np.linspace(0, 5, 41)


def check_often(monkeypatch, precision):
    """Check signals and progress every 7 steps."""
    often = replace(PRECISIONS[precision], steps_at_once=7)
    monkeypatch.setitem(PRECISIONS, precision, often)


def run(scene=SCENE, **options):
    return taylor_run(scene, TIMES, formulation="momenta", **options)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_run_in_parts_is_the_run_as_a_whole(precision, monkeypatch):
    """Only the time of a part's start is rounded, which a scene without clocks does not notice."""
    whole = run(precision=precision)
    check_often(monkeypatch, precision)
    parts = run(precision=precision)
    assert parts.steps == whole.steps > 20
    allowed = 64 * PRECISIONS[precision].rounding
    assert float(abs(parts.q - whole.q).max()) <= allowed
    assert float(abs(parts.u - whole.u).max()) <= 10 * allowed


def test_progress_of_a_run_in_parts(monkeypatch):
    check_often(monkeypatch, "double")
    reports = []
    run(progress=reports.append)
    assert len(reports) > 2
    assert reports == sorted(reports)
    assert 0 < reports[0] < reports[-1] <= 1


def test_optimisation_of_a_run_does_not_depend_on_earlier_runs(monkeypatch):
    """Optimised code rounds otherwise, so its use may not depend on the past."""
    check_often(monkeypatch, "double")
    monkeypatch.setattr(taylor, "_WORTH_OPTIMISING", 20)
    first = run()
    assert first.optimised
    assert not taylor_run(SCENE, TIMES[:2], formulation="momenta").optimised
    again = run()
    assert (again.q == first.q).all()
    assert again.compile_seconds < 0.05


def test_dense_output_repeats_the_run(monkeypatch):
    check_often(monkeypatch, "double")
    found = run()
    for dense in (found.dense(), replace(found, compiled=None).dense()):
        q, u = dense(TIMES[::-1])
        assert (q[:, ::-1] == found.q).all()
        assert (u[:, ::-1] == found.u).all()
    q, _ = found.dense()([2.0, 2.0, 1.0])
    assert (q[:, 0] == q[:, 1]).all()
