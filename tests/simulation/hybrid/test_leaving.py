"""The motion by a small load in a mode, by its linearization."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
import scipy.linalg

from tests.simulation.hybrid import BALANCED, BARS, state_of, system_of
from twolink.arithmetic import sqrt
from twolink.contact.states import ContactState as S
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.effect import Effect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.loads import motor_loads
from twolink.simulation.hybrid.leaving import leaving
from twolink.simulation.hybrid.mode import Leaving

HALF = math.pi / 2
M, K = np.array([[4 / 3, 1 / 2], [1 / 2, 1 / 3]]), np.diag([1.5, 0.5]) * 9.81
"""M q″ = ±K q of uniform bars that stand upright or hang."""

SQUARES = scipy.linalg.eigvalsh(K, M)
BRAKES = JointFriction((1.0, 1.0))


@pytest.mark.parametrize("more", [(), (JointTorque((0.5, 0.2)),)])
@pytest.mark.parametrize("precision", ["double", "quadruple"])
def test_a_chain_that_stands_leaves_at_the_largest_rate(precision, more):
    """Whatever constant torques hold it."""
    system = system_of(Gravity(9.81), BRAKES, *more, precision=precision)
    found = leaving(system, state_of(system, (-HALF, -HALF)), (S.FORWARD, S.FORWARD))
    assert found.growth == pytest.approx(math.sqrt(SQUARES.max()), rel=1e-6)


def test_a_chain_that_hangs_is_held_back_by_its_slowest_oscillation():
    system = system_of(Gravity(9.81), BRAKES)
    found = leaving(system, state_of(system, (HALF, HALF)), (S.FORWARD, S.FORWARD))
    rates = [pytest.approx(math.sqrt(square), rel=1e-6) for square in sorted(SQUARES)]
    assert found == (0.0, *rates)
    moving = state_of(system, (HALF, HALF), (1e-3, 0.0))
    assert leaving(system, moving, (S.FORWARD, S.FORWARD)).slowest == 0.0


def test_a_brake_that_holds_leaves_one_direction_free():
    """With link 2 held to link 1 the chain is one pendulum."""
    system = system_of(Gravity(9.81), BRAKES)
    states, rate = (S.FORWARD, S.STICKS), math.sqrt(K.sum() / M.sum())
    assert leaving(system, state_of(system, (HALF, HALF)), states) == (
        0.0,
        pytest.approx(rate, rel=1e-6),
        pytest.approx(rate, rel=1e-6),
    )
    standing = leaving(system, state_of(system, (-HALF, -HALF)), states)
    assert standing.growth == pytest.approx(rate, rel=1e-6)


def test_a_chain_without_loads_is_free_and_one_that_two_brakes_hold_does_not_move():
    free, held = system_of(), system_of(BRAKES)
    assert leaving(free, state_of(free, (0.3, 0.7)), ())[:2] == (0.0, 0.0)
    assert leaving(held, state_of(held, (0.3, 0.7)), (S.STICKS, S.STICKS)) == (0.0, math.inf, 0.0)


def test_a_contact_that_turns_its_line_makes_a_balance_of_torques_unstable():
    """D slides on a floor: constant torques balance along it in one pose alone.

    The growth is that of a motion in which D stays on the floor, along its speed-up near the pose.
    """
    q, T = (-0.3, -0.4), 1.0
    d = np.array([math.cos(q[1]), -math.cos(q[0])])
    torques = JointTorque((T, -T * d[0] / (d[1] - d[0])))
    height = math.sin(q[0]) + math.sin(q[1])
    floor = Surface((0.0, height), (0.0, 1.0), on=("D",))
    system = system_of(torques, floor)
    state = state_of(system, q)._replace(touching=frozenset({0}))

    def acceleration(x):
        """Return the acceleration of q1 where D is on the floor, from rest."""
        q1 = q[0] + x
        q2 = math.asin(height - math.sin(q1))
        pose = state_of(system, (q1, q2))
        slope = -math.cos(q1) / math.cos(q2)
        (M11, M12), (_, M22) = system.formulation.mass_matrix(system.chain, pose.q)
        t1, t2 = torques.torque[0] - torques.torque[1], torques.torque[1]
        return (t1 + slope * t2) / (M11 + 2 * slope * M12 + slope * slope * M22)

    rate = (acceleration(1e-5) - acceleration(-1e-5)) / 2e-5
    assert abs(acceleration(0.0)) < 1e-12
    found = leaving(system, state, (S.CLOSED,))
    expected = math.sqrt(abs(rate))
    assert (found.growth if rate > 0 else found.slowest) == pytest.approx(expected, rel=1e-4)


def test_a_pressed_surface_holds_back_by_its_stiffness():
    soft = CompliantSurface((0.0, -1e-3), (0.0, 1.0), "kelvin-voigt", stiffness=1e4, on=("B",))
    system = system_of(soft, chain=BALANCED)
    state = state_of(system, (0.0, 0.0))._replace(touching=frozenset({0}))
    found = leaving(system, state, (S.CLOSED,))
    # Link 2 is free, so that the slowest rate is zero: nothing grows.
    assert found[:2] == (0.0, 0.0)
    assert found.fastest == pytest.approx(math.sqrt(1e4 / 3.0), rel=1e-6)


def test_damping_does_not_grow():
    system = system_of(Gravity(9.81), JointDamping((3.0, 2.0)), BRAKES)
    found = leaving(system, state_of(system, (HALF, HALF)), (S.FORWARD, S.FORWARD))
    assert found.growth == 0.0
    assert found.slowest > 0.1


@dataclass(frozen=True)
class Singular(Effect):
    """A torque that is not a number, or below zero cannot be computed."""

    known: float

    def loads(self, chain, q, u, t=0.0):
        """Return it."""
        return motor_loads(chain.scalar(self.known) * sqrt(q[0]), 0 * q[1])


@pytest.mark.parametrize("known", [1.0, math.nan])
def test_a_load_that_is_not_finite_has_an_unknown_growth(known):
    system = system_of(Singular(known), BRAKES, chain=BARS)
    assert leaving(system, state_of(system, (0.0, 0.0)), (S.FORWARD, S.FORWARD)) == Leaving(
        math.inf, 0.0
    )


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
@pytest.mark.parametrize("damping", [0.0, 1e-3])
@pytest.mark.parametrize("stiffness", [1e4, 1e8, 1e12])
def test_a_slow_fall_counts_beside_a_stiff_spring(stiffness, damping, precision):
    """With a stiff spring at B the chain falls as one rod; growth of 2.7/s counted as none."""
    stiff = JointSpring((0.0, stiffness)), JointDamping((0.0, damping * stiffness))
    for gravity, pose in ((Gravity(9.81), HALF), (Gravity(9.81, (1.0, 0.0)), 0.0)):
        system = system_of(gravity, *stiff, BRAKES, precision=precision)
        states, rate = (S.FORWARD, S.FORWARD), math.sqrt(K.sum() / M.sum())
        standing = -pose if pose else math.pi
        found = leaving(system, state_of(system, (standing, standing)), states)
        assert found.growth == pytest.approx(rate, rel=1e-2)
        hanging = leaving(system, state_of(system, (pose, pose)), states)
        assert hanging.growth == 0.0
        assert hanging.slowest == pytest.approx(rate, rel=1e-2)


@dataclass(frozen=True)
class Kinked(Effect):
    """A torque at A of the size of q1: it drives on from zero, or back on the other side."""

    def loads(self, chain, q, u, t=0.0):
        """Return it."""
        return motor_loads(4.0 * sqrt(q[0] * q[0]), 0 * q[1])


def test_a_load_with_a_kink_grows_on_the_side_on_which_it_drives_on():
    system = system_of(Kinked(), BRAKES, chain=BALANCED)
    found = leaving(system, state_of(system, (0.0, 0.0)), (S.FORWARD, S.STICKS))
    rate = pytest.approx(math.sqrt(4.0 / 3.5), rel=1e-6)
    assert found == (rate, rate, rate)
