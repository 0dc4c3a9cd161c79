"""The growth of round-off along a motion, against products of flows and closed forms."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.motor_inertia import MotorInertia
from twolink.scene import Scene
from twolink.simulation.smooth.growth_along import growth_along, is_conservative
from twolink.simulation.smooth.taylor import taylor_run

# M = diag(3/2, 1/2): the links move independently.
DISKS = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (0.5, 0.5))


def along(scene, formulation="momenta", count=401):
    times = np.linspace(0.0, scene.duration, count)
    run = taylor_run(scene, times, formulation=formulation)
    return times, growth_along(scene, formulation, times, np.concatenate([run.q, run.u]))


@pytest.mark.parametrize("formulation", ["momenta", "lagrange", "kane"])
def test_errors_of_all_places_grow_as_in_a_closed_form(formulation):
    """A spring of negative stiffness in B, at rest: cosh λ t and λ sinh λ t."""
    stiffness, duration = -2.0, 4.0
    scene = Scene(DISKS, (0.0, 0.0), (0.0, 0.0), duration, (JointSpring((0.0, stiffness)),))
    times, found = along(scene, formulation)
    # q2 − q1 has the inertia 3/8; errors of speeds are as large as the speeds, which are zero.
    rate = math.sqrt(2.0 / (3 / 8))
    bound = np.sqrt(np.cumsum(np.exp(2 * rate * times)[::-1])[-1])
    assert found[-1] > math.exp(rate * duration) / 4
    assert found[-1] < 10 * rate * bound


def test_later_errors_count_where_those_of_the_start_decay():
    """A joint is damped strongly, and a torque turns the other: no error grows much."""
    damped = (JointDamping((0.0, 3.0)), JointTorque((0.5, 0.0)))
    _, found = along(Scene(DISKS, (0.0, 1.0), (1.0, 0.5), 10.0, damped))
    # In the directions that do not decay the errors of 401 places add up.
    assert math.sqrt(401) / 2 < found[-1] < 100 * found[0]


def test_a_motion_that_is_not_finite_has_an_unknown_growth():
    scene = Scene(DISKS, (0.0, 1.0), (1.0, 0.5), 1.0, (Gravity(), JointDamping((0.1, 0.1))))
    states = np.zeros((4, 3))
    states[0, 1] = np.nan
    assert np.isinf(growth_along(scene, "momenta", np.array([0.0, 0.5, 1.0]), states)).all()


@dataclass(frozen=True)
class Tilting(Gravity):
    """A gravity of one's own that depends on time, though its class has a potential energy."""

    def loads(self, chain, q, u, t=0.0):
        return super().loads(chain, q, u, t) if t < 1 else ()


def test_only_built_in_loads_are_known_to_be_conservative():
    assert is_conservative((Gravity(), JointSpring((1.0, 2.0)), MotorInertia((0.1, 0.1))))
    assert not is_conservative((Gravity(), JointDamping((0.1, 0.1))))
    assert not is_conservative((JointTorque((1.0, 0.0)),))
    assert not is_conservative((Tilting(),))
