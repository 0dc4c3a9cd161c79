"""Doubts on initial states."""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, BARS, state_of, system_of
from twolink.chain import Chain
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.doubts_of_start import doubts_of_start
from twolink.simulation.hybrid.run import hybrid_run


@pytest.mark.parametrize("roundings", [1, 7, 40, 63])
@pytest.mark.parametrize("torque", [1.0, 0.05, -1.0])
def test_a_slow_slide_that_goes_on_is_one_or_its_error_is_unknown(torque, roundings):
    """Kinetic friction 0.1 stops it, or not; static friction 10 would hold link 2 to link 1."""
    u = 1.0, 1.0 + roundings * 2.0**-52
    effects = JointFriction((0.0, 0.1), (0.0, 10.0)), JointTorque((0.0, torque))
    scene = Scene(BALANCED, (0.0, 0.0), u, 0.1, effects, 1e-9)
    system = system_of(*effects, chain=BALANCED)
    state = state_of(system, scene.q, scene.u)
    doubts = doubts_of_start(system, scene, state)
    assert state.sliding == ((0,) if roundings < 10 else (1,))
    if torque == 1.0 and roundings < 10:
        (doubt,) = doubts
        assert doubt.change == math.inf
        found = simulate(scene)
        assert found.error == math.inf
        (note,) = found.notes
        assert "round-off decides at 0 s whether a slide comes to rest (B)" in note
    else:
        assert doubts == []
    if torque == 1.0 and roundings > 10:
        # 0.9 N m on 1/2 kg m².
        assert simulate(scene).u[1, -1] == pytest.approx(1 + 0.18)


def test_the_change_of_a_start_is_zero_within_the_rounding_of_a_scene():
    scene = Scene(BARS, (0.3, 1.2), (0.5, 0.0), 1.0)
    system = system_of()
    state = state_of(system, scene.q, scene.u)
    assert doubts_of_start(system, scene, state) == []
    assert doubts_of_start(system, scene, state._replace(q=(0.3, 1.2 + 1e-16))) == []
    (doubt,) = doubts_of_start(system, scene, state._replace(q=(0.3, 1.2 + 1e-12)))
    assert doubt.change == pytest.approx(1e-12, rel=1e-3)
    (doubt,) = doubts_of_start(system, scene, state._replace(u=(0.5, 1e-13)))
    assert (doubt.time, doubt.change) == (0.0, 1e-13)


@pytest.mark.parametrize(
    ("poisson", "q", "u"),
    [
        (0.0, (0.5438052549926178, 0.5081237125311805), (0.0, 0.0)),
        (0.0, (0.5399663084049074, 0.511892266231952), (0.0, 0.0)),
        (0.5, (0.6438014563256378, 0.41630123494384713), (-0.3, -0.3)),
    ],
)
def test_a_press_to_a_depth_at_which_the_force_jumps_is_decided_in_longer_numbers(poisson, q, u):
    """Starts within 2e-20 m of it: errors of 3e-13 rad/s were reported, and 0.15 to 0.5 true."""
    floor = CompliantSurface(
        (0.0, 1.0), (0.0, -1.0), "elasto-plastic", radius=0.05, modulus=(1e8, 2e11),
        poisson=(poisson, poisson), strength=(1e7, 1e9), name="floor",
    )  # fmt: skip
    scene = Scene(BARS, q, u, 0.05, (Gravity(), floor), accuracy=1e-9)
    motion = simulate(scene, samples=26)
    assert (motion.met, motion.precision) == (True, "quadruple")
    exact = hybrid_run(scene, motion.t, precision="quadruple", formulation="kane")
    off = np.abs(np.concatenate([motion.q - exact.q, motion.u - exact.u])).max()
    assert float(off) <= motion.error


@pytest.mark.parametrize(("speed", "doubts"), [(-0.3, 1), (0.0, 1), (0.3, 0)])
def test_a_point_that_moves_in_passes_a_jump_at_once(speed, doubts):
    floor = CompliantSurface(
        (0.0, 1.0), (0.0, -1.0), "elasto-plastic", radius=0.05, modulus=(1e8, 2e11),
        poisson=(0.0, 0.0), strength=(1e7, 1e9),
    )  # fmt: skip
    scene = Scene(
        BARS, (0.9205344710695248, 0.2095396394398229), (speed, speed), 0.05, (Gravity(), floor)
    )
    system = system_of(*scene.effects)
    found = doubts_of_start(system, scene, state_of(system, scene.q, scene.u))
    assert [doubt.change for doubt in found] == [math.inf] * doubts


@pytest.mark.parametrize("margin", [1e-10, 1e-12])
def test_a_load_slightly_above_a_static_limit_slides_from_the_start(margin):
    """The links turn together, with 1 N m of 2 N m and a little more, on 3.5 kg m²."""
    effects = JointTorque((2.0 + margin, 0.0)), JointFriction((1.0, 1.0), (2.0, 1.0))
    run = simulate(Scene(BALANCED, (0.0, 0.0), (0.0, 0.0), 1.0, effects))
    assert run.met
    assert abs(run.u[0, -1] - (1.0 + margin) / 3.5) <= run.error + 1e-16


DISKS = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (0.5, 0.5))


def above_wall(gap, speed, torque, duration=1.0):
    """Return link 1 on a level, whose end B approaches a wall along its path from a gap (m)."""
    normal = (-0.6, -0.8)
    place = normal[0] * math.cos(1.0) + normal[1] * math.sin(1.0) - gap
    wall = Surface((place * normal[0], place * normal[1]), normal, ("B",), 1.0)
    effects = (wall, JointTorque((torque, 0.0)))
    return Scene(DISKS, (1.0, 1.0), (speed, 0.0), duration, effects, 1e-9)


@pytest.mark.parametrize(("speed", "rate"), [(-1e-9, 1e-3), (-1e-7, 1.0), (-1e-6, 50.0)])
def test_an_impact_that_a_load_may_prevent_is_in_doubt(speed, rate):
    """Within roundings of a place the point counts as touching; in truth it never does."""
    scene = above_wall(2.7e-15, speed, 1.5 * rate, 0.1)
    found = simulate(scene)
    missed = abs(found.u[0, -1] - (speed + rate * 0.1))
    assert missed > abs(speed)
    assert missed <= found.error
    if 2 * abs(speed) > 1e-9:
        assert not found.met


@pytest.mark.parametrize(("speed", "most"), [(-1.0, 1e-12), (-1e-3, 1e-9), (-1e-9, 1e-7)])
def test_an_impact_that_comes_slightly_later_is_late_by_that_time(speed, most):
    scene = above_wall(1e-15, speed, 0.0, 0.01)
    found = simulate(scene)
    late = 1e-15 / (0.0726 * abs(speed))
    assert min(late, 2 * abs(speed)) / 2 < found.error < most
    # A point that recedes, or is on the wall exactly, has no such impact.
    away = above_wall(1e-15, -speed, 0.0, 0.01)
    assert simulate(away).error < 1e-13
