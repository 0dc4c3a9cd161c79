"""States of contact elements, and the kinds of events that end them."""

from __future__ import annotations

from enum import Enum


class ContactState(Enum):
    """State of a dry friction or a contact; the value is its description.

    A *pressed* element does not move either, because other constraints hold it: its friction is
    saturated at the static limit, against the motion that it would begin.
    """

    FORWARD = "slips forward"
    BACKWARD = "slips backward"
    STICKS = "sticks"
    PRESSED_FORWARD = "is pressed forward"
    PRESSED_BACKWARD = "is pressed backward"
    OPEN = "is free"
    CLOSED = "rests"

    direction: int
    """+1 or −1 for an element that slips or is pressed forward or backward, else 0."""
    slips: bool
    """Whether the element slides."""
    pressed: bool
    """Whether the element is at rest with saturated friction."""

    def __init__(self, description: str) -> None:
        """Set what follows from the name: these are read very often."""
        self.direction = 1 if "forward" in description else -1 if "backward" in description else 0
        self.slips = description.startswith("slips")
        self.pressed = "pressed" in description


def slipping(direction: int) -> ContactState:
    """Return the state of an element that slides in a direction, +1 or −1."""
    return ContactState.FORWARD if direction > 0 else ContactState.BACKWARD


def pressed(direction: int) -> ContactState:
    """Return the state of an element whose friction is saturated against a direction, +1 or −1."""
    return ContactState.PRESSED_FORWARD if direction > 0 else ContactState.PRESSED_BACKWARD


class EventKind(Enum):
    """Meaning of the fall of an event function through zero."""

    HITS = "a contact is made"
    LEAVES = "a contact no longer pushes"
    STOPS = "a slide comes to rest"
    BREAKS = "a static friction limit is reached"
    JAMS = "friction locks a sliding contact (Painlevé)"
    REACHES = "a branch of a force law ends at its depth"
    TURNS = "a branch of a force law ends at the rate of its depth"
    CLEARS = "a dent is left behind"
