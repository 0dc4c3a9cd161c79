"""Contacts of stretched and folded chains."""

import math

import pytest

from tests.simulation.hybrid import state_of, system_of
from twolink.chain import Chain
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.simulation.hybrid.jump import settle
from twolink.simulation.hybrid.singular_pose import (
    pinned,
    turned_about,
    wedged,
    wedged_between,
)


def at_rest(q, normal, *, lengths=(1.0, 1.0), friction=0.5, u=(0.0, 0.0), sliding=0, load=None):
    """Return a chain whose end touches a surface at rest, and its pose."""
    end = tuple(
        sum(length * f(angle) for length, angle in zip(lengths, q, strict=True))
        for f in (math.cos, math.sin)
    )
    chain = Chain.uniform_bars(length=lengths)
    surface = Surface(end, normal, friction=friction)
    system = system_of(*([load] if load else []), surface, chain=chain)
    state = state_of(system, q, u)._replace(touching=frozenset({0}), sliding=(sliding,))
    return system, state, system.pose(state.q)


FOLDED = 1.1, 1.1 + math.pi


def test_a_rough_contact_of_a_folded_chain_may_be_wedged():
    case = at_rest(FOLDED, (0.0, -1.0), lengths=(1.0, 0.6))
    assert (wedged(*case), pinned(*case)) == ([0], [])


def test_a_point_at_the_base_of_a_folded_chain_is_pinned():
    """Its links, of one length, turn about it, and no force along them is needed."""
    for u in ((0.0, 0.0), (1.0, 1.0)):
        case = at_rest(FOLDED, (0.0, -1.0), u=u)
        assert (wedged(*case), pinned(*case)) == ([], [0])


@pytest.mark.parametrize("angle", [0.0, 1.1, math.pi])
def test_a_surface_across_the_links_may_wedge_even_without_friction(angle):
    normal = -math.cos(angle), -math.sin(angle)
    case = at_rest((angle, angle), normal, friction=0.0)
    assert (wedged(*case), pinned(*case)) == ([0], [])


def test_in_other_poses_and_where_a_point_slides_nothing_is_wedged_or_pinned():
    for case in (
        at_rest((1.1, 0.2), (0.0, -1.0)),
        at_rest(FOLDED, (0.0, -1.0), lengths=(1.0, 0.6), sliding=1),
        at_rest(FOLDED, (0.0, -1.0), lengths=(1.0, 0.6), friction=0.0),
    ):
        assert (wedged(*case), pinned(*case)) == ([], [])


def test_links_turn_about_an_end_at_the_base():
    """The friction of an end force acts there too; a contact only while it touches."""
    system, state, pose = at_rest(FOLDED, (0.0, -1.0), load=EndForce(-1.0, 0.5))
    assert system.names == ("D", "D on surface")
    assert turned_about(system, state._replace(touching=frozenset({1})), pose) == [0, 1]
    assert turned_about(system, state._replace(touching=frozenset()), pose) == [0]
    for case in (
        at_rest(FOLDED, (0.0, -1.0), lengths=(1.0, 0.6)),
        at_rest((1.1, 1.1), (0.0, -1.0)),
        at_rest((1.1, 1.1 + math.pi - 1e-6), (0.0, -1.0)),
    ):
        assert turned_about(*case) == []


def test_a_pinned_contact_is_remarked():
    """Link 2 falls onto link 1, about D at A, on a slope with friction."""
    system, state, _ = at_rest((-3.0, math.pi - 3.0), (0.1435660307, -0.9896407402), load=Gravity())
    (note,) = settle(system, state, {}).notes
    assert "do not determine the force of D on surface" in note.sentence


def upright(stop, normal, u):
    """Return a chain whose link 2 stands on link 1, which is at a stop, under or on a surface."""
    stands = (0.0, math.pi / 2)
    system = system_of(stop, Surface((1.0, 1.0), normal))
    state = state_of(system, stands, u)._replace(touching=frozenset({0, 1}))
    return system, state, system.pose(state.q)


UNDER, ON = (0.0, -1.0), (0.0, 1.0)


@pytest.mark.parametrize(
    ("stop", "normal", "speed", "expected"),
    [
        # The end descends as link 2 turns: onto a surface that link 1 cannot leave.
        (JointStop("A", upper=0.0), ON, 2.0, (0, 1)),
        (JointStop("A", upper=0.0), ON, -2.0, (0, 1)),
        (JointStop("A", upper=0.0), ON, 0.0, ()),
        (JointStop("A", lower=0.0), UNDER, 2.0, ()),
        # Link 1 can give way.
        (JointStop("A", lower=0.0), ON, 2.0, ()),
    ],
)
def test_a_link_that_turns_between_two_contacts_may_be_wedged(stop, normal, speed, expected):
    case = upright(stop, normal, (0.0, speed))
    assert tuple(wedged_between(*case)) == expected
