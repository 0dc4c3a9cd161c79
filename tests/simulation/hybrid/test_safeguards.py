"""Each safeguard of the event-driven run is needed: without it a law of mechanics is broken.

Each test takes the safeguard away from a scene in which the law holds with it. None of them is part
of the compiled code of a mode, so no compiled mode has to be forgotten.
"""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, BARS, ONTO, STOP, mode_of, state_of, system_of
from twolink.contact.states import ContactState
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.errors import IntegrationError
from twolink.scene import Scene
from twolink.simulation.hybrid import (
    certificate,
    end_of_arc,
    flow,
    impact,
    painleve,
    reactions,
    start,
    tolerances,
    trials,
)
from twolink.simulation.hybrid.bernstein import margins_of
from twolink.simulation.hybrid.certificate import Certificate
from twolink.simulation.hybrid.compile import Compiler
from twolink.simulation.hybrid.conditions import Law
from twolink.simulation.hybrid.run import hybrid_run


def motion(scene):
    """Return 1001 times of a scene (s), and q and u at them."""
    times = np.linspace(0, scene.duration, 1001)
    run = hybrid_run(scene, times)
    return times, run.q, run.u


# The event certificate


def by_values_at_ends(coefficients, rounding):
    """Return the values at the ends of steps as margins: no look in between."""
    _, bernstein, bounds = margins_of(coefficients, rounding)
    return bernstein[:, -1], bernstein, bounds


@pytest.mark.parametrize("depth", [1e-6, 1e-9])
def test_a_dip_between_the_ends_of_a_step_is_an_impact(depth, monkeypatch):
    """Link 1 swings down to a floor that bars B the lowest 1 µm or 1 nm of its circle.

    B would be below the floor for a millisecond or less, while a step takes about 20 ms. It can
    get to the other side through the floor only.
    """
    floor = Surface((0.0, 1 - depth), (0.0, -1.0), on=("B",), restitution=0.5)
    scene = Scene(BARS, (math.pi / 2 - 1, math.pi / 2), (0.0, 0.0), 1.5, (Gravity(9.81), floor))
    at_floor = math.asin(1 - depth)
    _, (q1, _), _ = motion(scene)
    assert q1.max() <= at_floor + 1e-9
    assert q1.max() > at_floor - 0.01

    monkeypatch.setattr(certificate, "margins_of", by_values_at_ends)
    _, (q1, _), _ = motion(scene)
    assert q1.max() > at_floor + 0.1


# The deflation of event functions that start at zero


def not_deflated(self, every, block):
    """Leave event functions that start at zero as they are."""


def off_for_a_step(self, every, block):
    """Switch event functions off for the first step if they start at zero."""
    starts = every[0, :, 0] == 0
    every[0, starts] = 0
    every[0, starts, 0] = 1


def test_a_bounce_within_the_first_step_does_not_pass_the_stop(monkeypatch):
    """The gap is zero after each impact, and zero again before the first step is over."""
    scene = Scene(BALANCED, (1.0, 0.0), (0.0, 0.0), 4.0, (ONTO, STOP))
    _, (angle, _), _ = motion(scene)
    assert angle.min() >= -1e-14

    monkeypatch.setattr(Certificate, "_deflate", off_for_a_step)
    _, (angle, _), _ = motion(scene)
    assert angle.min() < -0.1


def test_a_low_bounce_keeps_its_flight(monkeypatch):
    """From the stop with 1e-9 rad/s against −2 rad/s²: back after 1e-9 s, 1e-7 of a step."""
    system = system_of(ONTO, STOP, chain=BALANCED)
    state = state_of(system, (0.0, 0.0), (1e-9, 0.0))
    mode = mode_of(system, ContactState.OPEN)

    def flight():
        return flow.flow(system, state, mode, 1.0, Compiler("lagrange"), lambda t, size: None).end.t

    assert flight() == pytest.approx(1e-9, rel=1e-12)
    monkeypatch.setattr(Certificate, "_deflate", not_deflated)
    assert flight() == 0


def test_friction_does_not_drive_a_joint_that_stops_within_the_first_step(monkeypatch):
    """A torque of 2 sin t breaks the joint loose at 1.9 N m, and is never negative here.

    The speed is zero when the slide begins, and again before the first step is over.
    """
    torque = JointTorque((0.0, 0.0), (2.0, 0.0), (1.0, 0.0))
    scene = Scene(BALANCED, (0.0, 0.0), (0.0, 0.0), 3.0, (torque, JointFriction((1.9, 0.0))))
    _, _, (speed, _) = motion(scene)
    assert speed.max() > 0.01
    assert speed.min() >= 0

    monkeypatch.setattr(Certificate, "_deflate", off_for_a_step)
    with pytest.raises(IntegrationError, match="A comes to rest, and round-off does not decide"):
        motion(scene)
    monkeypatch.setattr(tolerances, "MOST_STOPPED", math.inf)
    _, _, (speed, _) = motion(scene)
    assert speed.min() < -0.01


@pytest.mark.parametrize("removed", [not_deflated, off_for_a_step])
def test_a_slide_that_friction_locks_already_is_not_locked_again(removed, monkeypatch):
    """D slides along a floor in Painlevé's region while the chain is pulled off.

    The response of the normal to its own push is negative from the start, which is no event.
    """
    q = (1.1, 1.3)
    height = np.sin(q).sum()
    floor = Surface((0.0, float(height)), (0.0, -1.0), friction=1.0)
    u = tuple(map(float, np.linalg.solve([-np.cos(q), -np.sin(q)], [0.0, 0.01])))
    scene = Scene(BARS, q, u, 0.2, (Gravity(9.81, (0.0, -1.0)), floor))
    _, angles, _ = motion(scene)
    assert np.sin(angles).sum(axis=0).max() <= height + 1e-14

    monkeypatch.setattr(Certificate, "_deflate", removed)
    with pytest.raises(IntegrationError, match="modes follow each other without end at 0 s"):
        motion(scene)


# Complementarity with the other constraints in place


def each_alone(others):
    """Return the values of conditions with all other joints in one state, whatever the mode."""
    whole = trials.value_of

    def value_of(system, equations, condition, du, forces):
        if condition.law is Law.WITHIN_LIMIT:
            states = [others] * len(system.elements)
            states[condition.number] = ContactState.STICKS
            du, every = trials.solve(equations, system.elements, states)
            forces = every[condition.number]
        return whole(system, equations, condition, du, forces)

    return value_of


def test_a_chain_rests_where_its_joints_can_hold_it_together(monkeypatch):
    """−0.5 N m at A, which holds 1 N m, and 2 N m at B, which holds 3 N m: nothing moves.

    Were B free, its motor would press link 1 back with 2 N m more, and A would break loose.
    """
    friction = JointFriction((0.2, 1.0), (1.0, 3.0))
    torque = JointTorque((-0.5, 2.0))
    scene = Scene(BALANCED, (0.0, 0.0), (0.0, 0.0), 1.0, (torque, friction))
    _, q, _ = motion(scene)
    assert np.all(q == 0)

    monkeypatch.setattr(trials, "value_of", each_alone(ContactState.OPEN))
    _, q, _ = motion(scene)
    assert q[:, -1].max() < -0.04


def test_a_joint_gives_no_more_than_its_static_limit(monkeypatch):
    """30 N m at A: link 2 of 0.5 kg m², that B turns along with at most 1 N m.

    Were A held, B would have nothing to do, and would stick: it takes 4.2 N m to turn link 2 along.
    """
    friction = JointFriction((0.5, 0.5), (1.0, 1.0))
    scene = Scene(BALANCED, (0.0, 0.0), (0.0, 0.0), 1.0, (JointTorque((30.0, 0.0)), friction))
    times, _, (_, u2) = motion(scene)
    assert np.all(0.5 * u2 <= 1.0 * times)
    assert u2[-1] > 0.1

    monkeypatch.setattr(trials, "value_of", each_alone(ContactState.STICKS))
    times, _, (_, u2) = motion(scene)
    assert np.all(0.5 * u2[1:] > 4.0 * times[1:])


# Projection to exact rest


def test_a_chain_that_has_come_to_rest_stays(monkeypatch):
    """D slides along a smooth floor until the friction of both joints has stopped the chain.

    All slides end at once, and static friction holds afterwards. Where speeds keep their
    rounding, a joint has a direction of sliding still, and only its kinetic friction resists.
    """
    floor = Surface((0.0, 1.4), (0.0, -1.0))
    friction = JointFriction((0.5, 0.5), (4.0, 4.0))
    starts = (0.3, 1.2), (0.3, 1.25), (0.35, 1.15)
    scenes = [Scene(BARS, q, (0.0, 0.0), 4.0, (Gravity(9.81), floor, friction)) for q in starts]

    def rests(scene):
        times, q, u = motion(scene)
        late = times > 1
        return bool(np.all(u[:, late] == 0) and np.all(q[:, late] == q[:, -1:]))

    assert all(rests(scene) for scene in scenes)

    for module in (end_of_arc, impact, painleve, reactions, start):
        monkeypatch.setattr(module, "stopped", lambda pose, coordinates, u, *errors: u)
    assert not all(rests(scene) for scene in scenes)
