"""The complementarity problem of friction and contact: states, conditions, and round-off."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from types import MappingProxyType
from typing import Any, NamedTuple

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain, Point
from twolink.contact.coordinates import PointCoordinate
from twolink.contact.elements import ContactElement, ContactForces, Terms
from twolink.contact.states import ContactState
from twolink.integration.precisions import PRECISIONS
from twolink.loads import Torque
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.constraint import cramer, is_answered, parallel
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
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem

States = tuple[ContactState, ...]


Orders = Mapping[Trigger, int]
"""How many leading Taylor coefficients of an event function are zero, by its trigger."""


NO_ORDERS: Orders = MappingProxyType({})


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


class Law(Enum):
    """A condition that a mode must satisfy."""

    PUSHES = "a contact pushes"
    SEPARATES = "a contact that opens separates"
    WITHIN_LIMIT = "friction is within its static limit"
    ACCELERATES = "an element that begins to slide accelerates"

    # A member is the only one of its name: conditions are the keys of dictionaries.
    __hash__ = object.__hash__


class Condition(NamedTuple):
    """A law for the element of this number; `sense` is a direction of friction or sliding."""

    law: Law
    number: int
    sense: int = 0


class Problem(NamedTuple):
    """A mode selection: the equations at a state, and the possible states of each element."""

    system: HybridSystem
    state: HybridState
    equations: LocalEquations
    directions: tuple[int, ...]
    options: tuple[States, ...]
    noise: Noise


class Conceivable(NamedTuple):
    """A mode that the options allow in some pose, and its conditions.

    `places` are those of its states among the options of each element, `bound` the elements that
    have constraints, with their states, and `firsts` the numbers of constraints before each.
    """

    states: States
    conditions: tuple[Condition, ...]
    places: tuple[int, ...]
    bound: tuple[tuple[int, ContactState], ...]
    firsts: tuple[int, ...]

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
    system: HybridSystem, state: HybridState, pose: Pose, options: tuple[States, ...]
) -> Problem:
    """Return the selection problem at a state, between some states of each element."""
    elements = system.elements
    active = [e.normal is None or i in state.touching for i, e in enumerate(elements)]
    pushes = [
        push_of(pose, element, own.plastic, state.u, own.sqrt_depth)
        if is_active and (own := state.compliant[i]) is not None
        else 0
        for i, (element, is_active) in enumerate(zip(elements, active, strict=True))
    ]
    equations = local_equations(pose, system.effects, elements, state.u, state.t, active, pushes)
    noise = Noise(system, equations, state.u)
    return Problem(system, state, equations, state.sliding, options, noise)


def conceivable(problem: Problem, with_pressed: bool) -> tuple[Conceivable, ...]:
    """Return the modes that the options allow in some pose, with or without saturated friction."""
    return _conceivable(problem.system, problem.options, problem.directions)[with_pressed]


@functools.lru_cache(maxsize=256)
def _conceivable(
    system: HybridSystem, options: tuple[States, ...], directions: tuple[int, ...]
) -> tuple[tuple[Conceivable, ...], tuple[Conceivable, ...]]:
    """Return the conceivable modes without saturated friction, and those with it."""
    found: tuple[list[Conceivable], list[Conceivable]] = ([], [])
    for places in itertools.product(*(range(len(states)) for states in options)):
        states = tuple(own[place] for own, place in zip(options, places, strict=True))
        if not _is_conceivable(system, states, directions):
            continue
        counts = [len(e.holds(own)) for e, own in zip(system.elements, states, strict=True)]
        bound = tuple((i, states[i]) for i, count in enumerate(counts) if count)
        firsts = tuple(itertools.accumulate(counts, initial=0))
        law = tuple(_conditions(system, options, directions, states))
        mode = Conceivable(states, law, places, bound, firsts)
        found[mode.pressed].append(mode)
    return tuple(found[0]), tuple(found[1])


def _is_conceivable(system: HybridSystem, states: States, directions: tuple[int, ...]) -> bool:
    """Return whether a mode has no more constraints than the chain takes, and its slides are free.

    This does not depend on the pose.
    """
    held = held_coordinates(system.elements, states)
    if len(held) > MOST_CONSTRAINTS:
        return False
    for index, (element, state) in enumerate(zip(system.elements, states, strict=True)):
        if element.tangent is None or state in (ContactState.STICKS, ContactState.OPEN):
            continue
        still = is_fixed(element.tangent, held, system.scene_chain)
        begins = state.slips and not directions[index]
        if (begins and still) or (not state.slips and not still):
            return False
    return True


def is_solvable(problem: Problem, states: States) -> bool:
    """Return whether the constraints of a mode are independent and leave its slides free."""
    if not _is_conceivable(problem.system, states, problem.directions):
        return False
    return is_independent(problem, shares_of(problem.equations, problem.system.elements, states))


def is_independent(problem: Problem, shares: Sequence[Share]) -> bool:
    """Return whether the constraints of a conceivable mode are independent in this pose."""
    flat = [constraint for share in shares for constraint in share.constraints]
    rows = [constraint.row for constraint in flat]
    if any(vanishes(problem.system, row) for row in rows):
        return False
    if len(rows) < MOST_CONSTRAINTS:
        return not flat or is_answered(problem.equations.M, flat[0], problem.system.rounding)
    return not parallel(rows[0], rows[1], problem.system.lever)


def conditions(problem: Problem, states: States) -> Iterator[Condition]:
    """Return the conditions of a mode on the elements whose state is open.

    A contact that opens has none where others hold its point, as its separation is zero.
    """
    return _conditions(problem.system, problem.options, problem.directions, states)


def _conditions(
    system: HybridSystem,
    possible: tuple[States, ...],
    directions: tuple[int, ...],
    states: States,
) -> Iterator[Condition]:
    held = held_coordinates(system.elements, states)
    for index, (element, state) in enumerate(zip(system.elements, states, strict=True)):
        options = possible[index]
        if len(options) == 1:
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


def value_of(
    system: HybridSystem,
    equations: LocalEquations,
    condition: Condition,
    du: Pair,
    forces: ContactForces,
) -> Any:
    """Return the value of a condition, which is not negative if the condition holds.

    It is a force (N, N m), or an acceleration (m/s², rad/s²) where the element is free to move.
    `du` (rad/s²) and the `forces` of the element are those of a mode.
    """
    law, index, sense = condition
    if law is Law.PUSHES:
        return forces.normal
    if law is Law.WITHIN_LIMIT:
        return system.elements[index].limits(forces.normal)[1] + sense * forces.tangential
    row, bias = _along(equations, condition)
    return (sense or 1) * (row[0] * du[0] + row[1] * du[1] + bias)


def _along(equations: LocalEquations, condition: Condition) -> Terms:
    """Return the terms of the coordinate of a condition."""
    terms = equations.terms[condition.number]
    assert terms is not None
    is_normal = condition.law in (Law.PUSHES, Law.SEPARATES)
    along = terms.normal if is_normal else terms.tangent
    assert along is not None
    return along


class Noise:
    """The round-off of the conditions at a state, by the sizes of all forces there.

    The part of a condition that does not depend on the mode is computed once.
    """

    def __init__(self, system: HybridSystem, equations: LocalEquations, u: Pair) -> None:
        """Compute the sizes of the forces (N m) and of M (kg m²)."""
        (M11, M12), (_, M22) = equations.M
        inertia = abs(float(M11)), abs(float(M12)), abs(float(M22))
        self._system, self._equations = system, equations
        self._unsure = tolerances.UNDECIDED * system.resolution
        self._forces = _size_of_forces(equations, inertia, system.scene_chain.L1, u)
        self._inertia = inertia[0] + inertia[1], inertia[1] + inertia[2]
        self._turning = size_of(u) * size_of(u)
        self._gains: dict[Condition, float] = {}

    def of(self, condition: Condition, du: Pair) -> float:
        """Return the round-off of the value of a condition at du (rad/s²)."""
        gain = self._gains.get(condition)
        if gain is None:
            gain = self._gains[condition] = self._gain(condition)
        if condition.law in (Law.SEPARATES, Law.ACCELERATES):
            return self._of_acceleration(gain, du)
        return gain if math.isinf(gain) else self._unsure * self._forces_at(du) * gain

    def along(self, row: Pair, du: Pair) -> float:
        """Return the round-off of the acceleration along a row at du (rad/s²)."""
        return self._of_acceleration(self._response(row), du)

    def _gain(self, condition: Condition) -> float:
        """Return the change of a condition by a generalized force (N m)."""
        row, _ = _along(self._equations, condition)
        if condition.law in (Law.SEPARATES, Law.ACCELERATES):
            return self._response(row)
        return math.inf if vanishes(self._system, row) else 1 / size_of(row)

    def _response(self, row: Pair) -> float:
        return size_of(cramer(self._equations.M, row, self._equations.det))

    def _of_acceleration(self, response: float, du: Pair) -> float:
        chain = self._system.scene_chain
        own = float(chain.L1 + chain.L2) * (size_of(du) + self._turning)
        return self._unsure * (self._forces_at(du) * response + own)

    def _forces_at(self, du: Pair) -> float:
        """Return the size (N m) of all forces at du (rad/s²), those of inertia included."""
        one, two = self._inertia
        return self._forces + one * abs(float(du[0])) + two * abs(float(du[1]))


def _size_of_forces(
    equations: LocalEquations, inertia: tuple[float, float, float], length: Scalar, u: Pair
) -> float:
    """Return the sum of all generalized forces (N m), each as large as it is in some pose.

    In one pose they may vanish or cancel, and their round-off remains: that of the angles times
    their derivatives. `length` (m) is that of link 1.
    """
    M11, M12, M22 = inertia
    speed = size_of(u)
    size = (M11 + 2 * M12 + M22) * speed * speed
    for load in equations.loads:
        if isinstance(load, Torque):
            size += abs(float(load.moment))
        else:
            point, force = load.point, size_of(load.components)
            reach = abs(float(point.along)) + abs(float(point.across))
            size += force * (reach + (float(length) if point.link == 2 else 0.0))
    for terms in equations.terms:
        if terms is not None and terms.normal is not None:
            size += abs(float(terms.push)) * size_of(terms.normal.row)
    return size


def is_at_rest(state: HybridState) -> bool:
    """Return whether a chain is at rest, but for the speed at which roundings of a start vanish.

    A start is given in float64, and lies beside its contacts by roundings of a place, which the
    stabilisation of held points removes in any precision.
    """
    beside = tolerances.CONTACT_GAP * PRECISIONS["double"].rounding
    return size_of(state.u) <= beside * tolerances.BAUMGARTE_RATE


def vanishes(system: HybridSystem, row: Pair) -> bool:
    """Return whether a row is zero within round-off: no force acts along it in this pose."""
    return size_of(row) <= tolerances.NO_LEVER * system.lever


def size_of(row: Pair) -> float:
    """Return the largest entry of a row."""
    return max(abs(float(row[0])), abs(float(row[1])))
