import json
from dataclasses import replace
from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.accuracy.test_study import END
from tests.simulation.smooth.pulses import Detent, Kink
from tests.simulation.smooth.test_taylor import KINKED
from twolink.accuracy.multiprecision import precise_motion
from twolink.accuracy.reference import MOST_DIGITS_WITH_EVENTS, reference
from twolink.chain import Chain
from twolink.cli import app
from twolink.data import data_path
from twolink.effects import (
    EFFECTS,
    CompliantSurface,
    EndDrag,
    EndForce,
    Gravity,
    JointDamping,
    JointFriction,
    JointSpring,
    JointStop,
    JointTorque,
    MotorInertia,
    PdControl,
    SampledTorque,
    Surface,
    pieces_at,
)
from twolink.errors import IntegrationError, ParameterError, SimulationError, TwolinkError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.motion import motion_run

SCENES = data_path("scenes")
GENERAL = Scene.load(SCENES / "general.toml")
FAR = Surface((0.0, 5.0), (0.0, -1.0))
FILES = sorted(data_path("references").glob("*.json"))


@pytest.mark.slow
def test_sixty_digits_and_the_published_ones():
    found = reference(GENERAL, 60)
    assert found.digits == (60,)
    one, other = found.runs
    assert one.equations != other.equations
    assert one.bits != other.bits
    assert one.order != other.order
    for ours, published in zip(found.states[0], END, strict=True):
        assert len(ours.split(".")[1]) == 60
        # The published ones were computed in 256 bits, and may be off by one in the last digit.
        unit = Decimal(1).scaleb(Decimal(published).as_tuple().exponent)
        assert abs(Decimal(ours) - Decimal(published)) <= unit


@pytest.mark.slow
def test_references_of_different_digits_agree():
    short = replace(GENERAL, duration=1.0)
    few, many = reference(short, 20), reference(short, 90)
    for less, more in zip(few.states[0], many.states[0], strict=True):
        assert abs(Decimal(less) - Decimal(more)) <= Decimal("0.5e-20")


@pytest.mark.slow
def test_orders_are_odd():
    """From rest at q = 0 an order that is a multiple of four sees an endless step."""
    scene = replace(Scene.load(SCENES / "free_fall.toml"), duration=0.5)
    for digits in range(20, 32):
        found = reference(scene, digits)
        assert found.digits == (digits,)
        assert all(run.order % 2 for run in found.runs)


def test_a_reference_starts_from_the_exact_float64_numbers():
    found = reference(replace(GENERAL, duration=0.5), 60, (0.0, 0.5))
    for ours, given in zip(found.states[0], (*GENERAL.q, *GENERAL.u), strict=True):
        assert Decimal(ours) == Decimal(given)


@pytest.mark.slow
def test_digits_are_verified_only_by_agreement(monkeypatch):
    """A run that errs in the 31st digit takes all digits from there on."""
    from twolink.accuracy import reference as module

    right = module._precise

    def wrong(scene, grid, equations, digits, report):
        run = right(scene, grid, equations, digits, report)
        with localcontext() as context:
            context.prec = 100
            off = [tuple(value + Decimal("3e-31") for value in state) for state in run.states]
        return run._replace(states=off)

    short = replace(GENERAL, duration=0.5)
    tries = []

    def alternating(scene, grid, equations, digits, report):
        tries.append(digits)
        return (wrong if equations == "lagrange" else right)(scene, grid, equations, digits, report)

    monkeypatch.setattr(module, "_precise", alternating)
    assert reference(short, 25).digits == (25,)
    assert len(tries) == 2
    tries.clear()
    assert reference(short, 40).digits == (29,)
    # Disagreeing runs were repeated with more and more digits.
    assert len(tries) == 8
    assert min(tries[-2:]) > max(tries[:2])


@pytest.mark.slow
def test_across_events_the_number_of_digits_is_reported():
    scene = replace(Scene.load(SCENES / "bounce_to_rest.toml"), duration=2.0)
    found = reference(scene, MOST_DIGITS_WITH_EVENTS)
    assert 20 <= found.digits[0] <= MOST_DIGITS_WITH_EVENTS
    trajectory = simulate(scene, accuracy=1e-10)
    ends = (*trajectory.q[:, -1], *trajectory.u[:, -1])
    assert np.allclose([float(value) for value in found.states[0]], ends, rtol=0, atol=1e-10)


def test_with_events_the_digits_are_those_of_sixty():
    """Torques that are held are constant from sample to sample: so 60 digits can judge 113 bits."""
    scene = Scene.load(SCENES / "sampled_torque.toml")
    found = reference(scene, MOST_DIGITS_WITH_EVENTS, (0.2,))
    q, u = scene.q, scene.u
    for start, end in ((0.0, 0.1), (0.1, 0.2)):
        piece = replace(scene, effects=pieces_at(scene.effects, start))
        motion = precise_motion(piece, "momenta", 60)
        # All digits of the piece before, of which the start of a scene holds those of float64.
        q, u = tuple(map(motion.number, q)), tuple(map(motion.number, u))
        motion.integrator.state[:] = [*q, *motion.equations.from_speeds(motion.chain, q, u)]
        # Not 0.1 s: the difference of two float64 numbers, in all their digits.
        motion.integrator.propagate_until(
            motion.number(end) - motion.number(start), max_delta_t=motion.longest_step
        )
        q1, q2, *u = motion.speeds()
        q, u = (q1, q2), tuple(u)
    for ours, true in zip(found.states[0], (*q, *u), strict=True):
        assert abs(Decimal(ours) - Decimal(str(true))) <= Decimal("0.5e-28")


def test_with_events_more_of_the_agreement_is_held_back(monkeypatch):
    from twolink.accuracy import reference as module

    scene = replace(Scene.load(SCENES / "drop.toml"), duration=0.5)
    monkeypatch.setattr(module, "_agreement", lambda coarse, fine: 20)
    assert reference(scene, 28).digits == (17,)


@pytest.mark.parametrize(
    ("digits", "times", "sentence"),
    [
        (0, None, "digits must be a whole number from 1 to 1000; got 0"),
        (-3, None, "digits must be a whole number from 1 to 1000; got -3"),
        (5, (1.0, 1.0), "times must increase from 0 to 10 s; got 1, 1"),
        (5, (11.0,), "times must increase from 0 to 10 s; got 11"),
        (5, (10.0000001,), "times must increase from 0 to 10 s; got 10.0000001"),
        (5, (), "times must increase from 0 to 10 s; got an empty list"),
    ],
)
def test_invalid_requests_are_rejected_with_one_sentence(digits, times, sentence):
    with pytest.raises(TwolinkError, match=sentence):
        reference(GENERAL, digits, times)


def test_events_allow_fewer_digits():
    with pytest.raises(ParameterError, match="from 1 to 28, since its motion has events"):
        reference(Scene.load(SCENES / "stick_slip.toml"), 60)


@pytest.mark.slow
def test_the_command_writes_the_printed_digits(tmp_path):
    arguments = ["reference", str(SCENES / "general.toml"), "--digits", "30", "--times", "0.5,1"]
    for kind in ("json", "csv"):
        file = tmp_path / f"r.{kind}"
        result = CliRunner().invoke(app, [*arguments, "--out", str(file)])
        assert result.exit_code == 0, result.output
    document = json.loads((tmp_path / "r.json").read_text())
    last = document["states"][-1]
    assert last["t"] == "1.0"
    assert last["digits"] == 30
    assert last["q1"] in result.output
    assert float.fromhex(document["start"]["q1"]["hex"]) == GENERAL.q[0]
    assert (tmp_path / "r.csv").read_text().splitlines()[-1].split(",")[2] == last["q1"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--times", "soon"], "--times must be numbers of seconds"),
        (["--out", "here.txt"], "--out must be a .json or .csv file; got here.txt"),
        (["--digits", "2000"], "digits must be a whole number from 1 to 1000; got 2000"),
    ],
)
def test_bad_input_is_one_sentence(arguments, sentence):
    result = CliRunner().invoke(app, ["reference", str(SCENES / "general.toml"), *arguments])
    assert result.exit_code == 2
    assert sentence in result.output


def scene_of(file):
    (found,) = SCENES.rglob(f"{file.stem}.toml")
    return Scene.load(found)


def test_every_shipped_scene_has_a_reference():
    assert {file.stem for file in FILES} == {file.stem for file in SCENES.rglob("*.toml")}


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_float64_results_are_as_near_to_the_references_as_they_say(file):
    scene, document = scene_of(file), json.loads(file.read_text())
    assert Scene.parse(document["scene"]) == scene
    accuracy = 1e-9
    trajectory = simulate(scene, accuracy=accuracy)
    times = [float(state["t"]) for state in document["states"]]
    q, u = trajectory.at(times)
    for index, state in enumerate(document["states"]):
        # Every number has its digits written out: one that is small, or zero, too.
        assert {len(state[name].split(".")[1]) for name in ("q1", "u2")} == {state["digits"]}
        for ours, name in zip((*q[:, index], *u[:, index]), ("q1", "q2", "u1", "u2"), strict=True):
            error = abs(Decimal(float(ours)) - Decimal(state[name]))
            assert error <= Decimal(trajectory.error), (name, times[index])


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_committed_reference_is_reproduced(file):
    """`twolink reference … --fifths --out models/references` repeats its file to the last digit."""
    document = json.loads(file.read_text())
    scene = scene_of(file)
    state = document["states"][1]
    again = reference(scene, state["digits"], (float(state["t"]),))
    assert again.states[0] == tuple(state[name] for name in ("q1", "q2", "u1", "u2"))


def test_a_load_that_is_not_smooth_is_one_sentence():
    words = (
        r"the integration failed at 0 s \(the state, a load or a derivative of a load by time is"
    )
    with pytest.raises(SimulationError, match=words):
        reference(KINKED, 20)
    motion = precise_motion(KINKED, "lagrange", 20)
    with pytest.raises(SimulationError, match=words):
        motion.step(motion.longest_step)


@pytest.mark.slow
@pytest.mark.parametrize("others", [(), (FAR,)], ids=["smooth", "with a surface"])
def test_a_pulse_that_both_runs_would_pass_is_seen(others):
    """They agreed on 20 digits, of which none was right."""
    pulse = Detent(2000.0, 0.9, 1e-3)
    scene = Scene(Chain.uniform_bars(), (0.3, 0.2), (0.0, 0.0), 1.0, (Gravity(), pulse, *others))
    found = reference(scene, 20)
    times = np.array([0.0, 1.0])
    exact = motion_run(scene, times, formulation="kane", precision="quadruple", longest_step=2e-4)
    for value, digits in zip((*exact.q[:, -1], *exact.u[:, -1]), found.states[0], strict=True):
        assert abs(Decimal(str(value)) - Decimal(digits)) < Decimal("1e-19")
    assert found.digits == (20,)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("others", [(), (FAR,)], ids=["smooth", "with a surface"])
def test_changes_that_no_steps_see_are_one_sentence(monkeypatch, others):
    monkeypatch.setattr("twolink.simulation.resolved.MOST_STEPS_TO_RESOLVE", 500)
    monkeypatch.setattr("twolink.accuracy.reference.MOST_STEPS_TO_RESOLVE", 500)
    effects = Gravity(), Kink(0.1, 0.4, 0.0), *others
    kinked = Scene(Chain.uniform_bars(), (0.3, 1.5), (0.0, 0.0), 0.5, effects)
    with pytest.raises(SimulationError, match="an effect that changes so fast must declare its"):
        reference(kinked, 20)


def test_all_scenes_are_read_before_any_is_computed(tmp_path):
    words = ["reference", str(SCENES / "free_fall.toml"), "none.toml", "--out", str(tmp_path / "a")]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 2
    assert "none.toml: there is no file of this name" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_scenes_of_one_name_are_refused_where_their_files_would_be_one(tmp_path):
    (tmp_path / "free_fall.toml").write_bytes((SCENES / "free_fall.toml").read_bytes())
    both = ["free_fall", str(tmp_path / "free_fall.toml")]
    result = CliRunner().invoke(app, ["reference", *both, "--out", str(tmp_path / "a")])
    assert result.exit_code == 2
    assert "the scenes must have different names; got 'free_fall' twice" in result.stderr
    assert not (tmp_path / "a").exists()


FRACTIONS = {
    "gravity": lambda n: Gravity(n(9.75), (n(0.5), n(1.25))),
    "joint_torque": lambda n: JointTorque(*((n(0.5), n(k)) for k in (0.25, 0.75, 3.0, 1.0))),
    "joint_damping": lambda n: JointDamping((n(0.5), n(0.25))),
    "joint_spring": lambda n: JointSpring((n(1.5), n(0.5)), (n(0.25), n(0.5))),
    "pd_control": lambda n: PdControl((n(0.5), n(1.5)), (n(1.25), n(0.75)), (n(0.5), n(0.25))),
    "end_drag": lambda n: EndDrag(n(0.5)),
    "end_force": lambda n: EndForce(n(0.5), n(0.25), static=n(0.375)),
    "motor_inertia": lambda n: MotorInertia((n(0.5), n(0.25)), (n(1.5), n(-2.75))),
    "joint_friction": lambda n: JointFriction((n(0.5), n(0.25)), (n(0.75), n(0.5))),
    "joint_stop": lambda n: JointStop("B", n(-0.5), n(0.625), n(0.5)),
    "surface": lambda n: Surface(
        (n(0.25), n(1.25)), (n(0.25), n(-1)), restitution=n(0.5), friction=n(0.25)
    ),
    "compliant_surface": lambda n: CompliantSurface(
        (n(0.25), n(1.25)), (n(0.25), n(-1)), "kelvin-voigt", n(2048.5), n(3.5), friction=n(0.25)
    ),
    "sampled_torque": lambda n: SampledTorque(
        tuple(map(n, (0.0, 0.125, 0.25, 0.375))),
        tuple(map(n, (0.5, 0.0, 0.25, 1.0))),
        tuple(map(n, (0.0, 0.0, 0.25, 1.0))),
        "cubic",
    ),
}


def test_fractions_are_tested_in_every_effect():
    assert set(FRACTIONS) == set(EFFECTS)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", FRACTIONS)
def test_fractions_in_effects_are_their_values(name):
    """Dyadic fractions are float64 numbers as well, and so are the references the same."""
    weight = () if name == "gravity" else (Gravity(),)
    plain = Scene(Chain.uniform_bars(), (0.0, 0.3), (0.5, 0.0), 0.5)
    found, expected = (
        reference(replace(plain, effects=(*weight, FRACTIONS[name](number))), 22)
        for number in (Fraction, float)
    )
    assert found.states == expected.states
    assert found.digits == expected.digits


def test_a_time_at_which_no_digit_is_known_is_an_error(monkeypatch):
    """It had a state of zeros, with a negative number of digits."""
    from twolink.accuracy import reference as module

    scene = replace(Scene.load(SCENES / "drop.toml"), duration=0.5)
    monkeypatch.setattr(module, "_agreement", lambda coarse, fine: 2)
    with pytest.raises(IntegrationError, match=r"agree in no digit at 0\.5 s, since errors grow"):
        reference(scene, 10)


def test_a_reference_has_the_notes_of_its_motion():
    """The order of two impacts at one time is open: the other one changes u by 3.6 rad/s."""
    scene = Scene.load(SCENES / "elbow_and_tip.toml")
    found = reference(scene, digits=8)
    assert found.notes == simulate(scene).notes
    assert "do not determine the order of simultaneous impacts" in found.notes[0]
    assert found.document()["notes"] == list(found.notes)


def test_a_reference_has_the_notes_of_its_urdf():
    scene = replace(Scene.load(SCENES / "free_fall.toml"), duration=0.1, notes=("no limits",))
    found = reference(scene, digits=8)
    assert found.notes == ("no limits",)
    assert "notes" not in reference(replace(scene, notes=()), digits=8).document()
