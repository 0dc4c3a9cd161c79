"""The rates of damping against mass matrices and derivatives by hand, and the factors."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from twolink import lagrange
from twolink.chain import Chain
from twolink.effects import Effect
from twolink.effects.end_drag import EndDrag
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.loads import motor_loads
from twolink.simulation.smooth.forgotten import damping_rates, factor_of

BARS = Chain.uniform_bars((1.3, 0.7), (0.9, 1.1))


@dataclass(frozen=True)
class Pushing(Effect):
    """A negative damper in joint A, and a positive one in joint B."""

    coefficient: float

    def loads(self, chain, q, u, t=0.0):
        c = chain.scalar(self.coefficient)
        return motor_loads(c * u[0], -3 * c * (u[1] - u[0]))


def states(random, count):
    return random.uniform(-3, 3, (2, count)), random.uniform(-5, 5, (2, count)), np.ones(count)


def inertia(q):
    return np.array(lagrange.mass_matrix(BARS, (float(q[0]), float(q[1]))), dtype=float)


def of_joints(first, second):
    """Return the damping matrix of two joints, in absolute angles."""
    return np.array([[first + second, -second], [-second, second]])


def test_the_rates_of_dampers_are_those_of_their_matrix(random):
    q, u, t = states(random, 20)
    found = damping_rates(BARS, (Gravity(), JointDamping((0.3, 0.5))), q, u, t)
    for k in range(20):
        rates = np.linalg.eigvals(np.linalg.solve(inertia(q[:, k]), of_joints(0.3, 0.5)))
        assert found[k] == pytest.approx(rates.real.sum(), rel=1e-9)


def test_drag_is_a_damper_along_the_path_of_the_tip(random):
    q, u, t = states(random, 5)
    found = damping_rates(BARS, (EndDrag(0.4),), q, u, t)
    (L1, L2), (q1, q2) = BARS.length, q
    for k in range(5):
        rows = np.array(
            [
                [-L1 * math.sin(q1[k]), -L2 * math.sin(q2[k])],
                [L1 * math.cos(q1[k]), L2 * math.cos(q2[k])],
            ]
        )
        expected = np.trace(np.linalg.solve(inertia(q[:, k]), 0.4 * rows.T @ rows))
        assert found[k] == pytest.approx(expected, rel=1e-9)


def test_a_rate_that_feeds_a_motion_does_not_count(random):
    q, u, t = states(random, 5)
    found = damping_rates(BARS, (Pushing(0.2),), q, u, t)
    for k in range(5):
        rates = np.linalg.eigvals(np.linalg.solve(inertia(q[:, k]), of_joints(-0.2, 0.6))).real
        assert rates.min() < 0
        assert found[k] == pytest.approx(rates.max(), rel=1e-9)


def test_loads_that_do_not_depend_on_speeds_have_no_rates(random):
    q, u, t = states(random, 5)
    effects = (Gravity(), JointSpring((1e5, 2.0)), JointTorque((1e9, 3.0)))
    assert not damping_rates(BARS, effects, q, u, t).any()


def test_rates_of_lanes_do_not_depend_on_their_neighbours(random):
    """Times and states have a row for each step of each lane."""
    q, u, _ = states(random, 6)
    effects = (JointDamping((0.1, 0.3)), EndDrag(0.2))
    found = damping_rates(BARS, effects, q.reshape(2, 3, 2), u.reshape(2, 3, 2), np.ones((3, 2)))
    for lane in range(2):
        alone = damping_rates(BARS, effects, q[:, lane::2], u[:, lane::2], np.ones(3))
        assert found[:, lane].tolist() == alone.tolist()


def test_factors_beyond_any_use_are_unknown():
    assert factor_of(np.array([0.0, 1.0, 1e4, np.nan])).tolist() == [1.0, math.e, np.inf, np.inf]
