"""Constrained dynamics of a mode, for numbers of any kind.

In a mode the motion is smooth. A sliding element has a known friction force; a sticking or resting
element has the constraint force that holds it. The row of a constraint is the generalized force of
a unit load, by Kane's partial velocities or by Lagrange's gradients.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from twolink.arithmetic import Matrix, Pair, Scalar, sqrt
from twolink.chain import Chain
from twolink.contact.coordinates import ConstraintCoordinate, JointCoordinate
from twolink.contact.elements import (
    NO_FORCES,
    Constraint,
    ContactElement,
    ContactForces,
    ElementTerms,
    Terms,
)
from twolink.contact.force_laws import PlasticState
from twolink.contact.states import ContactState
from twolink.effects import Effect, smooth_loads
from twolink.loads import Force, Load, Loads, Torque
from twolink.simulation.hybrid.constraint import (
    cramer,
    is_immobile,
    same_line,
    solved_with_one,
    solved_with_two,
)
from twolink.simulation.hybrid.pose import Pose

# Two constraints bring the chain to rest.
MOST_CONSTRAINTS = 2


class Solution(NamedTuple):
    """du/dt (rad/s²) in a mode, and the forces of each element."""

    du: Pair
    forces: tuple[ContactForces, ...]


class LocalEquations(NamedTuple):
    """M du = r + forces of elements, at an instant; `terms` has None for elements left out.

    `loads` are those of the effects, which r contains.
    """

    M: Matrix
    det: Scalar
    r: Pair
    terms: tuple[ElementTerms | None, ...]
    loads: Loads


def local_equations(
    pose: Pose,
    effects: tuple[Effect, ...],
    elements: Sequence[ContactElement],
    u: Pair,
    t: Scalar,
    active: Sequence[bool],
    pushes: Sequence[Scalar],
    rate: Scalar | None = None,
) -> LocalEquations:
    """Return the equations of motion at an instant, with the terms of the active elements.

    `pushes` are the forces of compliant surfaces (N); `rate` (1/s) is that of Baumgarte's
    stabilisation, which is added to the bias of points, None for none.
    """
    chain, formulation, q = pose.chain, pose.formulation, pose.q
    loads = smooth_loads(effects, chain, q, u, t)
    Q1, Q2 = formulation.generalized_active_force(chain, q, loads)
    C1, C2 = pose.velocity_terms(u)
    M, det = pose.inertia
    terms = tuple(
        _element_terms(pose, element, u, push, rate) if is_active else None
        for element, is_active, push in zip(elements, active, pushes, strict=True)
    )
    return LocalEquations(M, det, (Q1 - C1, Q2 - C2), terms, loads)


def _element_terms(
    pose: Pose, element: ContactElement, u: Pair, push: Scalar, rate: Scalar | None
) -> ElementTerms:
    bound = element.bound if element.rigid else None
    return ElementTerms(
        None if element.normal is None else _terms(pose, element.normal, u, rate, bound),
        None if element.tangent is None else _terms(pose, element.tangent, u, rate, None),
        push,
    )


def _terms(
    pose: Pose,
    coordinate: ConstraintCoordinate,
    u: Pair,
    rate: Scalar | None,
    bound: Scalar | None,
) -> Terms:
    """Return the terms of a coordinate; a held point is stabilized towards its bound.

    A held joint does not move. A held point drifts by the round-off of each step; the stabilization
    prevents this from accumulating.
    """
    bias = pose.bias(coordinate, u)
    if rate is not None and not isinstance(coordinate, JointCoordinate):
        bias = bias + 2 * rate * pose.speed(coordinate, u)
        if bound is not None:
            bias = bias + rate * rate * (pose.value(coordinate, pose.q) - bound)
    return Terms(pose.row(coordinate), bias)


class Share(NamedTuple):
    """The constraints of an element in one of its states, and its known forces (N m)."""

    constraints: tuple[Constraint, ...]
    applied: tuple[Pair, ...]


_NO_SHARE = Share((), ())


def share_of(element: ContactElement, state: ContactState, terms: ElementTerms | None) -> Share:
    """Return the share of an element in the equations of a mode."""
    if terms is None:
        return _NO_SHARE
    return Share(element.constraints(state, terms), element.applied(state, terms))


def shares_of(
    equations: LocalEquations,
    elements: Sequence[ContactElement],
    states: Sequence[ContactState],
) -> list[Share]:
    """Return the shares of all elements in the equations of a mode."""
    return [
        share_of(element, state, terms)
        for element, state, terms in zip(elements, states, equations.terms, strict=True)
    ]


def held_coordinates(
    elements: Sequence[ContactElement], states: Sequence[ContactState]
) -> list[ConstraintCoordinate]:
    """Return the coordinates whose speed the elements hold at zero in a mode."""
    return [
        coordinate
        for element, state in zip(elements, states, strict=True)
        for coordinate in element.holds(state)
    ]


def is_fixed(
    coordinate: ConstraintCoordinate, held: Sequence[ConstraintCoordinate], chain: Chain
) -> bool:
    """Return whether a coordinate is at rest while others are held: two of them, or its own.

    A point in A is always at rest.
    """
    return (
        len(held) >= MOST_CONSTRAINTS
        or is_immobile(coordinate, chain)
        or any(same_line(coordinate, other, chain) for other in held)
    )


def constraint_count(elements: Sequence[ContactElement], states: Sequence[ContactState]) -> int:
    """Return the number of constraints of a mode."""
    return len(held_coordinates(elements, states))


def solve(
    equations: LocalEquations,
    elements: Sequence[ContactElement],
    states: Sequence[ContactState],
) -> Solution:
    """Return du/dt in a mode, and the forces that enforce its constraints."""
    shares = shares_of(equations, elements, states)
    du, multipliers = accelerated(equations, shares)
    found, place = [], 0
    for element, state, terms, share in zip(elements, states, equations.terms, shares, strict=True):
        own = multipliers[place : place + len(share.constraints)]
        place += len(share.constraints)
        found.append(NO_FORCES if terms is None else element.forces(state, terms, own))
    return Solution(du, tuple(found))


def accelerated(
    equations: LocalEquations, shares: Sequence[Share]
) -> tuple[Pair, tuple[Scalar, ...]]:
    """Return du/dt by the shares of all elements, and the multipliers of their constraints."""
    r1, r2 = equations.r
    flat: tuple[Constraint, ...] = ()
    for constraints, applied in shares:
        for force in applied:
            r1, r2 = r1 + force[0], r2 + force[1]
        flat += constraints
    if not flat:
        return cramer(equations.M, (r1, r2), equations.det), ()
    if len(flat) == 1:
        return solved_with_one(equations.M, (r1, r2), flat[0])
    return solved_with_two(equations.M, (r1, r2), *flat)


def push_of(
    pose: Pose,
    element: ContactElement,
    dent: PlasticState | None,
    u: Pair,
    root: Scalar | None = None,
) -> Scalar:
    """Return the normal force (N) of a pressed compliant surface, 0 for a rigid element.

    The depth is `root` squared (m) if the `root` (m^½) is given, else that of q.
    """
    if element.compliant is None or element.normal is None:
        return 0
    branch = element.branch(dent)
    rate = -pose.speed(element.normal, u)
    if root is not None:
        return branch.law.force(root * root, root, rate)
    surface = element.bound - branch.residual
    depth = surface - pose.value(element.normal, pose.q)
    if not branch.law.uses_root:
        return branch.law.force(depth, 0, rate)
    depth = (depth + abs(depth)) / 2
    return branch.law.force(depth, sqrt(depth), rate)


def loads_of(
    pose: Pose,
    effects: tuple[Effect, ...],
    elements: Sequence[ContactElement],
    solution: Solution,
    u: Pair,
    t: Scalar,
) -> Loads:
    """Return all loads, including the forces of the elements."""
    given: list[Load] = []
    for element, forces in zip(elements, solution.forces, strict=True):
        for coordinate, force in zip((element.normal, element.tangent), forces, strict=True):
            if coordinate is not None:
                given += [scaled(load, force) for load in coordinate.unit_loads(pose.chain)]
    return smooth_loads(effects, pose.chain, pose.q, u, t) + tuple(given)


def scaled(load: Load, factor: Scalar) -> Load:
    """Return a load times a factor."""
    if isinstance(load, Torque):
        return Torque(load.link, factor * load.moment)
    x, y = load.components
    return Force(load.point, (factor * x, factor * y))


def mode_solution(
    pose: Pose,
    effects: tuple[Effect, ...],
    elements: Sequence[ContactElement],
    states: Sequence[ContactState],
    dents: Sequence[PlasticState | None],
    u: Pair,
    t: Scalar,
    roots: dict[int, Any] | None = None,
    rate: Scalar | None = None,
) -> Solution:
    """Return du/dt and the forces in a mode at a state; `roots` (m^½) are √depth by element.

    A mode that holds the chain at rest needs no stabilization.
    """
    if constraint_count(elements, states) >= MOST_CONSTRAINTS:
        rate = None
    active = [
        element.normal is None or s is not ContactState.OPEN
        for element, s in zip(elements, states, strict=True)
    ]
    pushes = [
        push_of(pose, element, dent, u, (roots or {}).get(index)) if is_active else 0
        for index, (element, dent, is_active) in enumerate(
            zip(elements, dents, active, strict=True)
        )
    ]
    equations = local_equations(pose, effects, elements, u, t, active, pushes, rate)
    return solve(equations, elements, states)
