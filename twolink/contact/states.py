"""States of contact elements, and the kinds of events that end them."""

from __future__ import annotations

from enum import Enum


class ContactState(Enum):
    """State of a dry friction or a contact; the value is its description.

    A *pressed* element is at rest because other constraints hold it: its friction is saturated at
    the static limit, against the motion that it would begin.
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
        """Precompute the attributes, which are read in inner loops."""
        self.direction = 1 if "forward" in description else -1 if "backward" in description else 0
        self.slips = description.startswith("slips")
        self.pressed = "pressed" in description

    @property
    def forward(self) -> ContactState:
        """The state that is backward turned forward, or this state."""
        if self.direction >= 0:
            return self
        return slipping(1) if self.slips else pressed(1)

    # A member is the only one of its name: tuples of states are the keys of caches.
    __hash__ = object.__hash__


def slipping(direction: int) -> ContactState:
    """Return the state of an element that slides in a direction, +1 or −1."""
    return ContactState.FORWARD if direction > 0 else ContactState.BACKWARD


def pressed(direction: int) -> ContactState:
    """Return the state with friction saturated against a direction, +1 or −1."""
    return ContactState.PRESSED_FORWARD if direction > 0 else ContactState.PRESSED_BACKWARD


class EventKind(Enum):
    """The meaning of an event function that falls through zero."""

    HITS = "a contact is made"
    LEAVES = "a contact no longer pushes"
    STOPS = "a slide comes to rest"
    BREAKS = "a static friction limit is reached"
    JAMS = "friction locks a sliding contact (Painlevé)"
    REACHES = "a branch of a force law ends at its depth"
    TURNS = "a branch of a force law ends at the rate of its depth"
    CLEARS = "a dent is left behind"

    __hash__ = object.__hash__
