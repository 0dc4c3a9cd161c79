"""Numbers of steps of Taylor series, against runs by them."""

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.sampled_torque import SampledTorque
from twolink.scene import Scene
from twolink.simulation.smooth.numeric import numeric_run
from twolink.simulation.smooth.stiffness import steps_of_series
from twolink.simulation.smooth.taylor import taylor_run

TIMES = np.linspace(0.0, 2.0, 101)


def scene(*effects, u=(0.5, -0.2)):
    return Scene(Chain.uniform_bars(), (0.3, 1.2), u, 2.0, effects)


@pytest.mark.parametrize(
    "given",
    [
        scene(Gravity()),
        scene(Gravity(), u=(40.0, -30.0)),
        scene(Gravity(), JointSpring((3e3, 5e3))),
        scene(Gravity(), JointDamping((400.0, 300.0))),
    ],
    ids=["falls", "spins", "stiff springs", "strong dampers"],
)
def test_the_number_is_that_of_a_run_within_a_small_factor(given):
    run = taylor_run(given, TIMES, formulation="lagrange", longest_step=given.duration)
    found = steps_of_series(given, TIMES, run)
    assert run.steps / 12 < found < 12 * run.steps


def test_dampers_that_take_too_many_steps_are_seen_along_a_run_of_another_method():
    given = scene(Gravity(), JointDamping((1e8, 1e8)), u=(0.0, 0.0))
    run = numeric_run(given, TIMES, method="Radau", formulation="lagrange", setting=1e-6)
    assert steps_of_series(given, TIMES, run) > 1e8


def test_pieces_of_effects_and_motions_that_are_not_finite():
    torque = SampledTorque((0.0, 1.0), (1.0, 2.0), (0.0, 0.0), "hold")
    run = taylor_run(scene(Gravity()), TIMES, formulation="lagrange")
    assert 0 < steps_of_series(scene(Gravity(), torque), TIMES, run) < 1e3
    run.q[0, 3] = np.nan
    assert steps_of_series(scene(Gravity()), TIMES, run) == np.inf
