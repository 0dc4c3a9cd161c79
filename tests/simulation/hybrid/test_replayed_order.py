import pytest

from tests.simulation.hybrid import BARS, mode_of, system_of
from tests.simulation.hybrid.stopping_slides import first_arc
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind
from twolink.effects.joint_friction import JointFriction
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.replayed_order import (
    LOADS,
    Instant,
    Switch,
    are_alike,
    bound_slides,
    followed,
)

A, B = Trigger(EventKind.STOPS, 0, -1), Trigger(EventKind.STOPS, 1, 1)


def after(*order, torque=None):
    """Return the outcome after events in an order; a torque (N m) in B may come as a jump."""
    system, arc = first_arc()
    switch = None
    if torque is not None:
        friction, loads = system.effects
        loads = SampledTorque((0.0,), loads.A, (torque,), "hold")
        switch = Switch(arc.end.t, system.with_effects((friction, loads)))
    return followed(Instant.of(system, arc, order, switch), order)


def test_slides_that_stop_have_no_speed_at_the_instant():
    instant = Instant.of(*first_arc(1.5e-4), (A, B), None)
    assert instant.state.u == (0.0, 0.0)
    assert instant.resting == {0, 1}


def test_the_joint_that_stops_last_is_held_or_slides_on():
    """If A stops first, B stops as well and holds 1 N m; else A's friction turns B back."""
    held, slides = after(A, B), after(B, A)
    assert held.mode.states == (S.STICKS, S.STICKS)
    assert [float(x) for x in held.du] == [0.0, 0.0]
    assert slides.mode.states == (S.STICKS, S.BACKWARD)
    assert [float(x) for x in slides.du] == [0.0, pytest.approx(-0.5)]
    assert not are_alike(held, slides)
    assert are_alike(held, after(A, B))


def test_loads_that_jump_before_or_after_a_stop():
    """By a torque of −0.4 N m, below the kinetic friction of B, it stops in either order."""
    outcomes = [after(*order, torque=-0.4) for order in ((LOADS, A, B), (A, B, LOADS))]
    assert all(each.mode.states == (S.STICKS, S.STICKS) for each in outcomes)
    assert are_alike(*outcomes)


def test_outcomes_without_a_mode_are_alike_only_with_each_other():
    assert are_alike(None, None)
    assert not are_alike(None, after(A, B))


def test_slides_that_constraints_bind_stop_together():
    """A floor holds the height of D: one speed gives the others, also that of D along it."""
    floor = Surface((0.0, 1.2), (0.0, -1.0), friction=0.1, name="floor")
    system = system_of(JointFriction((1.0, 0.0)), floor, chain=BARS)
    assert system.names == ("A", "D on floor")
    assert bound_slides(system, mode_of(system, S.FORWARD, S.OPEN), 0) == [0]
    assert bound_slides(system, mode_of(system, S.FORWARD, S.BACKWARD), 0) == [0, 1]
    assert bound_slides(system, mode_of(system, S.FORWARD, S.BACKWARD), 1) == [0, 1]
