"""Bounded work: runs of too much time or memory are refused with an estimate."""

import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.simulation.hybrid import BOUNCES
from twolink.accuracy.drift import energy_drift
from twolink.accuracy.enclosure import enclosure
from twolink.accuracy.method_configurations import own_configurations
from twolink.accuracy.reference import reference
from twolink.accuracy.roundoff_floor import roundoff_floor
from twolink.accuracy.study import study
from twolink.accuracy.work_precision import work_precision
from twolink.chain import Chain
from twolink.cli import app
from twolink.data import data_path
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.errors import IntegrationError, SimulationError, TooMuchError, TwolinkError
from twolink.inputs import LEAST_DURATION
from twolink.limits import UNLIMITED, Budget, Limits
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.effects_cost import effects_cost
from twolink.simulation.hybrid.effort import Effort
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.motion import motion_run
from twolink.simulation.trajectory import Trajectory
from twolink.variations.sensitivity import sensitivity

FALL = Scene(Chain.uniform_bars(), (0.3, 0.5), (0.0, 0.0), 1.0, (Gravity(),))
DIVERGING = replace(FALL, duration=60.0, effects=(Gravity(), PdControl((0.0, 0.0), (-50.0, -50.0))))
DRIVEN = replace(
    FALL,
    effects=(
        JointTorque(amplitude=(5.0, 2.0), frequency=(3.0, 2.0)),
        JointFriction((1.0, 0.5), (1.2, 0.6)),
    ),
)
SHIPPED_STOPS = Scene.load(data_path("scenes") / "joint_stops.toml")
SWINGS = Scene.load(data_path("scenes") / "small_swings.toml")
STOPS = replace(FALL, effects=(Gravity(), JointStop("B", -1.0, 1.0, 1.0)))


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene",
    [
        replace(FALL, duration=1e308),
        pytest.param(replace(SHIPPED_STOPS, duration=1e6), marks=pytest.mark.slow),
    ],
    ids=["1e308 s", "1e6 s of stops"],
)
def test_an_excessive_duration_is_refused(scene):
    with pytest.raises(
        TooMuchError, match=r"the motion over .* s would take .* of (computing|memory)"
    ):
        simulate(scene)


@pytest.mark.slow
@pytest.mark.parametrize(
    "method", ["taylor", pytest.param("DOP853", marks=pytest.mark.slow), "rk4"]
)
def test_control_that_diverges_is_refused_soon(method):
    """Which message comes first depends on the speed of the machine."""
    sentence = r"would take .* of computing|could not be integrated|gives up|non-finite values"
    with pytest.raises(SimulationError, match=sentence) as caught:
        simulate(DIVERGING, method=method, accuracy=1e-3, limits=Limits(seconds=60.0))
    assert "nan s" not in str(caught.value)


def test_the_shortest_duration_gives_finite_angles():
    found = simulate(replace(FALL, duration=LEAST_DURATION))
    assert np.isfinite(found.q).all()
    assert (np.diff(found.t) > 0).all()


def test_the_shortest_duration_is_measured_and_enclosed():
    scene = replace(FALL, duration=LEAST_DURATION)
    assert np.isfinite(roundoff_floor(scene).growth)
    assert enclosure(scene, 8, times=(5e-324,)).radius <= 1e-8
    assert study(scene, methods=("rk4",), engines=False, budget=0.01).points


def test_rest_without_effects():
    result = CliRunner().invoke(app, ["simulate", str(data_path("scenes") / "free_fall.toml")])
    assert result.exit_code == 0
    found = simulate(replace(FALL, q=(0.0, 0.0), effects=()))
    assert found.met
    assert not found.q.any()


@pytest.mark.slow
def test_memory_of_a_run_with_events_is_refused_with_an_estimate():
    scene = replace(DRIVEN, duration=3e5)
    with pytest.raises(TooMuchError, match=r"300000 s would take about .* of memory \(0\..% are"):
        hybrid_run(scene, np.linspace(0, 3e5, 3), limits=Limits(memory=20e6))


@pytest.mark.slow
def test_the_memory_of_a_run_is_estimated_rightly():
    """The estimate of a tenth of the run is near to all that the run has in the end."""
    scene = replace(DRIVEN, duration=100.0)
    run = hybrid_run(scene, np.array([0.0, 100.0]))
    size = sum(b.coefficients.nbytes for arc in run.arcs for b in arc.blocks)
    size += 4000 * len(run.arcs)
    hybrid_run(scene, np.array([0.0, 100.0]), limits=Limits(memory=size + 1))
    with pytest.raises(TooMuchError):
        hybrid_run(scene, np.array([0.0, 100.0]), limits=Limits(memory=size - 1))


@pytest.mark.parametrize("samples", [10**7, 10**12, 2**63 - 1])
def test_too_many_samples_are_refused_beforehand(samples):
    start = time.monotonic()
    with pytest.raises(TooMuchError, match=rf"^{samples} samples would take about .* of memory"):
        simulate(FALL, samples=samples)
    assert time.monotonic() - start < 1


def test_unlimited_lifts_the_limit_on_memory():
    with pytest.raises(TooMuchError):
        simulate(FALL, samples=1000, limits=Limits(memory=1e6))
    assert simulate(FALL, samples=1000, limits=UNLIMITED).met


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        ["verify", "--states", "99999999999999"],
        ["simulate", str(data_path("scenes") / "free_fall.toml"), "--samples", "999999999999"],
        [
            *["plot", str(data_path("scenes") / "free_fall.toml"), "--samples", "99999999999"],
            *["--kind", "angles", "--out", "never.svg"],
        ],
        ["accuracy", "free_fall", "--budget", "1e9", "--out", "never"],
        ["drift", "small_swings", "--seconds", "1e12", "--methods", "rk4", "--out", "never"],
        ["report", "long.toml", "--out", "never"],
    ],
)
def test_commands_refuse_with_an_estimate(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if "long.toml" in command:
        text = replace(FALL, duration=1e6).to_toml()
        (tmp_path / "long.toml").write_text(text, encoding="utf-8")
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 2
    assert " would take " in result.stderr
    assert "--force lifts it" in result.stderr
    assert result.stderr.count("\n") == 1
    assert not [path for path in tmp_path.iterdir() if path.name != "long.toml"]


@pytest.mark.parametrize(
    "command", ["simulate", "plot", "record", "view", "verify", "reference", "accuracy", "drift",
                "report"]
)  # fmt: skip
def test_every_command_without_bounds_of_its_own_takes_force(command):
    """`hardcases` bounds each case by itself; `scenes` and `urdf` do no long work."""
    assert "--force" in CliRunner().invoke(app, [command, "--help"]).stdout


def test_force_lifts_the_limits(monkeypatch):
    """Work that is refused by default runs with --force."""
    asked = []

    def study(scene, **options):
        asked.append(options["limits"])
        raise TooMuchError("enough")

    monkeypatch.setattr("twolink.accuracy.study.study", study)
    for words in ([], ["--force"]):
        CliRunner().invoke(app, ["accuracy", "free_fall", *words])
    assert asked == [Limits(), UNLIMITED]


def test_without_limits_a_motion_has_any_number_of_modes(monkeypatch):
    """Two bounces, and the modes between, where the work of one step is the limit."""
    monkeypatch.setattr("twolink.simulation.hybrid.effort._grown", lambda *limits: 1)
    limited = simulate(BOUNCES)
    assert limited.t[-1] < BOUNCES.duration
    assert "within the limit of work (--force lifts it, and limits=UNLIMITED" in limited.failure
    assert simulate(BOUNCES, limits=UNLIMITED).met


def test_other_runs_and_stored_motions_have_any_number_of_modes(monkeypatch, tmp_path):
    """A stored motion is repeated for values between its samples."""
    file = tmp_path / "bounces.npz"
    whole = simulate(BOUNCES)
    whole.save(file)
    monkeypatch.setattr("twolink.simulation.hybrid.run.DEFAULT_EFFORT", Effort(jumps=1))
    times = [0.0, BOUNCES.duration]
    with pytest.raises(IntegrationError, match="within the limit of work"):
        motion_run(BOUNCES, times, formulation="lagrange")
    run = motion_run(BOUNCES, times, formulation="lagrange", limits=UNLIMITED)
    assert run.q[:, -1] == pytest.approx(whole.q[:, -1], abs=1e-9)
    assert Trajectory.load(file).at([1.7])[0] == pytest.approx(whole.at([1.7])[0], abs=1e-12)


def test_a_note_says_where_longer_numbers_were_not_tried(monkeypatch):
    monkeypatch.setattr("twolink.simulation.hybrid.measure.most_work", lambda duration: 10)
    limited = simulate(BOUNCES, accuracy=1e-16)
    assert not limited.met
    words = "Runs in 113 bits, which may meet the accuracy, would exceed the limit of work (--force"
    assert any(note.startswith(words) for note in limited.notes)
    assert not any("113 bits" in note for note in simulate(BOUNCES).notes)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    "bounded",
    [
        lambda limits: study(replace(FALL, duration=1e6), budget=1.0, limits=limits),
        lambda limits: energy_drift(SWINGS, seconds=1e12, methods=("taylor-11",), limits=limits),
        lambda limits: energy_drift(SWINGS, seconds=1e12, methods=("rk4",), limits=limits),
        lambda limits: effects_cost(replace(DIVERGING, duration=1e6), limits=limits),
        lambda limits: roundoff_floor(replace(FALL, duration=1e6), limits=limits),
    ],
    ids=["study", "drift of series", "drift of steps", "effects_cost", "roundoff_floor"],
)
def test_studies_notice_on_the_way_that_they_take_too_long(bounded, monkeypatch):
    monkeypatch.setattr("twolink.limits._WINDOW", 0.1)
    with pytest.raises(TooMuchError, match=r"would take .* of computing; the limit is"):
        bounded(Limits(seconds=6.0))


def test_a_method_that_takes_too_long_is_left_out_of_a_study():
    def slow(setting, times):
        raise TooMuchError("a run would take 9 days")

    (quick,) = (c for c in own_configurations(FALL) if c.name == "rk4 on momenta")
    quick, late = replace(quick, sweep=(0.1,)), replace(quick, method="late", run=slow)
    found = work_precision(FALL, (late, quick), budget=1.0)
    assert {point.method for point in found.points} == {"rk4"}
    assert found.left_out == ("late on momenta: a run would take 9 days",)
    with pytest.raises(TooMuchError, match="late on momenta: a run would take 9 days"):
        work_precision(FALL, (late,), budget=1.0)


def test_a_study_ends_where_the_limit_is_spent():
    configurations = own_configurations(FALL)[-2:]
    with pytest.raises(TooMuchError, match="are over"):
        work_precision(FALL, configurations, budget=1.0, limits=Limits(seconds=1e-9))


def test_a_reference_at_the_start():
    assert reference(FALL, 20, (0.0,)).states[0][0] == "0.29999999999999998890"
    stopped = reference(replace(STOPS, duration=0.1), 20, (0.0,))
    assert stopped.states[0][0] == "0.29999999999999998890"


@pytest.mark.parametrize(
    ("digits", "times", "words"),
    [
        ("60", None, "digits must be a whole number from 1 to 1000; got '60'"),
        (60.5, None, r"digits must be a whole number from 1 to 1000; got 60\.5"),
        (20, "0.5", "times must be a number of seconds, or a row of them; got '0.5'"),
        (20, (0.5, float("nan")), "times must increase from 0 to 1 s"),
    ],
)
def test_wrong_arguments_of_reference(digits, times, words):
    with pytest.raises(TwolinkError, match=words):
        reference(FALL, digits, times)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "busy"),
    [
        (["reference", "general.toml", "--digits", "900"], 8.0),
        (["reference", "general.toml", "--digits", "350", "--rigorous"], 12.0),
        (["simulate", "hours.toml", "--accuracy", "1e-13", "--force"], 3.0),
        (["verify", "--states", "99999999", "--force"], 3.0),
    ],
)
def test_ctrl_c_is_answered_within_a_second(options, busy, tmp_path):
    """And two more on a machine that is busy."""
    import signal

    shipped = data_path("scenes/general.toml").read_text(encoding="utf-8")
    (tmp_path / "general.toml").write_text(shipped, encoding="utf-8")
    hours = Scene.load(tmp_path / "general.toml")
    (tmp_path / "hours.toml").write_text(replace(hours, duration=1e4).to_toml(), encoding="utf-8")
    words = [str(tmp_path / word) if word.endswith(".toml") else word for word in options]
    program = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
    program += "from twolink.cli import main; main()"
    run = subprocess.Popen(
        [sys.executable, "-c", program, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    with run:
        time.sleep(busy)
        still_busy = run.poll() is None
        start = time.monotonic()
        run.send_signal(signal.SIGINT)
        _, errors = run.communicate(timeout=60)
        assert still_busy
        assert time.monotonic() - start < 3
    assert run.returncode == 130
    assert b"Traceback" not in errors


def test_a_chain_that_stays_at_rest_is_printed(tmp_path):
    """Its error is 0, which has no logarithm."""
    file = tmp_path / "rest.toml"
    file.write_text(replace(FALL, q=(0.0, 0.0), effects=()).to_toml(), encoding="utf-8")
    result = CliRunner().invoke(app, ["simulate", str(file)])
    assert result.exit_code == 0, result.output
    assert "0.0e+00 measured" in result.stdout


@pytest.mark.parametrize("apart", [0.0, 5e-324, 1e-200, 1e-18])
@pytest.mark.parametrize("u", [(0.0, 0.0), (0.0, 1e-199), (0.0, 0.5), (-1e-300, 5e-324)])
def test_no_event_or_impact_precedes_the_start(apart, u):
    """An event next to the start is at 0 or later, so that all times are within the run."""
    stop = JointStop("B", -1.0, 0.2, 0.5)
    effects = (Gravity(), JointFriction((0.1, 0.1), (0.2, 0.2)), stop)
    found = simulate(replace(FALL, q=(0.3, 0.5 - apart), u=u, duration=0.1, effects=effects))
    times = [entry.time for entry in (*found.events, *found.impacts)]
    assert times
    assert all(0.0 <= time <= 0.1 for time in times)
    work = sum(parts[-1] for parts in found.work().values())
    struck = [impact.kinetic_energy[0] for impact in found.impacts if impact.time == 0.0]
    before = struck[0] if struck else found.kinetic_energy[0]
    assert work == pytest.approx(found.kinetic_energy[-1] - before, abs=1e-9)


def derived(scene, **options):
    return sensitivity(scene, ["q1"], **options)


@pytest.mark.parametrize(
    ("compute", "effects"),
    [
        (simulate, (Gravity(),)),
        (simulate, (Gravity(), JointStop("B", -1.0, 1.0, 0.5))),
        (derived, (Gravity(),)),
    ],
)
def test_all_runs_of_a_call_have_one_limit(monkeypatch, compute, effects):
    """A limit that each run had of its own would be exceeded by all of them together."""
    budgets, timed = [], Budget.timed

    def counted(budget, progress=None):
        budgets.append(budget)
        return timed(budget, progress)

    monkeypatch.setattr(Budget, "timed", counted)
    compute(replace(FALL, duration=5.0, effects=effects), accuracy=1e-14)
    assert len(budgets) > 1
    assert len(set(map(id, budgets))) == 1


@pytest.mark.parametrize("compute", [simulate, derived])
def test_a_call_of_too_many_runs_is_ended(compute):
    """A motion of 100 s of chaos takes several runs, of which the first are short."""
    scene = Scene(Chain.uniform_bars(), (3.0, 3.0), (0.0, 0.0), 100.0, (Gravity(),), accuracy=1e-9)
    with pytest.raises(TooMuchError, match=r"over 100 s would take .*; the limit is 0\.5 s"):
        compute(scene, samples=5, limits=Limits(seconds=0.5))
