"""Decision of conditions that are zero within round-off, by higher derivatives of the motion."""

from __future__ import annotations

from twolink.contact.states import EventKind
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.complementarity import (
    Candidate,
    Condition,
    Law,
    Orders,
    Problem,
    States,
    noise_of,
    value_of,
)
from twolink.simulation.hybrid.dynamics import (
    LocalEquations,
    Pose,
    Solution,
    local_equations,
    mode_solution,
)
from twolink.simulation.hybrid.jet import Jet, constant, leading_term
from twolink.simulation.hybrid.mode import Trigger

# Most conditions are decided by few terms.
_LENGTHS = 3, tolerances.JET_ORDER + 1

# The events that a law keeps from coming at once, and the order at which its value appears in their
# event functions: an acceleration is the second derivative of a place.
_EVENTS = {
    Law.SEPARATES: (EventKind.HITS, 2),
    Law.PUSHES: (EventKind.LEAVES, 0),
    Law.WITHIN_LIMIT: (EventKind.BREAKS, 0),
    Law.ACCELERATES: (EventKind.STOPS, 1),
}


def confirmed(problem: Problem, candidate: Candidate) -> Orders | None:
    """Return the orders at which the event functions of a mode grow from zero, None if one falls.

    Undecided conditions must hold immediately afterwards, in the motion of that mode.
    """
    found = {_trigger(c): _EVENTS[c.law][1] for c in candidate.decided}
    if not candidate.undecided:
        return found
    try:
        leading = _decided(problem, candidate)
    except (ZeroDivisionError, OverflowError, ValueError):
        # The motion is not analytic: its events decide.
        return found
    for condition, (order, sign) in leading.items():
        if sign < 0 or (sign == 0 and condition.law is Law.ACCELERATES):
            return None
        if sign > 0:
            found[_trigger(condition)] = _EVENTS[condition.law][1] + order
    return found


def _decided(problem: Problem, candidate: Candidate) -> dict[Condition, tuple[int, int]]:
    """Return the order and the sign that decide each undecided condition, where there are any."""
    for length in _LENGTHS:
        jets = _jets(problem, candidate.states, length)
        found = {c: _leading(problem, candidate, c, *jets) for c in candidate.undecided}
        if all(sign for _, sign in found.values()):
            break
    return found


def _trigger(condition: Condition) -> Trigger:
    return Trigger(_EVENTS[condition.law][0], condition.number, condition.sense)


def _leading(
    problem: Problem,
    candidate: Candidate,
    condition: Condition,
    solution: Solution,
    equations: LocalEquations,
) -> tuple[int, int]:
    """Return the order and the sign of the first derivative of a condition beyond round-off."""
    value = value_of(problem.system, equations, solution, condition)
    value = value if isinstance(value, Jet) else constant(value, 2)
    noise = noise_of(problem, condition, candidate.solution)
    return leading_term(value.terms[:-1], noise, 1 / problem.system.longest_step)


def _jets(problem: Problem, states: States, length: int) -> tuple[Solution, LocalEquations]:
    """Return the motion in a mode as jets of a length: the solution and the equations."""
    system, state = problem.system, problem.state
    zero = 0 * state.q[0]
    q = [[x, v, *[zero] * (length - 2)] for x, v in zip(state.q, state.u, strict=True)]
    u = [[v, *[zero] * (length - 1)] for v in state.u]
    t = (state.t, 1 + zero, *[zero] * (length - 2))
    dents = [own.plastic if own is not None else None for own in state.compliant]
    for k in range(1, length + 1):
        # Each coefficient follows from those before it.
        pair = Jet(tuple(q[0][:k])), Jet(tuple(q[1][:k]))
        speeds = Jet(tuple(u[0][:k])), Jet(tuple(u[1][:k]))
        pose, now = Pose(system.chain, system.formulation, pair), Jet(t[:k])
        solution = mode_solution(pose, system.effects, system.elements, states, dents, speeds, now)
        if k == length:
            break
        for link, du in enumerate(solution.du):
            terms = du.terms if isinstance(du, Jet) else constant(du, k).terms
            u[link][k] = terms[k - 1] / k
            if k + 1 < length:
                q[link][k + 1] = u[link][k] / (k + 1)
    active = [terms is not None for terms in problem.equations.terms]
    pushes = [terms.push if terms is not None else 0 for terms in problem.equations.terms]
    equations = local_equations(pose, system.effects, system.elements, speeds, now, active, pushes)
    return solution, equations
