"""What is watched for in a mode: the quantities whose fall through zero ends it."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import NamedTuple

from twolink.arithmetic import Pair, Scalar
from twolink.contact.elements import CompliantContact, DryFriction
from twolink.contact.force_laws import Branch
from twolink.simulation.mode import ContactState, Mode
from twolink.simulation.modes import Modes, Solution


class Kind(Enum):
    """What comes to pass when a watched quantity falls through zero."""

    HITS = "an obstacle is met"
    LEAVES = "an obstacle no longer pushes"
    REACHES = "a law ends, and the next one holds"
    TURNS = "what went deeper comes out, or what came out goes deeper"
    CLEARS = "a dent is left behind"
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
        dent = mode.dent(index)
        if state is ContactState.OPEN:
            found.append(Watch(Kind.HITS, index))
            if dent is not None and dent.is_kept:
                found.append(Watch(Kind.CLEARS, index))
            continue
        if not isinstance(element, DryFriction):
            found.append(Watch(Kind.LEAVES, index))
        if isinstance(element, CompliantContact):
            branch = modes.branch(mode, index)
            if branch.reach is not None:
                found.append(Watch(Kind.REACHES, index))
            if branch.turning:
                found.append(Watch(Kind.TURNS, index))
        if state in (ContactState.FORWARD, ContactState.BACKWARD):
            found.append(Watch(Kind.STOPS, index))
        elif state is ContactState.STICKS:
            found += [Watch(Kind.BREAKS, index, 1), Watch(Kind.BREAKS, index, -1)]
    return found


class Places(NamedTuple):
    """What is integrated of the places of surfaces: gaps (m), and roots of depths (m^½)."""

    gaps: Mapping[int, Scalar]
    roots: Mapping[int, Scalar]


def margin(
    watch: Watch,
    modes: Modes,
    mode: Mode,
    solution: Solution,
    q: Pair,
    u: Pair,
    places: Places,
) -> Scalar:
    """Return the quantity that is watched; it is positive so far.

    It is a place (m, m^½), a speed (rad/s, m/s) or a force (N, N m).
    """
    element, held = modes.elements[watch.number], solution.held[watch.number]
    if watch.kind is Kind.HITS:
        return places.gaps[watch.number]
    if watch.kind is Kind.LEAVES:
        return places.roots.get(watch.number, held.normal)
    if watch.kind in (Kind.REACHES, Kind.TURNS, Kind.CLEARS):
        speed = element.direction.speed(modes.chain, q, u)
        return _margin_of_branch(watch, modes.branch(mode, watch.number), speed, places)
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


def _margin_of_branch(watch: Watch, branch: Branch, speed: Scalar, places: Places) -> Scalar:
    """Return how far a cushion's law is from its end, at a speed out of the cushion (m/s)."""
    if watch.kind is Kind.CLEARS:
        return branch.residual - places.gaps[watch.number]
    if watch.kind is Kind.REACHES:
        return branch.reach - places.roots[watch.number]
    return -branch.turning * speed
