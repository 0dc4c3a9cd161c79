import json
import math
import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from twolink.accuracy.front import measured_order
from twolink.accuracy.study import study
from twolink.accuracy.truth import judging_times, largest_difference, truth
from twolink.accuracy.ways import Outcome, Way, own_ways
from twolink.accuracy.work_precision import work_precision
from twolink.cli import app
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.shipped import shipped
from twolink.simulation import simulate
from twolink.simulation.smooth import numeric
from twolink.simulation.smooth.fixed_step import FIXED_STEP
from twolink.simulation.smooth.numeric import SCIPY

SCENES = shipped("scenes")
GENERAL = Scene.load(SCENES / "general.toml")
# The published reference of `general.toml`: its inputs taken as their float64 numbers, exactly.
END = (
    "0.63169544965324369677714",
    "14.846153572263320406222",
    "1.6832078686201083588420",
    "7.1716794367334515948596",
)


def constant(seconds):
    """Return a way that does nothing, in a time (s) that it takes from an iterator."""

    def run(setting, times):
        return Outcome(np.zeros((2, 2)), np.zeros((2, 2)), next(seconds), 0.0, 1, 1)

    return Way("theirs", "constant", "", "double", 1, "step", (1.0,), run)


def test_the_truth_is_the_published_one():
    exact = truth(GENERAL, judging_times(GENERAL))
    kind = heyoka().real128
    for found, text in zip((*exact.q[:, -1], *exact.u[:, -1]), END, strict=True):
        assert abs(found - kind(text)) < 1e-21


def test_nothing_is_compared_with_itself():
    """The truth is written with other equations than anything that it judges in 113 bits."""
    times = judging_times(GENERAL)
    exact = truth(GENERAL, times)
    (own,) = (way for way in own_ways(GENERAL) if way.precision == "quadruple")
    assert own.equations != "kane"
    outcome = own.run(41, times)
    assert 0 < largest_difference(exact, outcome.q, outcome.u) < 1e-25


def test_all_methods_and_equations_are_there():
    names = {way.name for way in own_ways(GENERAL)}
    for method in (*SCIPY, *FIXED_STEP, "taylor"):
        assert f"{method} on momenta" in names
    for equations in ("lagrange", "kane"):
        assert {f"taylor on {equations}", f"DOP853 on {equations}"} <= names
    assert {"taylor, long double on momenta", "taylor, quadruple on momenta"} <= names


# A gentle motion, on which the low orders come into their own within reason.
GENTLE = replace(GENERAL, q=(1.3, 1.8), u=(0.0, 0.0), duration=4.0)


@pytest.mark.slow
def test_the_slope_of_fixed_steps_is_the_declared_order():
    found = study(GENTLE, methods=tuple(FIXED_STEP), budget=60.0)
    assert len(found.ways) == len(FIXED_STEP)
    for line in found.ways:
        assert line.measured is not None, line
        assert abs(line.measured - line.declared) <= 0.2, line


@pytest.mark.parametrize(
    ("method", "q", "steps"),
    [("DOP853", (1.5, 1.65), 10), ("RK45", (1.3, 1.8), 160), ("Radau", (1.5, 1.65), 60)],
)
def test_the_slope_of_scipys_methods_is_the_declared_order_at_constant_steps(method, q, steps):
    """With a tolerance as the knob no two runs spread their steps alike, and errors scatter."""
    scene = replace(GENTLE, q=q)
    rates = numeric._rates(GENTLE.equipped, GENTLE.effects, "lagrange")
    # Radau solves its equations as well as it is asked to err; others never meet their tolerance.
    tolerance = 1e-11 if method == "Radau" else 1e3

    def run(step, times):
        # A little more, so that rounding leaves no sliver of a step at the end.
        step *= 1 + 1e-12
        found = solve_ivp(
            rates,
            (0.0, scene.duration),
            [*scene.q, *scene.u],
            method=method,
            max_step=step,
            first_step=step,
            rtol=tolerance,
            atol=1e-6 if method == "Radau" else tolerance,
        )
        ends = found.y[:, [0, -1]]
        return Outcome(ends[:2], ends[2:], 1e-6, 0.0, len(found.t) - 1, found.nfev)

    ladder = tuple(1 / (steps * 2**k) for k in range(3))
    way = Way("scipy", method, "", "double", SCIPY[method], "step", ladder, run)
    found = work_precision(scene, (way,), budget=30.0)
    assert [point.steps for point in found.points] == [4 * steps * 2**k for k in range(3)]
    measured = measured_order(found.points, floor=1e-15)
    assert abs(measured - SCIPY[method]) <= 0.2, (measured, [p.error for p in found.points])


@pytest.mark.parametrize("method", ["RK45", "DOP853"])
def test_a_tolerance_scatters_the_slope_but_not_by_much(method):
    longer = replace(GENTLE, duration=20.0)
    (line,) = study(longer, methods=(method,), budget=10.0).ways[:1]
    assert abs(line.measured - line.declared) <= 1.5, line


def test_a_failure_is_a_row_not_a_gap():
    def fails(setting, times):
        if setting > 2:
            raise FloatingPointError("too coarse\nfor anything")
        left = np.nan if setting > 1 else 0.0
        return Outcome(np.full((2, 2), left), np.zeros((2, 2)), 1e-6, 0.0, 1, 1)

    way = Way("theirs", "fails", "", "double", 1, "step", (4.0, 3.0, 2.0, 1.0), fails)
    found = work_precision(GENERAL, (way,), budget=1.0)
    assert [point.setting for point in found.points] == [4.0, 3.0, 2.0, 1.0]
    raised, _, not_finite, fine = found.points
    assert raised.failed == "FloatingPointError: too coarse"
    assert "not finite" in not_finite.failed
    assert math.isnan(raised.error)
    assert math.isnan(not_finite.seconds)
    assert not fine.failed
    assert fine.error > 1


def test_what_is_not_repeatable_is_marked():
    uneven = constant(iter([1e-3] * 3 + [5e-3] * 20))
    (point,) = work_precision(GENERAL, (uneven,), budget=1.0).points
    assert point.repeats > 1
    assert point.spread == pytest.approx(5.0)
    assert not point.repeatable


def test_what_the_budget_left_out_is_said():
    def slow(setting, asked):
        time.sleep(0.05)
        return Outcome(np.zeros((2, 2)), np.zeros((2, 2)), 0.05, 0.0, 1, 1)

    way = Way("theirs", "slow", "", "double", 1, "step", tuple(0.5**k for k in range(30)), slow)
    found = work_precision(GENERAL, (way,), budget=0.5)
    assert len(found.points) < 30
    assert "the budget ended at step" in found.left_out[0]


def test_a_study_recommends_taylor_and_knows_where_double_ends():
    found = study(GENERAL, methods=("taylor", "DOP853"), budget=30.0)
    assert found.recommendation.startswith("Take taylor on")
    assert "quadruple" in found.recommendation
    # Rounding at every step, each grown by no more than the whole motion grows a first difference.
    nearby = replace(GENERAL, q=(GENERAL.q[0] + 1e-9, GENERAL.q[1]))
    ends = [truth(scene, judging_times(scene)) for scene in (GENERAL, nearby)]
    growth = largest_difference(ends[0], ends[1].q, ends[1].u) / 1e-9
    assert 2.0**-52 < found.floor.error < 500 * 2.0**-52 * growth
    until, measured = found.floor.held_until(3)
    assert until > GENERAL.duration
    assert not measured
    document = json.loads(json.dumps(found.document()))
    assert {point["way"] for point in document["points"]} >= {"taylor on momenta"}
    assert found.csv().count("\n") == len(found.points) + 1


@pytest.mark.slow
def test_simulate_takes_by_default_what_was_measured_to_be_cheapest():
    found = study(GENERAL, methods=("taylor", "LSODA"), budget=30.0)
    for digits in (4, 8, 13):
        cheapest = next(c.point for c in found.choices if c.digits == digits)
        trajectory = simulate(GENERAL, accuracy=10.0**-digits)
        assert trajectory.met
        assert (trajectory.method, trajectory.precision) == (cheapest.method, cheapest.precision)


def test_across_events_time_and_integration_are_apart():
    scene = Scene.load(SCENES / "bounce_to_rest.toml")
    found = study(scene, budget=3.0)
    coarse, fine = (
        next(p for p in found.points if p.way == "taylor on lagrange" and p.setting == order)
        for order in (13, 21)
    )
    assert coarse.events.matched > 30
    assert coarse.events.time > 100 * fine.events.time
    assert coarse.events.approach > 100 * fine.events.approach
    assert coarse.error > 100 * fine.error


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--budget", "-1"], "--budget is -1; allowed is a positive number of seconds"),
        (["--methods", "euler"], "method is 'euler'; allowed for this scene are taylor, DOP853"),
        (["--out", "README.md"], "--out is README.md; allowed is a folder"),
    ],
)
def test_bad_input_is_one_sentence(arguments, sentence):
    result = CliRunner().invoke(app, ["accuracy", str(SCENES / "general.toml"), *arguments])
    assert result.exit_code == 2
    assert sentence in result.output
    assert "Traceback" not in result.output


def test_a_scene_with_modes_has_taylor_alone():
    result = CliRunner().invoke(
        app, ["accuracy", str(SCENES / "stick_slip.toml"), "--methods", "rk4"]
    )
    assert result.exit_code == 2
    assert "allowed for this scene are taylor" in result.output
