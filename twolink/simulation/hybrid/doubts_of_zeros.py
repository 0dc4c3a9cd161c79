"""Doubts on laws that hold within round-off only, at the start of an arc and along it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from twolink.arithmetic import Pair
from twolink.contact.states import ContactState, EventKind, slipping
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.complementarity import (
    Orders,
    Problem,
    States,
    is_solvable,
    problem_at,
)
from twolink.simulation.hybrid.conditions import Condition, Law
from twolink.simulation.hybrid.dynamics import Share, accelerated, shares_of, solve
from twolink.simulation.hybrid.leaving import leaving
from twolink.simulation.hybrid.mode import Doubt, Leaving, Trigger, doubt_of_change, doubt_of_rate
from twolink.simulation.hybrid.noise import Zero, size_of
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.select import Selection
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem

*_, _LONGEST = PRECISIONS

# Number of times of an arc at which the growth of a change is computed, at most twice as many.
_MOST_TIMES = 16

_LAWS = {EventKind.LEAVES: Law.PUSHES, EventKind.BREAKS: Law.WITHIN_LIMIT}


def of_selection(
    system: HybridSystem, state: HybridState, selection: Selection
) -> tuple[Doubt, ...]:
    """Return the doubts on laws of the mode of a selection that a longer precision may decide."""
    return _undecided(system, float(state.t), _zeros(selection.orders))


def of_arc(system: HybridSystem, arc: Arc, orders: Orders) -> tuple[Doubt, ...]:
    """Return the doubts on laws that are violated within round-off along an arc.

    Such a force is zero since the start of the arc, and a load that grows slowly may exceed it at
    any time from there on. `orders` are those of the selection there, on whose laws it has doubts.
    """
    known = _zeros(orders)
    lower = {
        trigger: value
        for trigger, value in arc.lowest.items()
        if trigger not in known or value < known[trigger].value
    }
    if not known and not lower:
        return ()
    violated = _at_values(system, arc, lower) if lower else {}
    found = _undecided(system, float(arc.start.t), violated)
    excess = {
        trigger: own.excess
        for trigger, own in {**known, **violated}.items()
        if own.excess and _is_decided(system, trigger, own) and not _moves_at_once(system, trigger)
    }
    for triggers in _alone_and_together(excess):
        found += _of_left_out(system, arc, {trigger: excess[trigger] for trigger in triggers})
    return found


def leaving_later(system: HybridSystem, arc: Arc, orders: Orders) -> Leaving | None:
    """Return how a change by an earlier doubt goes on along an arc on which the chain rests.

    Two runs that rest have no difference that would show it. Laws of the selection at its start
    that hold within round-off may be violated by the change, each of them alone or all at once. It
    is None where the chain moves.
    """
    begin, end, states = arc.start, arc.end, arc.mode.states
    if any(begin.u) or any(end.u) or begin.q != end.q:
        return None
    zeros = [trigger for trigger in _zeros(orders) if trigger.kind in _LAWS]
    others = (_obeying_all(system, begin, states, each) for each in _alone_and_together(zeros))
    pose = system.pose(begin.q)
    possible = [own for own in others if is_solvable(_problem(system, begin, pose, own), own)]
    return Leaving.worst(_leaving_along(system, arc, own) for own in (states, *possible))


def _alone_and_together(triggers: Iterable[Trigger]) -> list[list[Trigger]]:
    """Return each of some events alone, and all at once if there are several."""
    every = list(triggers)
    return [[trigger] for trigger in every] + ([every] if len(every) > 1 else [])


def _zeros(orders: Orders) -> dict[Trigger, Zero]:
    """Return the laws of a selection that hold within round-off only."""
    return {trigger: known for trigger, known in orders.items() if isinstance(known, Zero)}


def _at_values(
    system: HybridSystem, arc: Arc, values: Mapping[Trigger, float]
) -> dict[Trigger, Zero]:
    """Return laws that have values (N or N m) within round-off along an arc."""
    state, states = arc.start, arc.mode.states
    problem = _problem(system, state, system.pose(state.q), states)
    du = solve(problem.equations, system.elements, states).du
    laws = {t: Condition(_LAWS[t.kind], t.index, t.sense) for t in values}
    return {t: problem.noise.zero(laws[t], state.q, du, value) for t, value in values.items()}


def _undecided(
    system: HybridSystem, time: float, zeros: Mapping[Trigger, Zero]
) -> tuple[Doubt, ...]:
    """Return the doubts on laws at a time (s) that a longer precision may decide otherwise.

    Where kinetic friction is smaller, an element that slips instead moves at once, however little
    the limit is exceeded: only the longest precision shows that it is not. Otherwise a force that
    contradicts a law moves the chain slowly. The longest precision decides all that float64 numbers
    may give, except within their own rounding at a start, which leaves out an acceleration.
    """
    return tuple(
        doubt_of_change(time, trigger, math.inf)
        for trigger, known in zeros.items()
        if not _is_decided(system, trigger, known)
    )


def _is_decided(system: HybridSystem, trigger: Trigger, known: Zero) -> bool:
    """Return whether no longer precision could decide otherwise on a law, but for a slow motion."""
    longest = system.precision == _LONGEST
    if _moves_at_once(system, trigger):
        return longest and known.obeys
    return longest or known.is_rounding


def _moves_at_once(system: HybridSystem, trigger: Trigger) -> bool:
    """Return whether the force of an element falls as its law is violated."""
    return trigger.kind is EventKind.BREAKS and system.elements[trigger.index].hysteretic


def _of_left_out(
    system: HybridSystem, arc: Arc, violated: Mapping[Trigger, float]
) -> tuple[Doubt, ...]:
    """Return the doubt on the acceleration of the mode in which elements obey violated laws.

    These are violated from the start of an arc by forces (N or N m) or accelerations (rad/s² or
    m/s²).
    """
    state, states = arc.start, arc.mode.states
    others = _obeying_all(system, state, states, violated)
    problem = _problem(system, state, system.pose(state.q), others)
    if not is_solvable(problem, others):
        # Others hold it: no motion is left out.
        return ()
    left = [
        (excess, _response(problem, states, others, trigger))
        for trigger, excess in violated.items()
    ]
    rate = size_of((sum(x * a for x, (a, _) in left), sum(x * b for x, (_, b) in left)))
    if not rate:
        return ()
    first, along = next(iter(violated)), _leaving_along(system, arc, others)
    return (doubt_of_rate(float(state.t), first, rate, along),)


def _leaving_along(system: HybridSystem, arc: Arc, states: States) -> Leaving:
    """Return how a small change goes on in a mode along an arc: as at the worst of its times."""
    return Leaving.worst(leaving(system, state, states) for state in _states_along(arc))


def _states_along(arc: Arc) -> list[HybridState]:
    """Return states at some times of an arc, from its start to its end."""
    steps = [(block, place) for block in arc.blocks for place in range(len(block.lengths))]
    chosen = steps[1 :: max(1, len(steps) // _MOST_TIMES)]
    return [arc.start, *(_at_step(arc, block, place) for block, place in chosen), arc.end]


def _at_step(arc: Arc, block: Block, place: int) -> HybridState:
    """Return the state at the start of a step of an arc."""
    clock, row = arc.compiled.clock, block.coefficients[place, :, 0]
    t = block.starts[place] if clock is None else arc.start.t + row[clock]
    return arc.start._replace(t=t, q=(row[0], row[1]), u=(row[2], row[3]))


def _problem(system: HybridSystem, state: HybridState, pose: Pose, states: States) -> Problem:
    return problem_at(system, state, pose, tuple((own,) for own in states))


def _response(problem: Problem, states: States, others: States, trigger: Trigger) -> Pair:
    """Return the accelerations (rad/s²) in other states by a unit of the violation of a law.

    They are those without the force that an element has in its own state beyond its law, or by the
    acceleration along its normal that it gets in the other one.
    """
    elements, index = problem.system.elements, trigger.index
    terms = problem.equations.terms[index]
    assert terms is not None
    shares = [
        Share(tuple(own._replace(bias=0 * own.bias) for own in share.constraints), ())
        for share in shares_of(problem.equations, elements, others)
    ]
    if trigger.kind is EventKind.HITS:
        first, *rest = shares[index].constraints
        shares[index] = Share((first._replace(bias=0 * first.bias - 1), *rest), ())
        return _accelerations(problem, (0 * first.bias, 0 * first.bias), shares)
    # The last constraint of an element that sticks is that along its tangent.
    place = -1 if trigger.kind is EventKind.BREAKS else 0
    x, y = elements[index].constraints(states[index], terms)[place].force
    sense = trigger.sense or 1
    return _accelerations(problem, (sense * x, sense * y), shares)


def _accelerations(problem: Problem, force: Pair, shares: Sequence[Share]) -> Pair:
    """Return the accelerations (rad/s²) by a generalized force (N m) alone."""
    (a, b), _ = accelerated(problem.equations._replace(r=force), shares)
    return float(a), float(b)


def _obeying_all(
    system: HybridSystem, state: HybridState, states: States, triggers: Iterable[Trigger]
) -> States:
    """Return the states in which elements obey the laws of some events."""
    for trigger in triggers:
        states = put(states, trigger.index, _obeying(system, state, trigger))
    return states


def _obeying(system: HybridSystem, state: HybridState, trigger: Trigger) -> ContactState:
    """Return the state in which an element obeys the law of an event, instead of its own one."""
    if trigger.kind is EventKind.BREAKS:
        return slipping(trigger.sense)
    if trigger.kind is EventKind.LEAVES:
        return ContactState.OPEN
    return system.options(state.touching, state.sliding)[trigger.index][0]
