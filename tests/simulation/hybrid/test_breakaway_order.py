"""The order of breakaways at one instant: a choice of the simulator, which is noted."""

import math

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.joint_friction import JointFriction
from twolink.effects.sampled_torque import SampledTorque
from twolink.scene import Scene
from twolink.simulation import simulate

RAMP = SampledTorque((0.0, 1.0), (0.0, 4.0), (0.0, 2.0), "linear")
TOGETHER = "are reached at one instant"


def simulated(*frictions):
    scene = Scene(Chain.uniform_bars(), (0.0, 0.0), (0.0, 0.0), 1.0, (RAMP, *frictions))
    return simulate(scene, samples=3)


def friction(joint, static, share=0.5):
    """Return friction in one joint, of which a share is left when it slides."""
    kinetic, limit = [0.0, 0.0], [0.0, 0.0]
    kinetic[joint], limit[joint] = share * static, static
    return JointFriction(tuple(kinetic), tuple(limit))


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_limits_that_are_reached_together_are_noted(order):
    """The torques are 4 t and 2 t: limits of 1 and 0.5 N m are both reached at 0.25 s."""
    limits = friction(0, 1.0), friction(1, 0.5)
    first, second = ("AB"[k] for k in order)
    motion = simulated(*(limits[k] for k in order))
    (note,) = (note for note in motion.notes if TOGETHER in note)
    assert note.startswith(f"At 0.25 s the static limits of {first} and {second} {TOGETHER}: ")
    assert f"{first} is the first to slide" in note

    # The laws do not determine the motion.
    assert motion.error == math.inf


def test_the_motion_depends_on_the_order():
    one, other = (
        simulated(*pair).q[:, -1]
        for pair in (
            (friction(0, 1.0), friction(1, 0.5)), (friction(1, 0.5), friction(0, 1.0)),
        )
    )  # fmt: skip
    assert np.abs(one - other).max() > 0.05


@pytest.mark.parametrize(
    "frictions",
    [
        # One limit is reached 0.1 ms later.
        (friction(0, 1.0), friction(1, 0.5002)),
        # Friction that does not drop: the order changes nothing.
        (friction(0, 1.0, 1.0), friction(1, 0.5, 1.0)),
        (friction(0, 1.0), friction(1, 0.5, 1.0)),
    ],
)
def test_limits_that_are_reached_apart_or_without_a_drop_are_not_noted(frictions):
    assert not any(TOGETHER in note for note in simulated(*frictions).notes)
