"""Contacts that are made at one instant: of one point twice, and of two points of a link."""

import math
from itertools import pairwise

import numpy as np
import pytest

from tests.campaign.checks import violations
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.end_drag import EndDrag
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.run import hybrid_run

Q = (0.3, 1.1)
TORQUE = SampledTorque((0.0, 0.05, 1.0), (0.0, 0.5, 0.5), (0.0, 0.0, 0.0), interpolation="hold")


def sliding(*points):
    """Return the motion of a chain whose end slides on a floor while a torque jumps."""
    floor = Surface(
        (0.0, math.sin(Q[0]) + math.sin(Q[1])), (0.0, -1.0), on=points, friction=0.3, name="floor"
    )
    x, y = -np.sin(Q), np.cos(Q)
    u = np.linalg.solve([x, y], [1.5, 0.0])
    scene = Scene(
        Chain.point_masses((1.0, 1.0), (1.0, 1.0)), Q, tuple(u.tolist()), 0.1,
        (Gravity(), TORQUE, floor),
    )  # fmt: skip
    return simulate(scene)


def test_a_point_that_is_named_twice_slides_on_through_a_jump_of_the_torque():
    """The force on one contact or on the other is the same, and so is the motion."""
    once, twice = sliding("D"), sliding("C2", "D")
    assert once.met
    assert twice.met
    assert twice.q == pytest.approx(once.q, abs=1e-9)
    assert "slips" in str(twice.events[-1].mode)
    assert not any("sticks" in str(event.mode) for event in twice.events)


@pytest.mark.parametrize("order", [15, 21])
def test_a_point_that_is_named_twice_lifts_off_once(order):
    """The normal force vanishes within rounding, by which the gap of either contact may fall."""
    chain = Chain.point_masses(
        (0.648725625742506, 1.106023610961005), (0.4456456525894935, 1.6539289625329308)
    )
    wall = Surface(
        (0.41976111726162324, -0.1496684739923186), (0.8516110016691169, 0.5241743048224735),
        on=("C1", "B"),
    )  # fmt: skip
    effects = (
        Gravity(14.126091590344748, direction=(0.9459535455965923, 0.32430215783006405)),
        JointFriction((0.0, 1.6641036104305116), (0.0, 2.6327104308052833)),
        wall,
    )
    q, u = (-0.3425036459091322, -2.710366463856534), (0.0, 4.293165952518622)
    run = hybrid_run(Scene(chain, q, u, 0.5, effects), [0.0, 0.5], order=order)
    assert [str(arc.mode) for arc in run.arcs if arc.end.t > arc.start.t] == [
        "B slips forward, C1 on surface rests",
        "B slips forward",
    ]


@pytest.mark.parametrize("on", [("C2", "D"), ("D", "C2")])
def test_a_jammed_slide_throws_both_names_of_a_point_off_the_surface(on):
    """An impact without collision gives the point a normal speed of 0.014 m/s; it jammed at 0 s.

    One of the names stayed in contact, and "sticks" with this speed was the mode from there on.
    """
    mass, length = (2.94085169812262, 0.44394324819789327), (0.379350812381307, 0.35461037766314607)
    chain = Chain.point_masses(mass, length)
    q, u = (0.7216611321859654, -1.772289219446069), (0.26687524631900317, 1.0709091830809283)
    height = length[0] * math.sin(q[0]) + length[1] * math.sin(q[1])
    effects = Gravity(), EndDrag(1.0079335580452513)

    def motion(points):
        floor = Surface(
            (0.0, height), (0.0, -1.0), on=points, restitution=0.4113663962707481,
            friction=0.6263089440537056,
        )  # fmt: skip
        return simulate(Scene(chain, q, u, 0.5, (*effects, floor)))

    one, both = motion(("D",)), motion(on)
    assert one.impacts[0].speeds == pytest.approx((0.0, 0.01388), abs=1e-5)
    assert violations(both) == []
    assert np.abs(both.q - one.q).max() <= one.error + both.error
    # The point rests after its last small bounce.
    assert str(both.events[-1].mode).endswith("on surface sticks")


@pytest.mark.parametrize("length", [0.3, 0.7])
@pytest.mark.parametrize("angle", [0.0, 0.7, 1.1, -0.4])
def test_a_link_that_falls_flat_onto_a_cushion_through_A_slides_towards_A(angle, length):
    """B and C1 touch at once, where their tangential speed is zero, and turn towards A beyond.

    The sign of that speed is round-off of the pose, which differs with the angle of the surface.
    """
    normal = (math.sin(angle), -math.cos(angle))
    cushion = CompliantSurface(
        (0.0, 0.0), normal, "hertz", stiffness=1e5, on=("B", "C1"), friction=0.4
    )
    gravity = Gravity(direction=(-normal[0], -normal[1]))
    chain = Chain.uniform_bars((1.0, 1.0), (length, 0.5))
    scene = Scene(chain, (angle - 0.5, angle - 1.0), (1.0, 0.0), 1.0, (cushion, gravity))
    found = simulate(scene)
    modes = [event.mode.states for event in found.events]
    free = (S.OPEN, S.OPEN)
    begun = [after for before, after in pairwise(modes) if before == free]
    assert len(begun) >= 2
    assert set(begun) == {(S.BACKWARD, S.BACKWARD)}
    assert not violations(found)
