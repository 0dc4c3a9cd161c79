"""Undecided conditions, decided by the next derivatives."""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, state_of, system_of
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.simulation.hybrid.complementarity import problem_at
from twolink.simulation.hybrid.confirm import Derivatives, _leading
from twolink.simulation.hybrid.jet import Jet, Recording
from twolink.simulation.hybrid.jump import settle
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.noise import Zero
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.select import select
from twolink.simulation.hybrid.trials import Trials


def selected(system, state, known=None):
    return select(system, state, Pose(system.chain, system.formulation, state.q), known or {})


def states_of(*effects, q=(0.0, 0.0), u=(0.0, 0.0), **more):
    system = system_of(*effects, **more)
    return selected(system, state_of(system, q, u)).states


@pytest.mark.parametrize(("amplitude", "expected"), [(1.0, S.OPEN), (-1.0, S.CLOSED)])
def test_a_contact_without_force_opens_or_closes_as_its_force_begins(amplitude, expected):
    """A torque that grows as sin t from zero, away from the stop or onto it."""
    torque = JointTorque((0.0, 0.0), (amplitude, 0.0), (1.0, 0.0))
    assert states_of(torque, JointStop("A", lower=0.0), chain=BALANCED) == (expected,)


@pytest.mark.parametrize("amplitude", [1.0, -1.0])
def test_a_joint_without_a_static_limit_begins_to_slide_as_its_torque_begins(amplitude):
    """1 N m are needed, and are just held; a moment later the torque is larger."""
    torque = JointTorque((amplitude, 0.0), (amplitude, 0.0), (1.0, 0.0))
    expected = S.FORWARD if amplitude > 0 else S.BACKWARD
    found = states_of(torque, JointFriction((1.0, 0.0)), chain=BALANCED)
    assert found == (expected,)


def test_in_the_stretched_pose_higher_derivatives_decide_the_direction_of_sliding():
    """Stretched along x, D has no speed and no acceleration along x. Falling, it moves inwards."""
    assert states_of(Gravity(9.81), EndForce(-1.0, 0.3), q=(0.0, 0.0)) == (S.BACKWARD,)
    assert states_of(Gravity(9.81), EndForce(-1.0, 0.3), q=(math.pi, math.pi))[0] is S.FORWARD


def test_in_the_stretched_pose_a_wall_that_cannot_push_opens():
    wall = Surface((2.0, 0.0), (-1.0, 0.0), name="wall")
    assert states_of(Gravity(9.81), wall, q=(0.0, 0.0)) == (S.OPEN,)


def test_a_force_without_any_derivative_is_zero_within_the_round_off_of_all_forces():
    """The chain hangs, and touches a wall at B: its weight of 15 N m is balanced."""
    wall = Surface((0.0, 0.0), (-1.0, 0.0), on=("B",), name="wall")
    system = system_of(Gravity(9.81), wall)
    found = selected(system, state_of(system, (math.pi / 2, math.pi / 2)))
    assert found.states == (S.CLOSED,)
    leaves = found.orders[Trigger(EventKind.LEAVES, 0)]
    assert isinstance(leaves, Zero)
    assert 1e-16 < leaves.size < 1e-8


@pytest.mark.parametrize("law", ["hertz", "hunt-crossley"])
def test_a_point_in_the_base_presses_on_a_surface_however_the_links_turn(law):
    """C1 lies in A: its depth does not depend on q."""
    chain = Chain((1.0, 0.8), (1.0, 1.0), ((0.0, 0.0), (0.5, 0.0)), (0.1, 0.2))
    soft = CompliantSurface((0.0, -5e-4), (0.0, -1.0), law, 1e5, on=("C1",), friction=0.5)
    system = system_of(Gravity(9.81), soft, chain=chain)
    found = selected(system, state_of(system, (0.3, 0.3)))
    assert found.states == (S.CLOSED,)


def test_derivatives_begin_at_the_depth_of_the_state():
    """D is pressed 1/64 m deep by link 1, and friction, just at its limit, holds link 2.

    A moment later its torque is larger. By the depth of q the friction could be larger, too.
    """
    root = 0.125 * (1 - 1e-6)
    force = 512 * root**3
    torque = JointTorque((1.5 * force, 0.5 * force), (0.0, 1.0), (1.0, 1.0))
    floor = CompliantSurface((0.0, 1 - 1 / 64), (0.0, -1.0), "hertz", 512.0, friction=0.5)
    system = system_of(torque, floor, chain=BALANCED)
    state = state_of(system, (0.0, math.pi / 2))
    (own,) = state.compliant
    assert own.sqrt_depth == pytest.approx(0.125)
    found = selected(system, state._replace(compliant=(own._replace(sqrt_depth=root),)))
    assert found.states == (S.BACKWARD,)
    assert found.confirmed


def test_a_mode_that_every_derivative_contradicts_is_not_confirmed(monkeypatch):
    """The chain at rest on both frictions, at their limits: no mode passes if none is confirmed."""
    friction = JointFriction((1.0, 1.0))
    system = system_of(friction, chain=BALANCED)
    state = state_of(system, (0.0, 0.0))
    pose = Pose(system.chain, system.formulation, state.q)
    assert select(system, state, pose, {}).confirmed
    monkeypatch.setattr(Derivatives, "confirmed", lambda self, candidate: None)
    candidates = Trials.candidates
    monkeypatch.setattr(
        Trials,
        "candidates",
        lambda *own, **more: (c._replace(undecided=(None,)) for c in candidates(*own, **more)),
    )
    assert not select(system, state, pose, {}).confirmed


def jet_of(*terms):
    """Return a jet of some terms, with one more, which is left out."""
    jet = Jet((terms[0],), Recording())
    jet.terms[:] = [*terms, 0.0]
    return jet


def near_its_limit(margin):
    """Return a system whose joint A, which can hold 2 N m, has 1 N m more in a second.

    It has `margin` (s) left, by less than round-off. Sliding, it has 1 N m, and turns link 1 with
    1/3 rad/s².
    """
    torque = JointTorque((2.0 - margin, 0.0), (1.0, 0.0), (1.0, 0.0))
    return system_of(torque, JointFriction((1.0, 0.0), (2.0, 0.0)), chain=BALANCED)


def test_a_mode_that_holds_a_little_longer_within_round_off_has_a_delay():
    system = near_its_limit(1e-10)
    state = state_of(system, (0.0, 0.0))
    options = system.options(state.touching, state.sliding)
    problem = problem_at(system, state, system.pose(state.q), options)
    derivatives = Derivatives(problem)
    (stuck,) = (c for c in Trials(problem).candidates(False) if c.states == (S.STICKS,))
    assert derivatives.confirmed(stuck) is None
    (delay,) = derivatives.delays.values()
    assert delay.time == pytest.approx(1e-10, rel=1e-4)
    assert delay.trigger == Trigger(EventKind.BREAKS, 0, 1)


@pytest.mark.parametrize("margin", [1e-10, 0.0, -1e-10])
def test_a_slide_that_begins_a_little_too_early_is_a_doubt(margin):
    system = near_its_limit(margin)
    state = state_of(system, (0.0, 0.0))
    found = selected(system, state)
    assert found.states == (S.FORWARD,)
    doubts = settle(system, state, {}).doubts
    if margin > 0:
        assert found.early.change == pytest.approx(margin / 3, rel=1e-4)
        assert [doubt.change for doubt in doubts] == [found.early.change]
    else:
        assert (found.early, doubts) == (None, ())


def test_several_derivatives_within_round_off_give_a_bound_on_the_delay():
    """With the terms 1e-12 + 1e-11 t − t³ the root is at 1.0e-4 s: t³ = 1e-12 + 1e-11 t."""
    found = _leading(jet_of(1e-12, 1e-11, 0.0, -1.0), 1e-10, 1.0)
    assert (found.order, found.sign) == (3, -1)
    root = max(np.roots([-1.0, 0.0, 1e-11, 1e-12]).real)
    assert root <= found.delay <= 3 * root
    assert _leading(jet_of(-1e-12, 0.0, 0.0, -1.0), 1e-10, 1.0).delay == 0.0
    assert _leading(jet_of(1e-12, 1e-11, 0.0, 1.0), 1e-10, 1.0).delay == 0.0
