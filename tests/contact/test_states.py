"""States of contact elements: the motion of each, and its words."""

import pickle

import pytest

from twolink.contact.states import ContactState, EventKind, pressed, slipping

MEANING = {
    # state: direction, slips, pressed
    "FORWARD": (1, True, False),
    "BACKWARD": (-1, True, False),
    "STICKS": (0, False, False),
    "PRESSED_FORWARD": (1, False, True),
    "PRESSED_BACKWARD": (-1, False, True),
    "OPEN": (0, False, False),
    "CLOSED": (0, False, False),
}


@pytest.mark.parametrize("name", MEANING)
def test_each_state_has_its_direction_slip_and_press(name):
    state = ContactState[name]
    assert (state.direction, state.slips, state.pressed) == MEANING[name]


def test_every_state_is_listed():
    assert {state.name for state in ContactState} == set(MEANING)


@pytest.mark.parametrize("direction", [1, -1])
def test_states_are_found_by_their_direction(direction):
    assert slipping(direction).slips
    assert slipping(direction).direction == direction
    assert pressed(direction).pressed
    assert pressed(direction).direction == direction


@pytest.mark.parametrize("name", MEANING)
def test_a_backward_state_has_a_forward_one(name):
    state = ContactState[name]
    assert state.forward is ContactState[name.replace("BACKWARD", "FORWARD")]


@pytest.mark.parametrize("kind", [ContactState, EventKind])
def test_no_two_members_share_their_words(kind):
    """An enumeration makes members of equal values one and the same."""
    assert len(set(kind.__members__)) == len({member.value for member in kind})


@pytest.mark.parametrize("member", [*ContactState, *EventKind], ids=lambda member: member.name)
def test_a_pickled_member_is_the_same_key(member):
    assert {member: "found"}[pickle.loads(pickle.dumps(member))] == "found"
