"""Contacts that carry no force: loads balance, or vanish, where the chain is at rest."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.campaign.checks import violations
from twolink.arithmetic import tanh
from twolink.chain import Chain
from twolink.effects import Effect
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.loads import motor_loads
from twolink.scene import Scene
from twolink.simulation.simulate import simulate

DOWN = math.pi / 2
BARS = Chain.uniform_bars((1.0, 1.0), (1.0, 1.0))


def wall(*on, **more):
    """Return a vertical wall through A, on whose side of negative x the chain is."""
    return Surface((0.0, 0.0), (-1.0, 0.0), on=on, name="wall", **more)


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("links", [(0.3, 0.3), (0.5, 0.4)])
def test_a_chain_that_swings_onto_a_wall_below_its_base_hangs_there(friction, links):
    """Without restitution it comes to rest in the pose in which it would hang by itself."""
    start = (DOWN + links[0], DOWN + links[1])
    flat = wall("B", "D", restitution=0.0, friction=friction)
    run = simulate(Scene(BARS, start, (0.0, 0.0), 1.5, (Gravity(), flat)))
    assert run.failure == ""
    assert str(run.events[-1].mode) == "B on wall rests, D on wall rests"
    assert run.q[:, -1] == pytest.approx([DOWN, DOWN], abs=1e-12)
    assert np.abs(run.u[:, -1]).max() < 1e-12


@pytest.mark.parametrize("on", [("B", "D"), ("D",), ("B",)])
@pytest.mark.parametrize(
    ("friction", "static", "duration"),
    [(0.0, None, 1.0), (0.4, None, 1.0), (0.4, 0.6, 1.0), (0.9, None, 4.0)],
)
def test_a_chain_that_hangs_along_a_wall_down_to_a_floor_stays_at_rest(
    on, friction, static, duration
):
    """It reaches the floor when it is straight, and cannot get beyond."""
    floor = Surface((0.0, 2.0), (0.0, -1.0), on=("D",), friction=friction, name="floor")
    effects = (Gravity(), wall(*on, restitution=0.0, friction=friction, static=static), floor)
    run = simulate(Scene(BARS, (DOWN, DOWN), (0.0, 0.0), duration, effects))
    assert run.met
    assert np.abs(run.u).max() <= run.error
    assert run.error < 1e-13


MATERIAL = {"radius": 0.02, "modulus": (2e11, 7e10), "poisson": (0.3, 0.3), "strength": (1e9, 1e9)}


@pytest.mark.parametrize(
    ("points", "accuracy"), [(("D",), 1e-14), (("D", "C2"), 1e-9), (("B", "D"), 1e-9)]
)
@pytest.mark.parametrize(
    ("law", "numbers"),
    [
        ("hertz", {"stiffness": 1e5}),
        ("hunt-crossley", {"stiffness": 1e5, "loss": 0.3}),
        ("elasto-plastic", MATERIAL),
        ("kelvin-voigt", {"stiffness": 1e5}),
    ],
)
def test_a_stretched_chain_that_is_pressed_into_a_rough_surface_stays(
    law, numbers, points, accuracy
):
    """Friction holds D along the surface, and the chain across it: its series ends at once."""
    height = 2 * math.sin(1.96) - 1e-4
    surface = CompliantSurface((0.0, height), (0.0, -1.0), law, friction=0.6, on=points, **numbers)
    scene = Scene(Chain.uniform_bars(), (1.96, 1.96), (0.0, 0.0), 1.0, (surface,))
    found = simulate(scene, accuracy=accuracy)
    assert found.met
    assert found.notes == ()
    assert np.abs(found.q - 1.96).max() <= found.error
    assert np.abs(found.u).max() <= found.error
    assert not violations(found)


@dataclass(frozen=True)
class LateTorque(Effect):
    """A torque at B that rises by 5 N m within 0.02 s of 0.5 s; at 0 s it is 1e-43 N m."""

    def loads(self, chain, q, u, t=0.0):
        """Return the torque; its derivatives at 0 s are round-off too."""
        share = (1 + tanh((t - chain.scalar(0.5)) / chain.scalar(0.01))) / 2
        return motor_loads(0 * share, chain.scalar(5.0) * share)


STOP = JointStop("B", upper=1.0, restitution=0.5)


@pytest.mark.parametrize("stops", [(STOP,), ()])
@pytest.mark.parametrize("pose", [0.0, 0.3])
def test_a_contact_without_force_is_open_once_a_late_load_has_lifted_its_point(stops, pose):
    """Impacts far from the floor are none of it, and the point that returns strikes it."""
    level = 2 * math.sin(pose)
    floor = Surface((0.0, level), (0.0, 1.0), on=("D",), restitution=0.5, friction=0.4)
    duration = 1.2 if stops else 1.6

    def run(gap):
        below = replace(floor, point=(0.0, level - gap))
        return simulate(Scene(BARS, (pose, pose), (0, 0), duration, (LateTorque(), *stops, below)))

    touching, apart = run(0.0), run(1e-9)
    assert touching.failure == ""
    assert [strike.name for strike in touching.impacts] == [s.name for s in apart.impacts]
    assert touching.q[:, -1] == pytest.approx(apart.q[:, -1], abs=1e-6)
    assert touching.impacts
