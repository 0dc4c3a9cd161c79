"""The complementarity problem of friction and contact: states, conditions, and round-off."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Mapping
from enum import Enum
from types import MappingProxyType
from typing import Any, NamedTuple

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain, Point
from twolink.contact.coordinates import ConstraintCoordinate, PointCoordinate
from twolink.contact.elements import ContactElement, ElementTerms, Terms
from twolink.contact.states import ContactState
from twolink.integration.precisions import PRECISIONS
from twolink.loads import Torque
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.constraint import cramer, is_answered, parallel
from twolink.simulation.hybrid.dynamics import (
    MOST_CONSTRAINTS,
    LocalEquations,
    Solution,
    constraints_of,
    held_coordinates,
    is_fixed,
    local_equations,
    push_of,
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
    """A mode selection: the equations at a state, and the possible states of each element.

    `size` (N m) and `inertia` (kg m²) are the sizes of all forces and of M, by which the round-off
    of conditions is known.
    """

    system: HybridSystem
    state: HybridState
    equations: LocalEquations
    directions: tuple[int, ...]
    options: tuple[States, ...]
    size: float
    inertia: tuple[float, float, float]


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
    (M11, M12), (_, M22) = equations.M
    inertia = abs(float(M11)), abs(float(M12)), abs(float(M22))
    size = _size_of_forces(equations, inertia, system.scene_chain.L1, state.u)
    return Problem(system, state, equations, state.sliding, options, size, inertia)


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


def conceivable(problem: Problem, with_pressed: bool) -> tuple[States, ...]:
    """Return the modes that the options allow in some pose, with or without saturated friction."""
    return _conceivable(problem.system, problem.options, problem.directions)[with_pressed]


@functools.lru_cache(maxsize=256)
def _conceivable(
    system: HybridSystem, options: tuple[States, ...], directions: tuple[int, ...]
) -> tuple[tuple[States, ...], tuple[States, ...]]:
    """Return the conceivable modes without saturated friction, and those with it."""
    found = [s for s in itertools.product(*options) if _is_conceivable(system, s, directions)]
    pressed = [any(state.pressed for state in states) for states in found]
    return (
        tuple(states for states, is_pressed in zip(found, pressed, strict=True) if not is_pressed),
        tuple(states for states, is_pressed in zip(found, pressed, strict=True) if is_pressed),
    )


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
    return _is_conceivable(problem.system, states, problem.directions) and is_independent(
        problem, states
    )


def is_independent(problem: Problem, states: States) -> bool:
    """Return whether the constraints of a conceivable mode are independent in this pose."""
    groups = constraints_of(problem.equations, problem.system.elements, states)
    flat = [constraint for group in groups for constraint in group]
    rows = [constraint.row for constraint in flat]
    if any(vanishes(problem.system, row) for row in rows):
        return False
    if len(rows) < MOST_CONSTRAINTS:
        return not flat or is_answered(problem.equations.M, flat[0], problem.system.rounding)
    return not parallel(rows[0], rows[1], problem.system.lever)


def conditions(problem: Problem, states: States) -> Iterator[Condition]:
    """Yield the conditions of a mode on the elements whose state is open.

    A contact that opens has none where others hold its point, as its separation is zero.
    """
    held: list[ConstraintCoordinate] | None = None
    for index, (element, state) in enumerate(zip(problem.system.elements, states, strict=True)):
        options = problem.options[index]
        if len(options) == 1:
            continue
        if state is ContactState.OPEN:
            if held is None:
                held = held_coordinates(problem.system.elements, states)
            assert element.normal is not None
            if not is_fixed(element.normal, held, problem.system.scene_chain):
                yield Condition(Law.SEPARATES, index)
            continue
        if element.rigid:
            yield Condition(Law.PUSHES, index)
        if state is ContactState.STICKS:
            yield Condition(Law.WITHIN_LIMIT, index, 1)
            yield Condition(Law.WITHIN_LIMIT, index, -1)
        elif state.slips and not problem.directions[index] and ContactState.STICKS in options:
            yield Condition(Law.ACCELERATES, index, state.direction)


def value_of(
    system: HybridSystem, equations: LocalEquations, solution: Solution, condition: Condition
) -> Any:
    """Return the value of a condition, which is not negative if the condition holds.

    It is a force (N, N m), or an acceleration (m/s², rad/s²) where the element is free to move.
    """
    law, index, sense = condition
    forces, terms = solution.forces[index], equations.terms[index]
    assert terms is not None
    if law is Law.PUSHES:
        return forces.normal
    if law is Law.WITHIN_LIMIT:
        return system.elements[index].limits(forces.normal)[1] + sense * forces.tangential
    row, bias = _along(terms, law)
    return (sense or 1) * (row[0] * solution.du[0] + row[1] * solution.du[1] + bias)


def _along(terms: ElementTerms, law: Law) -> Terms:
    """Return the terms of the coordinate of a condition."""
    along = terms.normal if law in (Law.PUSHES, Law.SEPARATES) else terms.tangent
    assert along is not None
    return along


def noise_of(problem: Problem, condition: Condition, solution: Solution) -> float:
    """Return the round-off of the value of a condition."""
    terms = problem.equations.terms[condition.number]
    assert terms is not None
    row, _ = _along(terms, condition.law)
    if condition.law in (Law.SEPARATES, Law.ACCELERATES):
        return noise_along(problem, row, solution.du)
    if vanishes(problem.system, row):
        return float("inf")
    unsure = tolerances.UNDECIDED * problem.system.resolution
    return unsure * _forces_at(problem, solution.du) / size_of(row)


def is_at_rest(state: HybridState) -> bool:
    """Return whether a chain is at rest, but for the speed at which roundings of a start vanish.

    A start is given in float64, and lies beside its contacts by roundings of a place, which the
    stabilisation of held points removes in any precision.
    """
    beside = tolerances.CONTACT_GAP * PRECISIONS["double"].rounding
    return size_of(state.u) <= beside * tolerances.BAUMGARTE_RATE


def noise_along(problem: Problem, row: Pair, du: Pair) -> float:
    """Return the round-off of the acceleration along a row at du (rad/s²)."""
    speed = size_of(problem.state.u)
    chain, M, det = problem.system.scene_chain, problem.equations.M, problem.equations.det
    own = float(chain.L1 + chain.L2) * (size_of(du) + speed * speed)
    given = _forces_at(problem, du) * size_of(cramer(M, row, det))
    return tolerances.UNDECIDED * problem.system.resolution * (given + own)


def _forces_at(problem: Problem, du: Pair) -> float:
    """Return the size (N m) of all generalized forces at du (rad/s²), those of inertia included."""
    M11, M12, M22 = problem.inertia
    du1, du2 = abs(float(du[0])), abs(float(du[1]))
    return problem.size + (M11 + M12) * du1 + (M12 + M22) * du2


def vanishes(system: HybridSystem, row: Pair) -> bool:
    """Return whether a row is zero within round-off: no force acts along it in this pose."""
    return size_of(row) <= tolerances.NO_LEVER * system.lever


def size_of(row: Pair) -> float:
    """Return the largest entry of a row."""
    return max(abs(float(row[0])), abs(float(row[1])))
