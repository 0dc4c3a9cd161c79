"""The complementarity problem of friction and contact: states, conditions, and round-off."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from twolink.chain import Chain, Point
from twolink.contact.coordinates import ConstraintCoordinate, PointCoordinate
from twolink.contact.elements import ContactElement
from twolink.contact.states import ContactState
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.conditions import Condition, Law
from twolink.simulation.hybrid.constraint import are_answered, is_answered, parallel
from twolink.simulation.hybrid.dynamics import (
    MOST_CONSTRAINTS,
    LocalEquations,
    Share,
    Solution,
    held_coordinates,
    is_fixed,
    local_equations,
    push_of,
    shares_of,
)
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.noise import Noise, Zero, size_of, vanishes
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem

States = tuple[ContactState, ...]


Orders = Mapping[Trigger, int | Zero]
"""How many leading Taylor coefficients of an event function are zero, or `Zero`, by its trigger."""


NO_ORDERS: Orders = MappingProxyType({})

NO_ELEMENTS: frozenset[int] = frozenset()
"""The empty set of elements."""


def coincide(first: ContactElement, second: ContactElement, chain: Chain) -> bool:
    """Return whether two rigid contacts keep one point, or one joint, from one side of a line."""
    one, other = first.normal, second.normal
    if not (first.rigid and second.rigid):
        return False
    if not (isinstance(one, PointCoordinate) and isinstance(other, PointCoordinate)):
        return one == other
    a, b = _point(one, chain), _point(other, chain)
    known = tolerances.ROUNDED_PLACE * PRECISIONS["double"].rounding * float(chain.L1 + chain.L2)
    near = max(abs(a.along - b.along), abs(a.across - b.across)) <= known
    return bool(one.vector == other.vector and a.link == b.link and near)


def _point(coordinate: PointCoordinate, chain: Chain) -> Point:
    """Return the point of a coordinate; the start of link 2 is B, on link 1."""
    point = coordinate.of(chain)
    starts_link = point.link == 2 and point.along == 0 and point.across == 0
    return chain.B if starts_link else point


class Problem(NamedTuple):
    """A mode selection: the equations at a state, and the possible states of each element."""

    system: HybridSystem
    state: HybridState
    equations: LocalEquations
    directions: tuple[int, ...]
    options: tuple[States, ...]
    noise: Noise
    opening: frozenset[int] = NO_ELEMENTS


class Conceivable(NamedTuple):
    """A mode that the options allow in some pose, and its conditions.

    `places` are those of its states among the options of each element, `bound` the elements that
    have constraints, with their states, and `firsts` the numbers of constraints before each. It
    `begins` a slide if an element at rest slides.
    """

    states: States
    conditions: tuple[Condition, ...]
    places: tuple[int, ...]
    bound: tuple[tuple[int, ContactState], ...]
    firsts: tuple[int, ...]
    begins: bool

    @property
    def pressed(self) -> bool:
        """Whether it has saturated friction."""
        return any(state.pressed for state in self.states)


class Candidate(NamedTuple):
    """A mode that violates no law beyond rounding, and its conditions that are zero to rounding."""

    states: States
    solution: Solution
    decided: tuple[Condition, ...]
    undecided: tuple[Condition, ...]


def problem_at(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    options: tuple[States, ...],
    opening: frozenset[int] = NO_ELEMENTS,
) -> Problem:
    """Return the selection problem at a state, between some states of each element.

    Contacts that are `opening` have no force left, and touch.
    """
    elements = system.elements
    active = [e.normal is None or i in state.touching for i, e in enumerate(elements)]
    pushes = [
        push_of(pose, element, own.plastic, state.u, own.sqrt_depth)
        if is_active and (own := state.compliant[i]) is not None
        else 0
        for i, (element, is_active) in enumerate(zip(elements, active, strict=True))
    ]
    equations = local_equations(pose, system.effects, elements, state.u, state.t, active, pushes)
    noise = Noise(system, equations, state.u, state.t)
    return Problem(system, state, equations, state.sliding, options, noise, opening)


def begun(states: States, directions: tuple[int, ...]) -> int:
    """Return how many elements begin to slide in their states: those without a direction before."""
    return sum(s.slips and not d for s, d in zip(states, directions, strict=True))


def conceivable(problem: Problem, with_pressed: bool) -> tuple[Conceivable, ...]:
    """Return the modes that the options allow in some pose, with or without saturated friction."""
    system, options, directions = problem.system, problem.options, problem.directions
    return _conceivable(system, options, directions, problem.opening)[with_pressed]


@functools.lru_cache(maxsize=256)
def _conceivable(
    system: HybridSystem,
    options: tuple[States, ...],
    directions: tuple[int, ...],
    opening: frozenset[int],
) -> tuple[tuple[Conceivable, ...], tuple[Conceivable, ...]]:
    """Return the conceivable modes without saturated friction, and those with it."""
    found: tuple[list[Conceivable], list[Conceivable]] = ([], [])
    for places in sorted(_places(system, options)):
        states = tuple(own[place] for own, place in zip(options, places, strict=True))
        counts = [len(e.holds(own)) for e, own in zip(system.elements, states, strict=True)]
        bound = tuple((i, states[i]) for i, count in enumerate(counts) if count)
        firsts = tuple(itertools.accumulate(counts, initial=0))
        law = tuple(_conditions(system, options, directions, opening, states))
        mode = Conceivable(states, law, places, bound, firsts, begun(states, directions) > 0)
        found[mode.pressed].append(mode)
    return tuple(found[0]), tuple(found[1])


def _places(system: HybridSystem, options: tuple[States, ...]) -> Iterator[tuple[int, ...]]:
    """Yield the places of the states of each conceivable mode among the options.

    The coordinates that elements hold are chosen first: they decide which slides are free.
    """
    elements, chain = system.elements, system.scene_chain
    for held_by in _holdings(elements, options):
        held = [coordinate for own in held_by for coordinate in own]
        suited = (
            [
                place
                for place, state in enumerate(states)
                if element.holds(state) == own and _is_suited(element, state, held, chain)
            ]
            for element, states, own in zip(elements, options, held_by, strict=True)
        )
        yield from itertools.product(*suited)


def _holdings(
    elements: Sequence[ContactElement], options: tuple[States, ...]
) -> list[tuple[tuple[ConstraintCoordinate, ...], ...]]:
    """Return the coordinates that each element may hold, no more in all than the chain takes."""
    found: list[tuple[int, tuple[tuple[ConstraintCoordinate, ...], ...]]] = [(0, ())]
    for element, states in zip(elements, options, strict=True):
        # Numbers of quadruple precision cannot be keys.
        every = [element.holds(state) for state in states]
        able = [own for place, own in enumerate(every) if own not in every[:place]]
        found = [
            (count + len(own), (*others, own))
            for count, others in found
            for own in able
            if count + len(own) <= MOST_CONSTRAINTS
        ]
    return [held_by for _, held_by in found]


def _is_suited(
    element: ContactElement,
    state: ContactState,
    held: Sequence[ConstraintCoordinate],
    chain: Chain,
) -> bool:
    """Return whether an element can slide, or rest with saturated friction, where others hold."""
    if element.tangent is None or state in (ContactState.STICKS, ContactState.OPEN):
        return True
    return state.slips != is_fixed(element.tangent, held, chain)


def _is_conceivable(system: HybridSystem, states: States) -> bool:
    """Return whether a mode has no more constraints than the chain takes, and its slides are free.

    Saturated friction is where other elements hold. This does not depend on the pose.
    """
    held = held_coordinates(system.elements, states)
    return len(held) <= MOST_CONSTRAINTS and all(
        _is_suited(element, state, held, system.scene_chain)
        for element, state in zip(system.elements, states, strict=True)
    )


def is_solvable(problem: Problem, states: States) -> bool:
    """Return whether the constraints of a mode are independent and leave its slides free."""
    if not _is_conceivable(problem.system, states):
        return False
    return is_independent(problem, shares_of(problem.equations, problem.system.elements, states))


def is_independent(problem: Problem, shares: Sequence[Share]) -> bool:
    """Return whether the constraints of a conceivable mode are independent in this pose.

    A force that friction turns along a link through A has no lever arm, and holds nothing.
    """
    flat = [constraint for share in shares for constraint in share.constraints]
    rows, forces = [own.row for own in flat], [own.force for own in flat]
    if any(vanishes(problem.system, pair) for pair in (*rows, *forces)):
        return False
    if len(rows) < MOST_CONSTRAINTS:
        return not flat or is_answered(problem.equations.M, flat[0], problem.system.rounding)
    if parallel(rows[0], rows[1], problem.system.scales.lever):
        return False
    return are_answered(flat[0], flat[1], problem.system.rounding)


def conditions(problem: Problem, states: States) -> Iterator[Condition]:
    """Return the conditions of a mode on the elements whose state is open.

    A contact that opens has none where others hold its point, as its separation is zero. Nor has
    one that can only open, as no force is left, unless an element begins to slide.
    """
    return _conditions(problem.system, problem.options, problem.directions, problem.opening, states)


def _conditions(
    system: HybridSystem,
    possible: tuple[States, ...],
    directions: tuple[int, ...],
    opening: frozenset[int],
    states: States,
) -> Iterator[Condition]:
    held = held_coordinates(system.elements, states)
    separate = opening if begun(states, directions) else NO_ELEMENTS
    for index, (element, state) in enumerate(zip(system.elements, states, strict=True)):
        options = possible[index]
        if len(options) == 1 and index not in separate:
            continue
        if state is ContactState.OPEN:
            assert element.normal is not None
            if not is_fixed(element.normal, held, system.scene_chain):
                yield Condition(Law.SEPARATES, index)
            continue
        if element.rigid:
            yield Condition(Law.PUSHES, index)
        if state is ContactState.STICKS:
            yield Condition(Law.WITHIN_LIMIT, index, 1)
            yield Condition(Law.WITHIN_LIMIT, index, -1)
        elif state.slips and not directions[index] and ContactState.STICKS in options:
            yield Condition(Law.ACCELERATES, index, state.direction)


def is_at_rest(system: HybridSystem, state: HybridState) -> bool:
    """Return whether a chain is at rest, but for the speed at which roundings of a start vanish."""
    return size_of(state.u) <= system.scales.of_rounded_start
