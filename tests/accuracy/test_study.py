import json
import math
import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from twolink.accuracy.method_configurations import (
    MeasuredRun,
    MethodConfiguration,
    own_configurations,
)
from twolink.accuracy.pareto import measured_order
from twolink.accuracy.reference_trajectory import (
    comparison_times,
    largest_difference,
    reference_trajectory,
)
from twolink.accuracy.study import study
from twolink.accuracy.work_precision import Stop, WorkPrecision, work_precision
from twolink.cli import app
from twolink.data import data_path
from twolink.integration.methods import METHODS, NUMERIC_METHODS
from twolink.integration.precisions import PRECISIONS
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth import numeric

SCENES = data_path("scenes")
GENERAL = Scene.load(SCENES / "general.toml")
# The published reference of `general.toml`: its inputs taken as their float64 numbers, exactly.
END = (
    "0.63169544965324369677714",
    "14.846153572263320406222",
    "1.6832078686201083588420",
    "7.1716794367334515948596",
)


def constant(seconds):
    """Return a configuration that does nothing, in a time (s) that it takes from an iterator."""

    def run(setting, times):
        return MeasuredRun(np.zeros((2, 2)), np.zeros((2, 2)), next(seconds), 0.0, 1, 1)

    return MethodConfiguration("theirs", "constant", "", "double", 1, "step", (1.0,), run)


@pytest.mark.slow
def test_the_reference_trajectory_is_the_published_one():
    exact = reference_trajectory(GENERAL, comparison_times(GENERAL))
    kind = heyoka().real128
    for found, text in zip((*exact.q[:, -1], *exact.u[:, -1]), END, strict=True):
        assert abs(found - kind(text)) < 1e-21


@pytest.mark.slow
def test_the_reference_has_other_equations_than_the_runs_in_quadruple():
    """The reference is written with other equations than anything that it judges in 113 bits."""
    times = comparison_times(GENERAL)
    exact = reference_trajectory(GENERAL, times)
    (own,) = (each for each in own_configurations(GENERAL) if each.precision == "quadruple")
    assert own.equations != "kane"
    result = own.run(41, times)
    assert 0 < largest_difference(exact, result.q, result.u) < 1e-25


def test_all_methods_and_equations_have_a_configuration():
    names = {each.name for each in own_configurations(GENERAL)}
    for method in METHODS:
        assert f"{method} on momenta" in names
    for equations in ("lagrange", "kane"):
        assert {f"taylor on {equations}", f"DOP853 on {equations}"} <= names
    assert {"taylor, long double on momenta", "taylor, quadruple on momenta"} <= names


@pytest.mark.slow
def test_taylor_series_run_through_the_discontinuities_of_a_torque():
    scene = Scene.load(SCENES / "sampled_torque.toml")
    series = [each for each in own_configurations(scene) if each.method == "taylor"]
    times = comparison_times(scene)
    exact = reference_trajectory(scene, times)
    assert {each.equations for each in series} == {"lagrange", "kane"}
    for each in series:
        found = each.run(each.sweep[-1], times)
        assert largest_difference(exact, found.q, found.u) < 1e-12


# A gentle motion, on which the low orders come into their own within reason.
GENTLE = replace(GENERAL, q=(1.3, 1.8), u=(0.0, 0.0), duration=4.0)


@pytest.mark.long
@pytest.mark.slow
def test_the_slope_of_fixed_steps_is_the_declared_order():
    methods = tuple(n for n, method in NUMERIC_METHODS.items() if method.parameter == "step")
    found = study(GENTLE, methods=methods, budget=20.0)
    assert len(found.configurations) == len(methods)
    for line in found.configurations:
        assert line.measured is not None, line
        assert abs(line.measured - line.declared) <= 0.2, line


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "q", "steps"),
    [("DOP853", (1.5, 1.65), 10), ("RK45", (1.3, 1.8), 160), ("Radau", (1.5, 1.65), 60)],
)
def test_the_slope_of_scipys_methods_is_the_declared_order_at_constant_steps(method, q, steps):
    """With a tolerance as parameter, step distributions differ between runs, and errors scatter."""
    scene = replace(GENTLE, q=q)
    formula = numeric._formula(GENTLE.moving_chain, GENTLE.effects, "lagrange")
    rates = numeric._rates(formula)
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
        return MeasuredRun(ends[:2], ends[2:], 1e-6, 0.0, len(found.t) - 1, found.nfev)

    sweep = tuple(1 / (steps * 2**k) for k in range(3))
    configuration = MethodConfiguration(
        "scipy", method, "", "double", NUMERIC_METHODS[method].order, "step", sweep, run
    )
    found = work_precision(scene, (configuration,), budget=30.0)
    assert [point.steps for point in found.points] == [4 * steps * 2**k for k in range(3)]
    measured = measured_order(found.points, roundoff_floor=1e-15)
    assert abs(measured - NUMERIC_METHODS[method].order) <= 0.2, (
        measured,
        [p.error for p in found.points],
    )


@pytest.mark.slow
@pytest.mark.parametrize("method", ["RK45", "DOP853"])
def test_a_tolerance_scatters_the_slope_but_not_by_much(method):
    longer = replace(GENTLE, duration=20.0)
    (line,) = study(longer, methods=(method,), budget=10.0).configurations[:1]
    assert abs(line.measured - line.declared) <= 1.5, line


@pytest.mark.slow
def test_a_failed_run_has_a_row_with_its_reason():
    def fails(setting, times):
        if setting > 2:
            raise FloatingPointError("too coarse\nfor anything")
        left = np.nan if setting > 1 else 0.0
        return MeasuredRun(np.full((2, 2), left), np.zeros((2, 2)), 1e-6, 0.0, 1, 1)

    configuration = MethodConfiguration(
        "theirs", "fails", "", "double", 1, "step", (4.0, 3.0, 2.0, 1.0), fails
    )
    found = work_precision(GENERAL, (configuration,), budget=1.0)
    assert [point.setting for point in found.points] == [4.0, 3.0, 2.0, 1.0]
    raised, _, not_finite, fine = found.points
    assert raised.failed == "FloatingPointError: too coarse"
    assert "not finite" in not_finite.failed
    assert math.isnan(raised.error)
    assert math.isnan(not_finite.seconds)
    assert not fine.failed
    assert fine.error > 1


@pytest.mark.slow
def test_irreproducible_times_are_marked():
    uneven = constant(iter([1e-3] * 3 + [5e-3] * 20))
    (point,) = work_precision(GENERAL, (uneven,), budget=1.0).points
    assert point.repeats > 1
    assert point.spread == pytest.approx(5.0)
    assert not point.repeatable


@pytest.mark.slow
def test_omissions_by_the_budget_are_reported():
    def slow(setting, asked):
        time.sleep(0.05)
        return MeasuredRun(np.zeros((2, 2)), np.zeros((2, 2)), 0.05, 0.0, 1, 1)

    configuration = MethodConfiguration(
        "theirs", "slow", "", "double", 1, "step", tuple(0.5**k for k in range(30)), slow
    )
    found = work_precision(GENERAL, (configuration,), budget=0.5)
    assert len(found.points) < 30
    assert found.stopped == (Stop("theirs slow", "step", found.points[-1].setting),)
    assert "Stopped by the time budget" in found.notes[0]


@pytest.mark.slow
def test_a_study_recommends_taylor_and_measures_the_round_off_floor():
    found = study(GENERAL, methods=("taylor", "DOP853"), budget=30.0)
    assert found.recommendation.startswith("Recommended: taylor on")
    assert "quadruple" in found.recommendation
    # Rounding at every step, each grown by no more than the whole motion grows a first difference.
    nearby = replace(GENERAL, q=(GENERAL.q[0] + 1e-9, GENERAL.q[1]))
    ends = [reference_trajectory(scene, comparison_times(scene)) for scene in (GENERAL, nearby)]
    growth = largest_difference(ends[0], ends[1].q, ends[1].u) / 1e-9
    assert 2.0**-52 < found.roundoff_floor.error < 500 * 2.0**-52 * growth
    until, measured = found.roundoff_floor.held_until(3)
    assert until > GENERAL.duration
    assert not measured
    document = json.loads(json.dumps(found.document()))
    assert {point["configuration"] for point in document["points"]} >= {"taylor on momenta"}
    assert found.csv().count("\n") == len(found.points) + 1


@pytest.mark.slow
def test_simulate_uses_the_cheapest_precision_by_default():
    """Or a shorter one, whose run is corrected."""
    precisions = list(PRECISIONS)
    found = study(GENERAL, methods=("taylor", "LSODA"), budget=30.0)
    for digits in (4, 8, 13):
        cheapest = next(c.point for c in found.choices if c.digits == digits)
        trajectory = simulate(GENERAL, accuracy=10.0**-digits)
        assert trajectory.met
        assert trajectory.method == cheapest.method
        if trajectory.recipe.evaluated_in is None:
            assert trajectory.precision == cheapest.precision
        else:
            shorter = precisions.index(trajectory.precision)
            assert shorter <= precisions.index(cheapest.precision)


@pytest.mark.slow
def test_across_events_time_and_integration_are_apart():
    scene = Scene.load(SCENES / "bounce_to_rest.toml")
    found = study(scene, budget=60.0)
    coarse, fine = (
        next(
            p
            for p in found.points
            if p.configuration == "taylor on lagrange" and p.setting == order
        )
        for order in (13, 21)
    )
    assert coarse.events.matched > 30
    assert coarse.events.time > 100 * fine.events.time
    assert coarse.events.approach > 100 * fine.events.approach
    assert coarse.error > 100 * fine.error


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--budget", "-1"], "--budget must be a positive number of seconds; got -1"),
        (["--methods", "euler"], "method, for this scene, must be one of taylor, DOP853"),
        (
            ["--out", "README.md"],
            "--out must be a folder that can be written to or made; got README.md",
        ),
    ],
)
def test_bad_input_is_one_sentence(arguments, sentence):
    result = CliRunner().invoke(app, ["accuracy", str(SCENES / "general.toml"), *arguments])
    assert result.exit_code == 2
    assert sentence in result.output
    assert "Traceback" not in result.output


def test_scenes_with_modes_accept_taylor_only():
    result = CliRunner().invoke(
        app, ["accuracy", str(SCENES / "stick_slip.toml"), "--methods", "rk4"]
    )
    assert result.exit_code == 2
    assert "method, for this scene, must be one of taylor" in result.output


def test_a_measurement_has_the_notes_of_its_motion():
    """Errors are those to one of the motions that the laws of impact admit."""
    scene = Scene.load(data_path("scenes") / "elbow_and_tip.toml")
    truth = reference_trajectory(scene, comparison_times(scene))
    assert truth.notes == simulate(scene).notes
    measured = WorkPrecision(scene, (), truth, "the end", left_out=("none was measured",))
    assert measured.notes == (*truth.notes, "none was measured")
