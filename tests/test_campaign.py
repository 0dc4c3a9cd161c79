"""The checks of the campaign fail on tampered trajectories, and pass on correct ones."""

import math
import os
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.campaign.checks import CHECKS, violations
from tests.campaign.draw import DRAWS, draw_scene
from tests.campaign.judge import CRASH, HANG, OK, REFUSED, VIOLATION, Judged
from tests.campaign.knots import undisturbed
from tests.campaign.printing import Printed
from tests.campaign.reference import parting
from tests.campaign.report import is_good, report
from tests.campaign.run import Campaign, judged_scenes
from tests.campaign.seen import Seen
from twolink import Chain, Scene, simulate
from twolink.effects import EFFECTS
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface

BARS = Chain.uniform_bars((1.0, 1.0), (1.0, 1.0))


class Tampered:
    """A trajectory of which some attributes or methods are replaced."""

    def __init__(self, run, **changes):
        self._run = run
        self.__dict__.update(changes)

    def __getattr__(self, name):
        return getattr(self._run, name)


@pytest.fixture(scope="module")
def sliding():
    """D falls onto a rough floor, slides on it and comes to rest."""
    floor = Surface((0.0, 1.2), (0.0, -1.0), friction=0.4, name="floor")
    return simulate(Scene(BARS, (0.4, 0.7), (0.0, 0.0), 1.2, (Gravity(), floor)))


@pytest.fixture(scope="module")
def bouncing():
    """The joint A has friction and a stop, from which it bounces."""
    effects = (Gravity(), JointFriction((0.6, 0.3)), JointStop("A", upper=1.2, restitution=0.2))
    return simulate(Scene(BARS, (0.4, 0.7), (0.0, 0.0), 1.0, effects))


@pytest.fixture(scope="module")
def cushioned():
    """D falls into a rough cushion."""
    pad = CompliantSurface(
        (0.0, 1.2), (0.0, -1.0), "kelvin-voigt", stiffness=5e3, loss=20.0, friction=0.3
    )
    return simulate(Scene(BARS, (0.4, 0.7), (0.0, 0.0), 1.0, (Gravity(), pad)))


def ramp(static):
    """Link 1 is at rest on a rough floor, and link 2 hangs, until a torque exceeds the frictions.

    The floor and the joint A hold link 1 together.
    """
    floor = Surface((0.0, 0.0), (0.0, -1.0), friction=0.2, on=("B",), name="floor")
    torque = SampledTorque((0.0, 2.0), (0.0, -40.0), (0.0, 0.0), interpolation="linear")
    effects = (Gravity(), torque, floor, JointFriction((1.0, 0.5), (static, 0.5)))
    return Scene(BARS, (0.0, math.pi / 2), (0.0, 0.0), 2.0, effects)


@pytest.fixture(scope="module")
def leaving():
    """A chain at rest on a floor leaves it when a torque lifts it."""
    return simulate(ramp(static=1.5))


@pytest.fixture(scope="module")
def runs(sliding, bouncing, cushioned, leaving):
    return {
        "sliding": sliding, "bouncing": bouncing, "cushioned": cushioned, "leaving": leaving,
    }  # fmt: skip


def moved(run, dq=0.0, du=0.0, since=0.0):
    """The trajectory with other angles (rad) and speeds (rad/s) from a time (s) on."""

    def at(times, side="right"):
        q, u = run.at(times, side)
        times = np.atleast_1d(times)
        late = times > since if side == "left" else times >= since
        return q + late * dq, u + late * du

    return Tampered(run, at=at)


def forced(run, name, normal=1.0, tangential=1.0, more=0.0):
    """The trajectory with an element's forces multiplied, and a normal force (N, N m) added."""

    def contact_forces(times=None):
        return tuple(
            SimpleNamespace(
                name=force.name,
                normal=force.normal * normal + more,
                tangential=None if force.tangential is None else force.tangential * tangential,
            )
            if force.name == name
            else force
            for force in run.contact_forces(times)
        )

    return Tampered(run, contact_forces=contact_forces)


def in_states(run, **renamed):
    """The trajectory with states renamed in all modes."""

    def state(old):
        return SimpleNamespace(name=renamed.get(old.name, old.name))

    events = tuple(
        SimpleNamespace(
            time=event.time,
            entered=event.entered,
            mode=SimpleNamespace(
                names=event.mode.names, states=tuple(state(old) for old in event.mode.states)
            ),
        )
        for event in run.events
    )
    return Tampered(run, events=events)


def struck(run, **changes):
    """The trajectory with values of its first impact replaced."""
    first, *rest = run.impacts
    return Tampered(run, impacts=(replace(first, **changes), *rest))


def worked(run):
    works = {name: 1.001 * work for name, work in run.work().items()}
    return Tampered(run, work=lambda: works)


def swapped(run):
    return in_states(run, FORWARD="BACKWARD", BACKWARD="FORWARD")


FLOOR, STOP, PAD = "D on floor", "A on its upper stop", "D on cushion"

# The check, the trajectory, and the tampering.
TAMPERINGS = [
    ("names", "sliding", lambda run: Tampered(run, contact_forces=lambda times=None: ())),
    ("names", "sliding", lambda run: Tampered(run, events=())),
    ("silent", "sliding", lambda run: Tampered(run, met=False, notes=())),
    ("silent", "sliding", lambda run: moved(run, du=np.nan, since=0.9)),
    ("penetration", "sliding", lambda run: moved(run, dq=1e-6)),
    ("penetration", "bouncing", lambda run: moved(run, dq=1e-6)),
    (
        "passed through a cushion",
        "cushioned",
        lambda run: in_states(run, FORWARD="OPEN", BACKWARD="OPEN", STICKS="OPEN"),
    ),
    ("pull", "sliding", lambda run: forced(run, FLOOR, normal=-1.0)),
    ("pull", "sliding", lambda run: forced(run, FLOOR, more=1e-6)),
    ("impulse", "sliding", lambda run: struck(run, normal_impulse=-0.1)),
    ("impulse", "sliding", lambda run: struck(run, tangential_impulse=1.0)),
    ("impulse", "bouncing", lambda run: struck(run, speeds=(-1.0, -0.1))),
    ("impulse", "bouncing", lambda run: struck(run, name="A")),
    ("impact energy", "bouncing", lambda run: struck(run, kinetic_energy=(1.0, 1.01))),
    ("restitution", "bouncing", lambda run: struck(run, speeds=(-1.0, 0.61))),
    ("Coulomb's law", "sliding", lambda run: forced(run, FLOOR, tangential=1.01)),
    ("Coulomb's law", "cushioned", lambda run: forced(run, PAD, tangential=1.01)),
    ("dry friction", "bouncing", lambda run: forced(run, "A", normal=1.01)),
    ("dry friction", "bouncing", lambda run: in_states(run, FORWARD="BACKWARD")),
    ("direction", "sliding", swapped),
    ("direction", "bouncing", swapped),
    ("direction", "cushioned", swapped),
    ("friction drives", "sliding", lambda run: forced(run, FLOOR, tangential=-1.0)),
    ("friction drives", "bouncing", lambda run: forced(run, "B", normal=-1.0)),
    ("rest", "sliding", lambda run: moved(run, dq=-1e-6)),
    ("rest", "sliding", lambda run: in_states(run, FORWARD="STICKS", BACKWARD="STICKS")),
    ("rest", "bouncing", lambda run: in_states(run, FORWARD="PRESSED_FORWARD")),
    ("departure", "leaving", lambda run: Tampered(run, scene=ramp(static=3.0))),
    ("compliant law", "cushioned", lambda run: forced(run, PAD, normal=1.0001)),
    ("samples", "sliding", lambda run: Tampered(run, q=run.q + 1e-5)),
    ("q' = u", "sliding", lambda run: moved(run, du=1e-5)),
    ("equations of motion", "sliding", lambda run: forced(run, FLOOR, normal=1.001)),
    ("equations of motion", "cushioned", lambda run: forced(run, PAD, tangential=0.9)),
    ("equations of motion", "bouncing", lambda run: forced(run, "B", normal=1.01)),
    ("jump", "sliding", lambda run: Tampered(run, impacts=())),
    ("jump", "bouncing", lambda run: struck(run, normal_impulse=1.001)),
    ("jump", "cushioned", lambda run: moved(run, du=1e-3, since=run.events[1].time)),
    ("energy", "bouncing", lambda run: moved(run, du=1e-3, since=0.1)),
    ("energy", "cushioned", lambda run: moved(run, dq=-1e-4, since=0.1)),
    ("work", "sliding", worked),
    ("work", "bouncing", worked),
]


@pytest.mark.parametrize("name", ["sliding", "bouncing", "cushioned", "leaving"])
def test_a_good_trajectory_passes_all_checks(runs, name):
    assert violations(runs[name]) == []


@pytest.mark.parametrize(("check", "name", "tamper"), TAMPERINGS)
def test_a_check_fires_on_a_tampered_run(runs, check, name, tamper):
    sentence = CHECKS[check](Seen(tamper(runs[name])))
    assert sentence
    assert "cannot be checked" not in sentence


def test_a_surface_that_a_point_cannot_get_beyond_holds_no_chain():
    """B is at its farthest place, where its force would have no lever arm."""
    ceiling = Surface((0.0, 1.0), (0.0, -1.0), friction=0.5, on=("B",), name="ceiling")
    torque = SampledTorque((0.0, 2.0), (0.0, 2.0), (0.0, 0.0), interpolation="linear")
    effects = (torque, ceiling, JointFriction((1.0, 1.0)))
    run = simulate(Scene(BARS, (math.pi / 2, 0.0), (0.0, 0.0), 1.5, effects))
    assert abs(run.u[0, run.t < 1.0]).max() == 0
    assert abs(run.u[0, -1]) > 0.01
    assert CHECKS["departure"](Seen(run)) is None


def test_each_check_has_a_tampering_that_it_detects():
    assert {check for check, *_ in TAMPERINGS} == set(CHECKS)


def test_the_reported_error_is_held_against_a_reference(sliding):
    assert parting(sliding, sliding) == []
    assert parting(sliding, moved(sliding, dq=2e-8))
    assert parting(moved(sliding, du=2e-8, since=1.2), sliding)


@pytest.mark.parametrize("name", ["sliding", "bouncing", "cushioned", "leaving"])
def test_knots_of_a_zero_torque_are_held_against_a_trajectory(runs, name):
    wrong, remark = undisturbed(runs[name], np.random.default_rng(3))
    assert wrong == []
    assert remark.startswith("knots to ")
    wrong, _ = undisturbed(moved(runs[name], dq=1e-8, since=0.4), np.random.default_rng(3))
    assert [check for check, _ in wrong] == [
        "knots: reported error at samples", "knots: reported error between samples",
    ]  # fmt: skip


def test_comparisons_are_those_of_a_share_of_the_scenes():
    campaign = Campaign(seed=7, shares={"reference": 0.1, "knots": 0.5})
    drawn = [campaign.comparisons(index) for index in range(400)]
    assert drawn == [campaign.comparisons(index) for index in range(400)]
    assert 20 <= sum("reference" in names for names in drawn) <= 60
    assert 160 <= sum("knots" in names for names in drawn) <= 240


def test_motion_after_the_accuracy_is_lost_is_not_judged(sliding):
    late = moved(sliding, dq=1e-3, since=0.9)
    assert violations(late)
    limited = Tampered(late, met=False, holds_until=0.8, notes=("It holds until 0.8 s.",))
    assert violations(limited) == []


@pytest.mark.slow
@pytest.mark.parametrize("draw", DRAWS.values(), ids=DRAWS)
def test_scenes_are_drawn_alike_and_can_be_kept(draw):
    scenes = [draw(7, index) for index in range(30)]
    assert scenes == [draw(7, index) for index in range(30)]
    assert scenes[0] != draw(8, 0)
    for scene in scenes:
        assert Scene.parse(scene.to_toml()) == scene


@pytest.mark.slow
def test_all_effects_are_drawn():
    drawn = {
        type(effect).__name__ for index in range(100) for effect in draw_scene(7, index).effects
    }
    assert drawn == {name for _, name in EFFECTS.values()}


def test_output_of_c_libraries_is_captured(capfd):
    with Printed() as printed:
        os.write(2, b"a library speaks\n")
    assert printed.text == "a library speaks"
    assert capfd.readouterr().err == ""


def test_a_report_names_the_violations_and_the_command_to_repeat_them():
    good = Judged(0, OK, 0.1)
    bad = Judged(3, VIOLATION, 2.0, (("rest", "D sticks and moves"),))
    text = report([good, bad], "again")
    assert "again --only 3" in text
    assert "rest: D sticks and moves" in text
    assert is_good([good])
    assert not is_good([good, bad])
    assert not is_good([Judged(0, HANG, 60.0)])
    assert not is_good([Judged(0, CRASH, 0.0)])
    assert is_good([Judged(0, REFUSED, 0.0)] * 5 + [good])
    assert not is_good([Judged(0, REFUSED, 0.0)] * 6 + [good])


def test_slow_scenes_of_short_motions_are_named():
    slow, long, quick = (
        Judged(number, OK, seconds, duration=duration)
        for number, seconds, duration in [(1, 12.0, 3.0), (2, 12.0, 10.0), (3, 9.0, 3.0)]
    )
    text = report([slow, long, quick], "again")
    assert "motions of at most 3 s that take above 10 s: 1, 1 (12.0 s)" in text


def _sleep(seed, index, *, draw, comparisons, report):
    report("simulate", Judged(index, HANG, 0.0))
    time.sleep(600)


def _work(seed, index, *, draw, comparisons, report):
    report("simulate", Judged(index, HANG, 0.0))
    while True:
        pass


def _told(seed, index, *, draw, comparisons, report):
    return Judged(index, OK, 0.0, remark=f"{draw} {seed}")


@pytest.mark.slow
def test_workers_draw_the_kind_of_scenes_of_the_campaign():
    campaign = Campaign(seed=7, judge=_told, draw="coincidences")
    (judged,) = judged_scenes(campaign, [3], 1, lambda text: None)
    assert (judged.index, judged.remark) == (3, "coincidences 7")


@pytest.mark.slow
@pytest.mark.parametrize(("judge", "limit"), [(_sleep, 0.2), (_work, 0.5)])
def test_a_scene_that_takes_too_long_is_ended(judge, limit):
    campaign = Campaign(seed=7, limit=limit, judge=judge)
    (judged,) = judged_scenes(campaign, [0], 1, lambda text: None)
    assert judged.outcome == HANG
