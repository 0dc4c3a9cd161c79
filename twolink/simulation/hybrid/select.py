"""Mode selection: the complementarity problem of friction and contact, by enumeration.

Every combination of the states that are possible is solved with all its constraints in place, and
kept if it satisfies every law: contacts push, those that open separate, elements that stick stay
within the static limit, and elements that begin to slide accelerate against their friction. A
condition that is zero to rounding is decided by the next derivatives of the motion in that mode.

Where the laws leave more than one motion, these rules hold, in this order:

0. A chain at rest stays at rest as long as any distribution of forces within the laws holds it.
1. An element at rest goes on sticking as long as its static limit can hold it with all others in
   the states that they have in the same mode. So it begins to slide only in a mode in which
   sticking in its place would exceed its limit.
2. If the limits of several elements at rest are exceeded when all of them are held, the one that is
   exceeded by the largest factor begins to slide.
3. The mode with the fewest elements that begin to slide, then with the fewest saturated frictions,
   and then with the fewest contacts that open is taken. If such modes still differ in their
   motion, the choice is noted.

Where more elements than two hold a chain at rest, their forces are not unique although the motion
is. Then friction holds as much as it can, and contacts carry the least total normal force.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from itertools import product
from typing import Any, NamedTuple

from twolink.arithmetic import Pair
from twolink.contact.states import ContactState
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.constraint import cramer, parallel, same_line
from twolink.simulation.hybrid.dynamics import (
    MOST_CONSTRAINTS,
    LocalEquations,
    Pose,
    Solution,
    constraint_count,
    constraints_of,
    local_equations,
    mode_solution,
    push_of,
    solve,
)
from twolink.simulation.hybrid.jet import Jet, constant, leading_sign
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem

States = tuple[ContactState, ...]


class Selection(NamedTuple):
    """The states of the mode that follows, and the other modes that the laws allow, if any.

    It is not `confirmed` if the next derivatives contradict every mode that is left.
    """

    states: States
    others: tuple[States, ...] = ()
    confirmed: bool = True


class _Law(Enum):
    """A condition that a mode must satisfy."""

    PUSHES = "a contact pushes"
    SEPARATES = "a contact that opens separates"
    WITHIN_LIMIT = "friction is within its static limit"
    ACCELERATES = "an element that begins to slide accelerates"


class _Condition(NamedTuple):
    """A law for the element of this number; `sense` is a direction of friction or sliding."""

    law: _Law
    number: int
    sense: int = 0


class Problem(NamedTuple):
    """A mode selection: the equations at a state, and the possible states of each element."""

    system: HybridSystem
    state: HybridState
    equations: LocalEquations
    directions: tuple[int, ...]
    options: tuple[States, ...]
    size: float


class _Candidate(NamedTuple):
    """A mode that violates no law beyond rounding, and its conditions that are zero to rounding."""

    states: States
    solution: Solution
    undecided: tuple[_Condition, ...]


def select(
    system: HybridSystem, state: HybridState, pose: Pose, known: Mapping[int, States]
) -> Selection | None:
    """Return the mode in which the motion goes on, or None if the laws allow none.

    `known` has the states to which elements are restricted, by number.
    """
    options = tuple(
        known.get(i) or element.options(i in state.touching, state.sliding[i])
        for i, element in enumerate(system.elements)
    )
    if all(len(states) == 1 for states in options):
        return Selection(tuple(states[0] for states in options))
    problem = _problem(system, state, pose, options)
    at_rest = bool(state.u[0] == 0 and state.u[1] == 0)
    undecided: list[_Candidate] = []
    moving: list[_Candidate] = []
    for with_pressed in (False, True):
        candidates = list(_candidates(problem, with_pressed))
        found = [c for c in candidates if not c.undecided or _confirmed(problem, c)]
        resting = [c for c in found if at_rest and _rests(problem, c.states)]
        if resting:
            return _preferred(problem, resting)
        if found and not at_rest:
            return _preferred(problem, found)
        undecided += candidates
        moving = moving or found
    if moving:
        return _preferred(problem, moving)
    return _preferred(problem, undecided)._replace(confirmed=False) if undecided else None


def _rests(problem: Problem, states: States) -> bool:
    """Return whether a mode holds the chain at rest."""
    return constraint_count(problem.system.elements, states) == MOST_CONSTRAINTS


def _problem(
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
    size = sum(abs(float(x)) for x in equations.r)
    for terms in equations.terms:
        if terms is not None and terms.normal is not None:
            size += abs(float(terms.push)) * _long(terms.normal.row)
    return Problem(system, state, equations, state.sliding, options, size)


def _candidates(problem: Problem, with_pressed: bool) -> Iterator[_Candidate]:
    """Yield the modes that violate no law, with or without those that have saturated friction."""
    for states in product(*problem.options):
        if any(state.pressed for state in states) != with_pressed:
            continue
        if not _is_solvable(problem, states):
            continue
        solution = solve(problem.equations, problem.system.elements, states)
        undecided, violated = [], False
        for condition in _conditions(problem, states):
            value = float(_value(problem.equations, problem.system, solution, condition))
            noise = _noise(problem, condition, solution)
            violated = value < -noise
            if violated:
                break
            if value <= noise:
                undecided.append(condition)
        if not violated and not _could_stick(problem, states):
            yield _Candidate(states, solution, tuple(undecided))


def _is_solvable(problem: Problem, states: States) -> bool:
    """Return whether the constraints of a mode are independent, and what shall slide is free to."""
    elements = problem.system.elements
    held = [
        coordinate
        for element, state in zip(elements, states, strict=True)
        for coordinate in element.holds(state)
    ]
    if len(held) > MOST_CONSTRAINTS:
        return False
    groups = constraints_of(problem.equations, elements, states)
    rows = [constraint.row for group in groups for constraint in group]
    if any(_vanishes(problem.system, row) for row in rows):
        return False
    if len(rows) == MOST_CONSTRAINTS and parallel(*rows):
        return False
    for index, (element, state) in enumerate(zip(elements, states, strict=True)):
        if element.tangent is None or state in (ContactState.STICKS, ContactState.OPEN):
            continue
        still = len(rows) == MOST_CONSTRAINTS or any(
            same_line(element.tangent, coordinate) for coordinate in held
        )
        begins = state.slips and not problem.directions[index]
        if (begins and still) or (not state.slips and not still):
            return False
    return True


def _conditions(problem: Problem, states: States) -> Iterator[_Condition]:
    """Yield the conditions of a mode on the elements whose state is open."""
    for index, (element, state) in enumerate(zip(problem.system.elements, states, strict=True)):
        options = problem.options[index]
        if len(options) == 1:
            continue
        if state is ContactState.OPEN:
            yield _Condition(_Law.SEPARATES, index)
            continue
        if element.rigid:
            yield _Condition(_Law.PUSHES, index)
        if state is ContactState.STICKS:
            yield _Condition(_Law.WITHIN_LIMIT, index, 1)
            yield _Condition(_Law.WITHIN_LIMIT, index, -1)
        elif state.slips and not problem.directions[index] and ContactState.STICKS in options:
            yield _Condition(_Law.ACCELERATES, index, state.direction)


def _value(
    equations: LocalEquations, system: HybridSystem, solution: Solution, condition: _Condition
) -> Any:
    """Return a condition's value (N, N m), which is not negative if it holds.

    An acceleration is measured by the force along its coordinate that would give it.
    """
    law, index, sense = condition
    forces, terms = solution.forces[index], equations.terms[index]
    assert terms is not None
    if law is _Law.PUSHES:
        return forces.normal
    if law is _Law.WITHIN_LIMIT:
        return system.elements[index].limits(forces.normal)[1] + sense * forces.tangential
    along = terms.normal if law is _Law.SEPARATES else terms.tangent
    assert along is not None
    acceleration = _acceleration(along, solution.du)
    x, y = cramer(equations.M, along.row, equations.det)
    response = along.row[0] * x + along.row[1] * y
    if not isinstance(response, Jet) and _long(along.row) == 0:
        return 0.0
    return (sense or 1) * acceleration / response


def _acceleration(along: Any, du: Pair) -> Any:
    row, bias = along
    return row[0] * du[0] + row[1] * du[1] + bias


def _noise(problem: Problem, condition: _Condition, solution: Solution) -> float:
    """Return the rounding of a condition's value."""
    terms = problem.equations.terms[condition.number]
    assert terms is not None
    by_normal = condition.law in (_Law.PUSHES, _Law.SEPARATES)
    along = terms.normal if by_normal else terms.tangent
    assert along is not None
    (M11, M12), (_, M22) = problem.equations.M
    du1, du2 = (abs(float(x)) for x in solution.du)
    size = (
        problem.size + (float(M11) + abs(float(M12))) * du1 + (abs(float(M12)) + float(M22)) * du2
    )
    long = _long(along.row)
    scale = tolerances.UNDECIDED * problem.system.resolution * size
    return float("inf") if _vanishes(problem.system, along.row) else scale / long


def _vanishes(system: HybridSystem, row: Pair) -> bool:
    """Return whether a row is the rounding of zero: no force acts along it in this pose."""
    lever = float(system.scene_chain.L1 + system.scene_chain.L2)
    return _long(row) <= tolerances.NO_LEVER * system.rounding * lever


def _long(row: Pair) -> float:
    return max(abs(float(row[0])), abs(float(row[1])))


def _could_stick(problem: Problem, states: States) -> bool:
    """Return whether an element that begins to slide could stick in its place (rule 1)."""
    elements = problem.system.elements
    for index, state in enumerate(states):
        begins = state.slips and not problem.directions[index] and len(problem.options[index]) > 1
        if not begins or ContactState.STICKS not in problem.options[index]:
            continue
        if not elements[index].hysteretic:
            continue
        instead = (*states[:index], ContactState.STICKS, *states[index + 1 :])
        if not _is_solvable(problem, instead):
            continue
        solution = solve(problem.equations, elements, instead)
        limits = [_Condition(_Law.WITHIN_LIMIT, index, sense) for sense in (1, -1)]
        margin = min(
            float(_value(problem.equations, problem.system, solution, limit)) for limit in limits
        )
        if margin > _noise(problem, limits[0], solution):
            return True
    return False


def _confirmed(problem: Problem, candidate: _Candidate) -> bool:
    """Return whether the motion in a mode satisfies its undecided conditions a moment later."""
    system, state = problem.system, problem.state
    try:
        length, solution, equations = _jets(problem, candidate.states)
    except (ZeroDivisionError, OverflowError, ValueError):
        return True
    lever = float(abs(system.chain.L1) + abs(system.chain.L2))
    du = max(
        abs(float(x))
        for x in cramer(problem.equations.M, problem.equations.r, problem.equations.det)
    )
    speed = max(abs(float(x)) for x in state.u)
    scale = tolerances.UNDECIDED * system.resolution
    for condition in candidate.undecided:
        law, index, sense = condition
        terms = equations.terms[index]
        assert terms is not None
        if law in (_Law.SEPARATES, _Law.ACCELERATES):
            along = terms.normal if law is _Law.SEPARATES else terms.tangent
            value = (sense or 1) * _acceleration(along, solution.du)
            size = lever * (du + speed * speed) + du
        else:
            value = _value(equations, system, solution, condition)
            size = _noise(problem, condition, candidate.solution) / scale
        value = value if isinstance(value, Jet) else constant(value, length)
        sign = leading_sign(value.terms[:-1], scale * size, 1 / system.longest_step)
        if sign < 0 or (sign == 0 and law is _Law.ACCELERATES):
            return False
    return True


def _jets(problem: Problem, states: States) -> tuple[int, Solution, LocalEquations]:
    """Return the motion in a mode as jets: their length, the solution, and the equations."""
    system, state = problem.system, problem.state
    length = tolerances.JET_ORDER + 1
    zero = 0 * state.q[0]
    q = [[x, v, *[zero] * (length - 2)] for x, v in zip(state.q, state.u, strict=True)]
    u = [[v, *[zero] * (length - 1)] for v in state.u]
    t = Jet((state.t, 1 + zero, *[zero] * (length - 2)))
    dents = [own.plastic if own is not None else None for own in state.compliant]
    for k in range(1, length + 1):
        pair = Jet(tuple(q[0])), Jet(tuple(q[1]))
        speeds = Jet(tuple(u[0])), Jet(tuple(u[1]))
        pose = Pose(system.chain, system.formulation, pair)
        solution = mode_solution(pose, system.effects, system.elements, states, dents, speeds, t)
        if k == length:
            break
        for link, du in enumerate(solution.du):
            terms = du.terms if isinstance(du, Jet) else constant(du, length).terms
            u[link][k] = terms[k - 1] / k
            if k + 1 < length:
                q[link][k + 1] = u[link][k] / (k + 1)
    active = [terms is not None for terms in problem.equations.terms]
    pushes = [terms.push if terms is not None else 0 for terms in problem.equations.terms]
    equations = local_equations(pose, system.effects, system.elements, speeds, t, active, pushes)
    return length, solution, equations


def _preferred(problem: Problem, found: list[_Candidate]) -> Selection:
    """Return the mode that the rules take, and the others that differ from it in their motion."""
    overloaded = _most_overloaded(problem) if len(found) > 1 else None
    if overloaded is not None:
        slipping = [c for c in found if c.states[overloaded].slips]
        found = slipping or found
    best = min(found, key=lambda candidate: _cost(problem, candidate))
    size = max(abs(float(x)) for x in best.solution.du)
    free = cramer(problem.equations.M, problem.equations.r, problem.equations.det)
    size = max(size, *(abs(float(x)) for x in free))
    others = [
        c.states
        for c in found
        if any(
            abs(float(x) - float(y)) > tolerances.SAME_MOTION * size
            for x, y in zip(c.solution.du, best.solution.du, strict=True)
        )
    ]
    return Selection(best.states, tuple(others))


def _cost(problem: Problem, candidate: _Candidate) -> tuple[float, ...]:
    """Return the numbers by which modes are preferred, the smallest first (rule 3)."""
    states, normal = candidate.states, 0.0
    for index, (state, forces) in enumerate(zip(states, candidate.solution.forces, strict=True)):
        if problem.system.elements[index].rigid and state is not ContactState.OPEN:
            normal += abs(float(forces.normal))
    begins = sum(
        state.slips and not direction
        for state, direction in zip(states, problem.directions, strict=True)
    )
    opens = sum(
        state is ContactState.OPEN and index in problem.state.touching
        for index, state in enumerate(states)
    )
    return begins, sum(state.pressed for state in states), opens, normal


def _most_overloaded(problem: Problem) -> int | None:
    """Return the element whose static limit is exceeded most when all at rest are held (rule 2)."""
    stuck = tuple(
        ContactState.STICKS if ContactState.STICKS in options else options[0]
        for options in problem.options
    )
    if not _is_solvable(problem, stuck):
        return None
    elements = problem.system.elements
    solution = solve(problem.equations, elements, stuck)
    ratios: dict[int, float] = {}
    for index, forces in enumerate(solution.forces):
        if stuck[index] is not ContactState.STICKS or not elements[index].hysteretic:
            continue
        limit = float(elements[index].limits(forces.normal)[1])
        if limit > 0 and abs(float(forces.tangential)) > limit:
            ratios[index] = abs(float(forces.tangential)) / limit
    return max(ratios, key=ratios.__getitem__) if ratios else None


def jammed(system: HybridSystem, state: HybridState, pose: Pose) -> Sequence[int]:
    """Return the rigid contacts whose slide friction locks (Painlevé), the fastest slide first.

    There row · M⁻¹ (normal + friction) is negative: pushing presses the point on.
    """
    found: list[tuple[float, int]] = []
    for index in sorted(state.touching):
        element, direction = system.elements[index], state.sliding[index]
        if not element.rigid or element.tangent is None or not direction:
            continue
        assert element.normal is not None
        row, tangent = pose.row(element.normal), pose.row(element.tangent)
        speed = tangent[0] * state.u[0] + tangent[1] * state.u[1]
        s = -direction * element.limits(1)[0]
        force = row[0] + s * tangent[0], row[1] + s * tangent[1]
        if pose.response(row, force) < 0:
            found.append((-abs(float(speed)), index))
    return [index for _, index in sorted(found)]
