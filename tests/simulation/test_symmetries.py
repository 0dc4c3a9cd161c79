"""Symmetries of mechanics: a motion runs backwards where nothing is lost, turns with its scene, has
a mirror image, and depends neither on units nor on the order of effects, nor on how it is stated.

None of them needs another simulator to tell the right motion.
"""

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

from tests.campaign.dice import Dice
from tests.campaign.draw import draw_chain, draw_scene
from tests.campaign.draw_coincidences import draw_coincidence
from tests.campaign.equivalents import RESTATEMENTS
from tests.campaign.images import mirrored, reordered, turned
from tests.campaign.reference import leaves_a_choice
from tests.campaign.units import Units, in_units
from twolink.chain import Chain
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.errors import TwolinkError
from twolink.kinematics import position
from twolink.scene import Scene
from twolink.simulation import simulate

SEED = 1


def without_loss(index):
    """Return a random scene with stops and surfaces that lose no energy."""
    dice = Dice(SEED, index)
    chain = draw_chain(dice)
    q, u = dice.pair(-3.0, 3.0), dice.pair(-3.0, 3.0)
    normal = dice.unit()
    height = min(np.dot(position(chain, q, point), normal) for point in (chain.B, chain.D))
    place = tuple((height - dice.between(0.02, 0.4)) * x for x in normal)
    effects = [
        Gravity(),
        JointSpring(stiffness=dice.pair(0.0, 20.0)),
        JointStop("A", lower=q[0] - dice.between(0.1, 1.5), upper=q[0] + 0.7, restitution=1.0),
        Surface(place, normal, restitution=1.0, law="stronge", on=("B", "D"), name="rigid")
        if index % 2
        else CompliantSurface(place, normal, "hertz", stiffness=1e4, on=("B", "D"), name="soft"),
    ]
    return Scene(chain, q, u, 1.0, tuple(effects), accuracy=1e-10)


@pytest.mark.parametrize("index", range(12))
def test_a_motion_without_loss_runs_backwards(index):
    """From its last state with opposite speeds, it returns through all contacts to its start."""
    scene = without_loss(index)
    forth = simulate(scene)
    q, u = forth.at([scene.duration])
    assert forth.met
    assert len(forth.events) + len(forth.impacts) > 1
    back = simulate(replace(scene, q=tuple(q[:, 0]), u=tuple(-u[:, 0])))
    times = clear_of_impacts(np.linspace(0.013, 0.987, 61), forth)
    there, back_there = forth.at(times), back.at(scene.duration - times)
    assert back_there[0] == pytest.approx(there[0], abs=1e-6)
    assert back_there[1] == pytest.approx(-there[1], abs=1e-6 * max(1.0, np.abs(there[1]).max()))


def clear_of_impacts(times, run):
    """Return the times (s) that are not at an impact, where the speed has two values."""
    impacts = [impact.time for impact in run.impacts]
    return np.array([t for t in times if all(abs(t - other) > 1e-5 for other in impacts)])


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "scenes"), [(-1.1, 3), (math.pi / 2, 20)])
def test_a_turned_scene_has_the_turned_motion(angle, scenes):
    """Scenes of all effects, at rest, in contact, stretched and folded.

    Where a point grazes a surface, the rounding of the turned place decides whether it is hit. The
    friction of an end force acts along a fixed line, which does not turn.
    """
    compared = 0
    for index in range(scenes):
        scene, one = drawn(draw_scene, index)
        fixed = any(isinstance(effect, EndForce) for effect in scene.effects)
        if fixed or "grazing" in scene.title or scene.duration > 3:
            continue
        assert one is not None, index
        two = simulate(turned(scene, angle))
        if not (one.met and two.met):
            continue
        times = np.linspace(0.0, scene.duration, 41)[1:-1] + 1e-7
        times = clear_of_impacts(clear_of_impacts(times, one), two)
        (q, u), (other_q, other_u) = one.at(times), two.at(times)
        assert other_q - angle == pytest.approx(q, abs=1e-6), index
        assert other_u == pytest.approx(u, abs=1e-6 * max(1.0, np.abs(u).max())), index
        compared += 1
    assert compared > scenes / 3


def in_smaller_units(scene, index):
    """Return a scene of lengths of 0.1 mm."""
    return in_units(scene, SMALL)


def in_larger_units(scene, index):
    """Return a scene of lengths of 1 km and times of hours."""
    return in_units(scene, LARGE)


SMALL, LARGE = Units(length=-14, mass=-20, time=-2), Units(length=10, mass=7, time=14)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("draw", "first", "scenes"),
    [
        (draw_scene, 0, 2),
        (draw_coincidence, 0, 2),
        pytest.param(draw_scene, 2, 14, marks=pytest.mark.slow),
        pytest.param(draw_coincidence, 2, 14, marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize(
    ("change", "sign", "second"),
    [
        (mirrored, -1, 1),
        (reordered, 1, 1),
        (in_smaller_units, 1, 2.0**SMALL.time),
        (in_larger_units, 1, 2.0**LARGE.time),
    ],
)
def test_a_motion_changes_with_its_scene(change, sign, second, draw, first, scenes):
    """By a sign, or by a power of two, which is exact: a tolerance in metres would show.

    Starts at any distance from obstacles down to zero are among the scenes.
    """
    compared = 0
    for index in range(first, first + scenes):
        scene, one = drawn(draw, index)
        if one is None or not one.met:
            continue
        two = simulated(change(scene, index))
        if two is None or not two.met:
            continue
        times = np.linspace(0.0, scene.duration, 41)[1:-1] + 1e-7
        times = clear_of_impacts(times, one)
        (q, u), (other_q, other_u) = one.at(times), two.at(second * times)
        most = 1.01 * (one.error + two.error)
        assert sign * other_q == pytest.approx(q, abs=most, rel=0), index
        assert sign * other_u * second == pytest.approx(u, abs=most * max(1, second), rel=0), index
        compared += 1
    assert compared > scenes / 2


@pytest.mark.parametrize("power", [-10, 10, 17, 20])
def test_a_slide_takes_as_many_steps_over_any_time(power):
    """The end of a chain that swings below A slides on a floor, for 20 s and for up to 240 days."""
    unit, y = 2.0**power, 0.5
    q1 = math.pi / 2 + 0.3
    pose, floor = (q1, math.asin(y - math.sin(q1))), Surface((0.0, y), (0.0, -1.0))
    bars = Chain.uniform_bars()

    def over(t):
        return simulate(Scene(bars, pose, (0.0, 0.0), 20 * t, (Gravity(9.81 / t**2), floor)))

    one, other = over(1.0), over(unit)
    assert one.met
    assert other.met
    assert other.q[:, -1] == pytest.approx(one.q[:, -1], abs=one.error + other.error, rel=0)
    assert other.statistics.steps < 2.5 * one.statistics.steps


@pytest.mark.parametrize(
    ("draw", "first", "scenes"),
    [
        (draw_scene, 18, 2),
        (draw_coincidence, 0, 2),
        pytest.param(draw_scene, 2, 10, marks=pytest.mark.slow),
        pytest.param(draw_coincidence, 2, 10, marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("restate", RESTATEMENTS.values(), ids=RESTATEMENTS)
def test_a_motion_does_not_depend_on_how_it_is_stated(restate, draw, first, scenes):
    """A later start has the rounding of its state, which grows like that of the first run."""
    compared = 0
    for index in range(first, first + scenes):
        scene, one = drawn(draw, index)
        made = restate(one, np.random.default_rng([SEED, index])) if one and one.met else None
        if made is None:
            continue
        changed, start = made
        two = simulate(changed)
        # A longer motion may lose its accuracy later.
        if leaves_a_choice(one, two) or not two.met:
            continue
        end = min(scene.duration - start, changed.duration)
        times = np.linspace(0.0, end, 41)[1:-1] + 1e-7
        times = clear_of_impacts(clear_of_impacts(times + start, one) - start, two)
        (q, u), (other_q, other_u) = one.at(times + start), two.at(times)
        most = 1.01 * (one.error + two.error) + 1e-13
        most = 30 * most + 1e-10 if start else most
        assert other_q == pytest.approx(q, abs=most, rel=0), index
        assert other_u == pytest.approx(u, abs=most, rel=0), index
        compared += 1
    assert compared >= max(1, scenes // 8)


@functools.cache
def drawn(draw, index):
    """Return a random scene and its motion, with which all changes of the scene are compared."""
    scene = draw(SEED, index)
    return scene, simulated(scene) if scene.duration <= 3 else None


def simulated(scene):
    """Return the motion of a scene, or None if it is refused."""
    try:
        return simulate(scene)
    except TwolinkError:
        return None
