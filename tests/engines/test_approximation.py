"""Engines with approximate laws of friction, stops and surfaces."""

from dataclasses import replace

import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink.chain import Chain
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.engines.approximation import approximate_model, smooth_part
from twolink.engines.mujoco_contact import _damping_ratio
from twolink.engines.registry import SIMULATORS
from twolink.engines.simulation_engine import ApproximatingEngine
from twolink.errors import EngineError
from twolink.scene import Scene
from twolink.simulation import simulate

FLOOR = Surface((0.0, 1.2), (0.0, -2.0), restitution=0.6, friction=0.2)
WALL = Surface((-0.5, 0.0), (1.0, 0.0), on=("B", "D"))
START = Scene(GENERAL, (0.3, -0.4), (0.1, 0.2), 0.8)
SCENES = {
    "friction": JointFriction((2.5, 0.6)),
    "stop": JointStop("B", lower=-1.0, upper=0.4),
    "floor": FLOOR,
}
# s. PyBullet's contacts do not converge: its restitution for depth grows with shorter steps.
STEP = 1e-3
APPROXIMATING = [engine for engine in SIMULATORS if isinstance(engine, ApproximatingEngine)]


def scene_with(*effects):
    return replace(START, effects=(Gravity(), *effects))


def end_of(trajectory):
    return np.array([*trajectory.q[:, -1], *trajectory.u[:, -1]])


@pytest.mark.engines
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("engine", APPROXIMATING, ids=lambda engine: engine.name)
def test_the_approximation_is_close(engine, name):
    """It ends nearer to the motion with the effect than to the motion without."""
    scene = scene_with(SCENES[name])
    with_effect = end_of(simulate(scene, samples=2))
    difference = np.abs(with_effect - end_of(simulate(smooth_part(scene), samples=2))).max()
    run = engine.prepared(scene, engine.methods[0].name, approximate=True)
    error = np.abs(end_of(run(STEP, np.array([0.0, scene.duration]))) - with_effect).max()
    assert difference > 0.5
    assert error < difference / 2


@pytest.mark.engines
@pytest.mark.parametrize("engine", APPROXIMATING, ids=lambda engine: engine.name)
def test_changes_are_reported_on_request(engine):
    scene = scene_with(JointFriction((2.5, 0.6), (3.0, 0.8)), FLOOR)
    words = engine.changed(scene)
    assert [sentence.partition(":")[0] for sentence in words] == [
        "joint_friction",
        "surface",
        "joint_friction",
    ]
    assert "kinetic friction also acts at rest" in words[-1]
    assert engine.changed(scene_with()) == ()
    with pytest.raises(EngineError, match="cannot express joint_friction"):
        engine.prepared(scene, engine.methods[0].name)
    cushion = CompliantSurface((0.0, 1.2), (0.0, -1.0), "hertz", 1e5)
    with pytest.raises(EngineError, match="cannot express compliant_surface"):
        engine.prepared(scene_with(cushion), engine.methods[0].name, approximate=True)


@pytest.mark.engines
@pytest.mark.parametrize("engine", APPROXIMATING, ids=lambda engine: engine.name)
def test_two_surfaces_bar_each_its_points(engine):
    """D is kept off floor and wall, and B off the wall, which a free chain passes."""
    scene = replace(scene_with(FLOOR, WALL), duration=3.0)
    free = simulate(smooth_part(scene), samples=301)

    def reach(q):
        (q1, q2), (L1, L2) = q, GENERAL.length
        x, y = L1 * np.cos(q1), L1 * np.sin(q1)
        return np.array([-(x + L2 * np.cos(q2)).min(), (y + L2 * np.sin(q2)).max(), -x.min()])

    bounds = np.array([0.5, 1.2, 0.5])
    assert (reach(free.q) > bounds + 0.2).all()
    motion = engine.prepared(scene, engine.methods[0].name, approximate=True)(STEP, free.t)
    # A touch that lasts ten steps goes in by v/ω, at some 10 m/s.
    assert (reach(motion.q) < bounds + 10 * 10 * STEP / np.pi).all()


@pytest.mark.parametrize("restitution", [0.03, 0.2, 0.6, 0.95])
def test_mujocos_dampers_give_the_restitution(restitution):
    """A touch followed in short steps, until its spring and damper would pull."""
    ratio, x, v, h = _damping_ratio(restitution), 0.0, 1.0, 1e-4
    while True:
        a = -2 * ratio * v - x
        if v < 0 <= a:
            break
        x, v = x + h * v + h * h / 2 * a, v + h * a + h * h / 2 * (-2 * ratio * a - v)
    assert -v == pytest.approx(restitution, abs=1e-4)


def test_a_scene_is_split_into_smooth_part_friction_stops_and_planes():
    scene = scene_with(JointFriction((2.5, 0.6)), JointStop("A", upper=1.0, restitution=0.3), FLOOR)
    model = approximate_model(scene)
    assert model.friction == (2.5, 0.6)
    assert (model.stops[0].joint, model.stops[0].lower, model.stops[0].upper) == (0, -np.inf, 1.0)
    assert (model.planes[0].normal, model.planes[0].friction) == ((0.0, -1.0), 0.2)
    assert smooth_part(scene).effects == (Gravity(),)
    with pytest.raises(EngineError, match="joint A must have one stop"):
        approximate_model(scene_with(JointStop("A", upper=1.0), JointStop("A", lower=0.0)))


@pytest.mark.engines
@pytest.mark.parametrize(
    ("engine", "effect"),
    [
        ("MuJoCo", JointFriction((2.5, 0.6))),
        ("PyBullet", JointFriction((2.5, 0.6))),
        ("PyBullet", Surface((0.0, 1.2), (0.0, -1.0), friction=0.3)),
    ],
    ids=["MuJoCo joint", "PyBullet joint", "PyBullet floor"],
)
def test_friction_that_slips_converges_in_first_order(engine, effect):
    """Friction is as stiff as the step resolves, and acts at the point of contact."""
    bars = Chain.uniform_bars(mass=(1.0, 1.0), length=(1.0, 1.0))
    scene = Scene(bars, (0.3, -0.4), (0.0, 0.0), 1.0, effects=(Gravity(9.81), effect))
    exact = simulate(scene, accuracy=1e-10, samples=2).q[:, -1]
    (found,) = (each for each in APPROXIMATING if each.name == engine)
    run = found.prepared(scene, found.methods[0].name, approximate=True)
    coarse, fine = (
        np.abs(run(step, np.array([0.0, 1.0])).q[:, -1] - exact).max() for step in (1e-3, 1e-4)
    )
    assert fine < coarse / 5 < 1e-3


@pytest.mark.engines
def test_friction_that_sticks_creeps_less_with_shorter_steps_in_mujoco():
    scene = Scene(
        Chain.uniform_bars(mass=(1.0, 1.0), length=(1.0, 1.0)),
        (0.3, -0.4),
        (0.0, 0.0),
        1.0,
        effects=(Gravity(9.81), JointFriction((20.0, 6.0))),
    )
    (found,) = (each for each in APPROXIMATING if each.name == "MuJoCo")
    run = found.prepared(scene, found.methods[0].name, approximate=True)
    coarse, fine = (
        np.abs(run(step, np.array([0.0, 1.0])).q[:, -1] - scene.q).max() for step in (1e-3, 1e-4)
    )
    assert 0 < fine < coarse / 5 < 1e-5
