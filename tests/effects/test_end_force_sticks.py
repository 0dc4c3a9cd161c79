"""The source's force P, whose friction may hold the end point D."""

import numpy as np
import pytest

from twolink import kinematics
from twolink.chain import Chain
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.errors import ParameterError
from twolink.scene import Scene
from twolink.simulation import simulate

BARS = Chain.uniform_bars()


def scene(*effects, q=(0.3, 1.4), u=(0.0, 0.0), duration=4.0):
    return Scene(chain=BARS, q=q, u=u, duration=duration, effects=effects, accuracy=1e-10)


def holding_force(q):
    """The force along x that keeps D from accelerating that way, from M and the loads by hand."""
    M11, M12, M22 = 4 / 3, np.cos(q[1] - q[0]) / 2, 1 / 3
    M = np.array([[M11, M12], [M12, M22]])
    Q = 9.81 * np.array([1.5 * np.cos(q[0]), 0.5 * np.cos(q[1])])
    Q = Q + -40.0 * np.array([np.cos(q[0]), np.cos(q[1])])
    J = np.array([-np.sin(q[0]), -np.sin(q[1])])
    return -J @ np.linalg.solve(M, Q) / (J @ np.linalg.solve(M, J))


@pytest.mark.parametrize(("share", "sticks"), [(1.01, True), (0.99, False)])
def test_the_threshold_of_sticking(share, sticks):
    q = (0.3, 1.4)
    mu = share * abs(holding_force(q)) / 40.0
    trajectory = simulate(scene(Gravity(), EndForce(-40.0, mu), duration=0.1))
    assert str(trajectory.events[0].mode).startswith("D sticks") == sticks
    speed = trajectory.velocity(BARS.D)[0]
    begun = trajectory.t < 0.02
    if sticks:
        assert np.all(np.abs(speed[begun]) < 1e-14)
    else:
        assert np.all(speed[begun][1:] * -holding_force(q) > 0)


def test_d_slides_sticks_and_stays():
    """Damped, the chain comes to rest with D held by friction, and x of D no longer changes."""
    effects = Gravity(), EndForce(-12.0, 0.8), JointDamping((0.5, 0.3))
    trajectory = simulate(scene(*effects, u=(0.5, -2.0), duration=8.0))
    assert any("slips" in str(event.mode) for event in trajectory.events)
    assert str(trajectory.events[-1].mode) == "D sticks"
    late = trajectory.t > trajectory.events[-1].time
    assert np.ptp(trajectory.position(BARS.D)[0][late]) < 1e-13
    assert np.abs(trajectory.velocity(BARS.D)[0][late]).max() < 1e-13


def test_the_works_are_the_change_of_kinetic_energy():
    effects = Gravity(), EndForce(-12.0, 0.3)
    trajectory = simulate(scene(*effects, u=(0.5, -2.0)))
    works, T = trajectory.work(), trajectory.kinetic_energy
    assert len(trajectory.events) > 3
    assert sum(works.values()) == pytest.approx(T - T[0], abs=1e-9)


def test_friction_of_a_named_direction_has_no_modes():
    """With friction that never lets D stop, the modes give the motion of the named direction."""
    named = simulate(scene(EndForce(-1.0, 0.1, sliding=-1), u=(2.0, 2.0), duration=0.3))
    found = simulate(scene(EndForce(-1.0, 0.1), u=(2.0, 2.0), duration=0.3))
    assert named.events == ()
    assert [str(event.mode) for event in found.events] == ["D slips backward"]
    assert found.q == pytest.approx(named.q, abs=1e-12)
    x, _ = kinematics.velocity(BARS, tuple(found.q), tuple(found.u), BARS.D)
    assert np.all(x < 0)


def test_static_friction_below_the_kinetic_is_refused():
    with pytest.raises(ParameterError, match=r"static must be finite .* 0.5; got 0.1"):
        EndForce(-1.0, 0.5, static=0.1)


@pytest.mark.parametrize(
    ("q", "sliding", "words"), [((0.0, 0.0), -1, "backward"), ((0.0, np.pi), 1, "forward")]
)
def test_a_chain_along_x_starts_to_slide_in_the_direction_of_its_acceleration(q, sliding, words):
    """D cannot move along x at first; a moment later it does, and friction resists that."""
    found = simulate(scene(Gravity(), EndForce(-3.0, 0.2), q=q, duration=0.3))
    named = simulate(scene(Gravity(), EndForce(-3.0, 0.2, sliding=sliding), q=q, duration=0.3))
    assert str(found.events[0].mode) == f"D slips {words}"
    x = found.velocity(BARS.D)[0]
    moved = found.t < (found.events[1].time if len(found.events) > 1 else 0.3)
    assert np.all(x[moved][1:] * sliding > 0)
    assert found.q[:, moved] == pytest.approx(named.q[:, moved], abs=1e-9)
