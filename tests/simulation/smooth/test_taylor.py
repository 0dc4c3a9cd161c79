"""Runs by Taylor series: long ones in parts, optimised by the number of their steps alone."""

import re
from dataclasses import dataclass, replace

import numpy as np
import pytest

from twolink.arithmetic import sqrt
from twolink.chain import Chain
from twolink.effects import Effect
from twolink.effects.gravity import Gravity
from twolink.errors import IntegrationError, SimulationError
from twolink.integration.precisions import OPTIMISED, PRECISIONS
from twolink.loads import Torque
from twolink.scene import Scene
from twolink.simulation.smooth.judging import apart
from twolink.simulation.smooth.taylor import taylor_run

SCENE = Scene(Chain.uniform_bars(), (0.3, 0.5), (0.2, -0.1), 5.0, (Gravity(),))
TIMES = np.linspace(0, 5, 41)


def check_often(monkeypatch, precision):
    """Check signals and progress every 7 steps."""
    often = replace(PRECISIONS[precision], steps_at_once=7)
    monkeypatch.setitem(PRECISIONS, precision, often)


def run(scene=SCENE, **options):
    return taylor_run(scene, TIMES, formulation="momenta", **options)


@pytest.mark.slow_but_first
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


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_part_may_end_at_a_time_of_the_grid_but_for_a_rounding(precision, monkeypatch):
    """A hundred steps of 1e-3 s end before 0.1 s by less than a rounding."""
    often = replace(PRECISIONS[precision], steps_at_once=100)
    monkeypatch.setitem(PRECISIONS, precision, often)
    scene, times = replace(SCENE, duration=0.2), np.linspace(0.0, 0.2, 3)
    found = taylor_run(
        scene, times, formulation="momenta", precision=precision, order=9, longest_step=1e-3
    )
    assert found.steps in (200, 201)
    whole = taylor_run(scene, times, formulation="momenta", precision=precision, order=15)
    assert abs(np.asarray(found.q - whole.q, float)).max() <= 1e-13


def test_progress_of_a_run_in_parts(monkeypatch):
    check_often(monkeypatch, "double")
    reports = []
    run(progress=reports.append)
    assert len(reports) > 2
    assert reports == sorted(reports)
    assert 0 < reports[0] < reports[-1] <= 1


@pytest.mark.slow
def test_optimisation_of_a_run_does_not_depend_on_earlier_runs(monkeypatch):
    """Optimised code rounds otherwise, so its use may not depend on the past."""
    check_often(monkeypatch, "double")
    quick = replace(PRECISIONS["double"].codes[0], steps=20)
    codes = quick, OPTIMISED
    monkeypatch.setitem(PRECISIONS, "double", replace(PRECISIONS["double"], codes=codes))
    first = run()
    assert first.code == OPTIMISED
    assert taylor_run(SCENE, TIMES[:2], formulation="momenta").code == quick
    again = run()
    assert (again.q == first.q).all()
    assert again.compile_seconds < 0.05


def ladder(*steps):
    """Return codes of which each is left after a number of steps."""
    return tuple(replace(PRECISIONS["double"].codes[0], steps=each) for each in steps)


@pytest.mark.parametrize(("limits", "used"), [((1000, 2000), 0), ((20, 1000), 1), ((7, 14), 2)])
def test_a_run_of_too_many_steps_for_its_code_begins_anew_with_the_next(monkeypatch, limits, used):
    codes = (*ladder(*limits), replace(PRECISIONS["double"].codes[0], compact=True))
    own = replace(PRECISIONS["double"], codes=codes, steps_at_once=7)
    monkeypatch.setitem(PRECISIONS, "double", own)
    begun = []
    found = run(observe=lambda steps: begun.append(steps.starts[0]))
    assert found.code == codes[used]
    assert begun.count(0.0) == used + 1
    assert run(code=codes[used]).code == codes[used]


@pytest.mark.parametrize("observed", [False, True])
@pytest.mark.parametrize("precision", PRECISIONS)
def test_the_ends_of_steps_are_known(precision, observed):
    observe = (lambda steps: None) if observed else None
    found = run(precision=precision, order=15, visit=np.array([0.05, 0.1]), observe=observe)
    visited = found.visited
    assert np.array_equal(found.q, run(precision=precision, order=15).q)
    assert {0.05, 0.1, *TIMES} == set(visited.times)
    expected = found.step_times()[:-1] if observed else found.step_times()[1:]
    assert np.array_equal(visited.ends, expected)
    assert visited.exact == (precision == "double")
    at_ends = np.concatenate(found.dense()(visited.ends))
    # The times of integrators have more digits than float64, and accelerations are up to 30 rad/s².
    assert apart(at_ends, visited.at_ends).max() <= 30 * np.spacing(5.0)


def test_bare_runs_do_not_know_the_ends_of_their_steps():
    assert run().visited is None


def test_dense_output_repeats_the_run(monkeypatch):
    check_often(monkeypatch, "double")
    found = run()
    for dense in (found.dense(), replace(found, compiled=None).dense()):
        q, u = dense(TIMES[::-1])
        assert (q[:, ::-1] == found.q).all()
        assert (u[:, ::-1] == found.u).all()
    q, _ = found.dense()([2.0, 2.0, 1.0])
    assert (q[:, 0] == q[:, 1]).all()


@dataclass(frozen=True)
class Kinked(Effect):
    """Drag −u1 |u1|, which has no second derivative at rest."""

    def loads(self, chain, q, u, t=0.0):
        return (Torque(1, -u[0] * sqrt(u[0] * u[0])),)


@dataclass(frozen=True)
class Ending(Effect):
    """A torque that is not real beyond a speed (rad/s)."""

    last: float

    def loads(self, chain, q, u, t=0.0):
        return (Torque(1, 3.0 * sqrt(self.last - u[0])),)


KINKED = replace(SCENE, u=(0.0, 0.0), effects=(Kinked(),))
ENDING = replace(SCENE, u=(0.0, 0.0), effects=(Ending(0.25),))

NOT_FINITE = (
    r" s \(the state, a load or a derivative of a load by time is not finite there\);"
    r" it must stay finite, and its loads smooth, until 5 s$"
)
BEYOND = "^the motion could not be integrated beyond "


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_kink_at_the_start_ends_a_run_there(precision):
    with pytest.raises(IntegrationError, match=f"{BEYOND}0{NOT_FINITE}"):
        run(KINKED, precision=precision)


@pytest.mark.parametrize("often", [False, True])
@pytest.mark.parametrize("observe", [None, lambda steps: None])
def test_the_time_that_a_run_has_reached_is_known(often, observe, monkeypatch):
    """heyoka loses it where the coefficients of a step are not finite."""
    if often:
        check_often(monkeypatch, "double")
    with pytest.raises(IntegrationError, match=f"{BEYOND}([0-9.]+){NOT_FINITE}") as caught:
        run(ENDING, observe=observe)
    reached = float(re.match(f"{BEYOND}([0-9.]+)", str(caught.value))[1])
    before = taylor_run(ENDING, np.array([0.0, 0.999 * reached]), formulation="momenta")
    assert 0.249 < before.u[0, -1] < 0.25


@pytest.mark.parametrize(
    "torque",
    [
        lambda u, t: sqrt(-1 - u[0] * u[0]),
        lambda u, t: sqrt(0.25 - t),
        lambda u, t: 1 / (t - 2.5),
        lambda u, t: 1 / (0.0 * u[0]),
    ],
)
def test_loads_that_are_not_finite_at_the_start_are_one_sentence(torque):
    @dataclass(frozen=True)
    class Undefined(Effect):
        def loads(self, chain, q, u, t=0.0):
            return (Torque(1, torque(u, t)),)

    sentence = "^accelerations at the start must be finite in float64, under the loads at all times"
    with pytest.raises(SimulationError, match=sentence):
        run(replace(SCENE, effects=(Undefined(),)))
