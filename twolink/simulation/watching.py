"""What is watched for in a mode: the quantities whose fall through zero ends it."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from twolink.arithmetic import Pair, Scalar
from twolink.nonsmooth import DryFriction
from twolink.simulation.mode import Mode, State
from twolink.simulation.modes import Modes, Solution


class Kind(Enum):
    """What comes to pass when a watched quantity falls through zero."""

    HITS = "an obstacle is met"
    LEAVES = "an obstacle no longer pushes"
    STOPS = "what slips comes to rest"
    BREAKS = "what sticks breaks loose"


class Watch(NamedTuple):
    """A quantity that is watched: of which friction or obstacle; and how that breaks loose."""

    kind: Kind
    number: int
    sense: int = 0


def watches(modes: Modes, mode: Mode) -> list[Watch]:
    """Return what is to be watched for in a mode."""
    found = []
    for index, (element, state) in enumerate(zip(modes.elements, mode.states, strict=True)):
        if state is State.OPEN:
            found.append(Watch(Kind.HITS, index))
            continue
        if not isinstance(element, DryFriction):
            found.append(Watch(Kind.LEAVES, index))
        if state in (State.FORWARD, State.BACKWARD):
            found.append(Watch(Kind.STOPS, index))
        elif state is State.STICKS:
            found += [Watch(Kind.BREAKS, index, 1), Watch(Kind.BREAKS, index, -1)]
    return found


def margin(watch: Watch, modes: Modes, mode: Mode, solution: Solution, q: Pair, u: Pair) -> Scalar:
    """Return the quantity (rad/s, m/s, N or N m) that is watched; it is positive so far.

    What is watched of a free obstacle is its gap, which is a variable of the integration.
    """
    element, held = modes.elements[watch.number], solution.held[watch.number]
    if watch.kind is Kind.LEAVES:
        return held.normal
    if isinstance(element, DryFriction):
        slides, limit, force = element.direction, element.static, held.normal
    else:
        assert element.tangent is not None
        slides, limit = element.tangent, element.static * held.normal
        force = held.tangential
    if watch.kind is Kind.STOPS:
        return mode.states[watch.number].direction * slides.speed(modes.chain, q, u)
    # What is held back by a force against its direction starts along it when the force is used up.
    return limit + watch.sense * force
