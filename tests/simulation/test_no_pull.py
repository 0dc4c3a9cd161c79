"""A compliant surface without adhesion never pulls, whatever takes the point off it."""

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.joint_torque import JointTorque
from twolink.scene import Scene
from twolink.simulation import simulate


def test_a_point_that_is_torn_off_a_hunt_crossley_surface_is_not_held_back():
    """B is pressed 1 cm in, and −300 N m at A tear it off: 100 rad/s², at 1/a = 0.5 m/s no force.

    From there on link 1 turns as if alone, as the spring has lost its hold.
    """
    surface = CompliantSurface(
        (1.0, -0.01), (0.0, -1.0), "hunt-crossley", stiffness=1e3, loss=2.0, on=("B",)
    )
    scene = Scene(BALANCED, (0.0, 0.0), (0.0, 0.0), 0.05, (JointTorque((-300.0, 0.0)), surface))
    trajectory = simulate(scene)
    assert trajectory.met
    assert "does not push" in "".join(str(event.mode) for event in trajectory.events)
    slack = next(e.time for e in trajectory.events if "does not push" in str(e.mode))
    times = np.linspace(slack + 1e-9, 0.05, 50)
    _, (u1, _) = trajectory.at(times)
    assert np.allclose(u1, u1[0] - 100 * (times - times[0]), rtol=1e-12, atol=1e-8)
    (q1, _), (speed, _) = trajectory.at(np.array([slack]))
    assert -speed[0] * np.cos(q1[0]) == pytest.approx(0.5, rel=1e-9)
