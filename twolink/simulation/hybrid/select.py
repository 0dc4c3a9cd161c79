"""Mode selection: the complementarity problem of friction and contact, by enumeration.

Every combination of possible states is solved with all its constraints, and kept if it satisfies
every law: contacts push, opening contacts separate, sticking elements stay within the static limit,
and elements that begin to slide accelerate against their friction. A condition that is zero within
round-off is decided by the higher derivatives of the motion in that mode.

If the laws admit more than one motion, these rules apply in this order:

0. A chain at rest stays at rest as long as any distribution of forces within the laws holds it, one
   link or both: a link whose loads balance needs no force. If the laws also admit that it leaves,
   as where friction wedges link 1 against a surface that the loads would open, the choice is noted.
   Left out are forces that no load causes: contacts on opposite sides of a link might press on it,
   and grip it by friction (`grip`). If a chain leaves its rest between them, that is noted too.
1. An element at rest keeps sticking as long as its static limit can hold it with all others in
   their states of the same mode. So it begins to slide only in a mode in which sticking instead
   would exceed its limit, and only if elements that hold one link together, all but one of them
   with saturated friction, cannot hold it; the choice is noted. If that leaves no mode, as it may
   where static limits are larger than kinetic friction, a mode in which elements begin to slide
   need only satisfy the laws.
2. If the limits of several elements at rest are exceeded when all of them are held, the one that is
   exceeded by the largest factor begins to slide, and of equal factors that of the first element.
   Where another one could begin to slide instead, the choice is noted.
3. The mode with the fewest elements that begin to slide, then with the fewest saturated frictions,
   and then with the fewest contacts that open is taken. If such modes still differ in their
   motion, the choice is noted; and so is saturated friction that wedges a link at rest, while the
   other one moves, where the loads may lift it off as well.

If more than two elements hold a chain at rest, their forces are not unique although the motion is.
Then friction carries as much as it can, and contacts have the least total normal force. Contacts in
one place are one contact if they have the same friction. If they have not, the motion depends on
which of them carries the force of a slide: that with the least normal force, and it is noted.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from twolink.arithmetic import Pair
from twolink.contact.states import ContactState, EventKind
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.complementarity import (
    NO_ELEMENTS,
    NO_ORDERS,
    Candidate,
    Orders,
    Problem,
    States,
    begun,
    is_at_rest,
    is_solvable,
    problem_at,
)
from twolink.simulation.hybrid.confirm import Delay, Derivatives
from twolink.simulation.hybrid.dynamics import MOST_CONSTRAINTS, constraint_count, solve
from twolink.simulation.hybrid.grip import is_gripped
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.noise import size_of
from twolink.simulation.hybrid.other_motions import (
    accelerates,
    departs,
    departures,
    other_motions,
    other_slides,
    pairs_in_one_place,
)
from twolink.simulation.hybrid.painleve import jammed
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.singular_pose import wedged
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.trials import Trials


class Early(NamedTuple):
    """The change of u (rad/s) if a mode is left that holds a little longer, and the event there."""

    change: float
    trigger: Trigger


class Selection(NamedTuple):
    """The states of the next mode, and the other modes that the laws admit.

    It is not `confirmed` if the higher derivatives contradict every remaining mode. Where round-off
    may hide that another mode holds a little longer, `early` says what that would change. So many
    modes were `tried`.
    """

    states: States
    others: tuple[States, ...] = ()
    confirmed: bool = True
    orders: Orders = NO_ORDERS
    early: Early | None = None
    tried: int = 0


def select(
    system: HybridSystem, state: HybridState, pose: Pose, known: Mapping[int, States]
) -> Selection | None:
    """Return the next mode, or None if the laws admit none.

    If the derivatives contradict every remaining mode, the cause is round-off unless a slide is
    jammed, a contact is wedged, or contacts grip the chain. `known` has the states to which
    elements are restricted, by number.
    """
    options, opening = system.options(state.touching, state.sliding), NO_ELEMENTS
    if known:
        options = tuple([known.get(index, own) for index, own in enumerate(options)])
        opening = frozenset(
            index for index in state.touching if known.get(index) == (ContactState.OPEN,)
        )
    twins = _twins(system, state.touching)
    for _, other in twins:
        options = put(options, other, (ContactState.OPEN,))
    found = _only(options) or _selected(problem_at(system, state, pose, options, opening), pose)
    if found is None:
        return None
    if is_at_rest(system, state) and is_gripped(system, state, pose):
        found = _with_grip(system, state, pose, found)
    return _of_both(found, twins) if twins else found


def _twins(system: HybridSystem, touching: frozenset[int]) -> Sequence[tuple[int, int]]:
    """Return the pairs of touching contacts in one place that are one contact.

    What happens to one of them happens to the other. The first has the force of both.
    """
    if len(touching) < 2:
        return ()
    return [pair for pair in pairs_in_one_place(system, alike=True) if touching.issuperset(pair)]


def _of_both(selection: Selection, twins: Sequence[tuple[int, int]]) -> Selection:
    """Return a selection in which contacts that open with others have the orders of their gaps."""
    orders = dict(selection.orders)
    for first, other in twins:
        order = orders.get(Trigger(EventKind.HITS, first))
        if order is not None:
            orders[Trigger(EventKind.HITS, other)] = order
    return selection._replace(orders=orders)


@functools.lru_cache(maxsize=1024)
def _only(options: tuple[States, ...]) -> Selection | None:
    """Return the mode that options without a choice leave, None if there is a choice."""
    if any(len(states) > 1 for states in options):
        return None
    return Selection(tuple(states[0] for states in options))


def _selected(problem: Problem, pose: Pose) -> Selection | None:
    """Return the next mode between the options of a problem, or None if the laws admit none."""
    trials, derivatives = Trials(problem), Derivatives(problem)
    found = _admitted(problem, pose, trials, derivatives)
    if found is None:
        return None
    delays = derivatives.delays
    early = _early(problem, delays, found.states) if delays else None
    return found._replace(early=early, tried=trials.count)


def _with_grip(system: HybridSystem, state: HybridState, pose: Pose, found: Selection) -> Selection:
    """Return a selection beside which contacts could grip the chain, if it leaves its rest.

    Forces with which contacts press on opposite sides are left out of all modes.
    """
    if constraint_count(system.elements, found.states) == MOST_CONSTRAINTS:
        return found
    problem = problem_at(system, state, pose, system.options(state.touching, state.sliding))
    du = solve(problem.equations, system.elements, found.states).du
    leaves = accelerates(problem, du) or begun(found.states, state.sliding) > 0
    held = _all_held(problem)
    if not leaves or held == found.states or held in found.others:
        return found
    return found._replace(others=(*found.others, held))


def _all_held(problem: Problem) -> States:
    """Return the states in which all elements stick or rest that may."""
    return tuple(
        ContactState.STICKS if ContactState.STICKS in options else options[0]
        for options in problem.options
    )


def _early(problem: Problem, delays: Mapping[States, Delay], states: States) -> Early:
    """Return the largest change of u (rad/s) by another mode that holds for its delay."""
    elements = problem.system.elements
    own = solve(problem.equations, elements, states).du
    changes = []
    for others, (time, trigger) in delays.items():
        du = solve(problem.equations, elements, others).du
        changes.append(Early(time * size_of((du[0] - own[0], du[1] - own[1])), trigger))
    return max(changes, key=lambda early: early.change)


def _admitted(
    problem: Problem, pose: Pose, trials: Trials, derivatives: Derivatives
) -> Selection | None:
    """Return the mode that the laws and the derivatives admit, or None if there is none."""
    at_rest = is_at_rest(problem.system, problem.state)
    orders: dict[States, Orders] = {}
    undecided: list[Candidate] = []
    moving: list[Candidate] = []
    for sticking_first, with_pressed in ((True, False), (True, True), (False, False)):
        # Modes that only satisfy the laws come before those that higher derivatives contradict.
        if not sticking_first and moving:
            break
        # Beside others that begin slides, modes with saturated friction count if they begin none.
        candidates = list(trials.candidates(with_pressed, sticking_first, beginning=not moving))
        locked = {c.states for c in candidates if at_rest and _is_locked(problem, c)}
        every = {c.states: derivatives.confirmed(c) for c in candidates if c.states not in locked}
        confirmed = {states: known for states, known in every.items() if known is not None}
        orders |= confirmed
        holding = locked | {
            c.states
            for c in candidates
            if c.states in confirmed and at_rest and _rests(problem, c, confirmed[c.states])
        }
        resting = [c for c in candidates if c.states in holding]
        taken = _first_confirmed(derivatives, problem, resting)
        found = [c for c in candidates if c.states in confirmed and c.states not in holding]
        if taken is not None:
            # The laws may admit that the chain leaves its rest as well.
            return taken._replace(others=departures(problem, moving or found, orders))
        if found and not at_rest and (with_pressed or not _all_break_away(problem, found)):
            held = [c for c in found if not _begins(problem, c)] if moving else []
            taken = _preferred(problem, held or moving or found, orders)
            if held:
                return _with_others(taken, moving)
            return taken if with_pressed else _with_wedged(problem, trials, derivatives, taken)
        undecided += candidates
        moving = moving or found
    if moving:
        return _preferred(problem, moving, orders)
    if not undecided or _only_grips(problem, pose) or _is_stopped(problem, pose):
        return None
    return _preferred(problem, undecided, {})._replace(confirmed=False)


def _is_stopped(problem: Problem, pose: Pose) -> bool:
    """Return whether a slide is jammed, or a contact wedged: no finite force keeps its law."""
    case = problem.system, problem.state, pose
    return bool(jammed(*case) or wedged(*case))


def _only_grips(problem: Problem, pose: Pose) -> bool:
    """Return whether only contacts that grip a chain at rest may hold it."""
    system, state = problem.system, problem.state
    return is_at_rest(system, state) and is_gripped(system, state, pose)


def _all_break_away(problem: Problem, found: list[Candidate]) -> bool:
    """Return whether elements with a higher static limit begin to slide in all modes.

    With kinetic friction they may not hold a link that they hold with static friction.
    """
    hysteretic = any(element.hysteretic for element in problem.system.elements)
    return hysteretic and all(_begins(problem, each) for each in found)


def _with_wedged(
    problem: Problem, trials: Trials, derivatives: Derivatives, taken: Selection
) -> Selection:
    """Return a selection beside which saturated friction may hold a link as well.

    Where it begins no slide, it is a motion by the laws, though one without it is preferred.
    """
    others: list[Candidate] = []
    motions: list[Pair] = []
    for candidate in trials.candidates(with_pressed=True, beginning=False):
        if not motions:
            motions = [solve(problem.equations, problem.system.elements, taken.states).du]
        differs = all(other_motions(problem, [candidate], du) for du in motions)
        if differs and derivatives.confirmed(candidate) is not None:
            others.append(candidate)
            motions.append(candidate.solution.du)
    return _with_others(taken, others) if others else taken


def _with_others(selection: Selection, others: list[Candidate]) -> Selection:
    """Return a selection beside which the laws admit other modes as well."""
    every = (*selection.others, *(each.states for each in others))
    return selection._replace(others=tuple(dict.fromkeys(every)))


def _begins(problem: Problem, candidate: Candidate) -> int:
    """Return how many elements begin to slide in a mode."""
    return begun(candidate.states, problem.directions)


def _first_confirmed(
    derivatives: Derivatives, problem: Problem, resting: list[Candidate]
) -> Selection | None:
    """Return the preferred confirmed mode of those that hold the chain at rest: one motion."""
    for candidate in sorted(resting, key=lambda candidate: _cost(problem, candidate)):
        known = derivatives.confirmed(candidate)
        if known is not None:
            return Selection(candidate.states, orders=known)
    return None


def _is_locked(problem: Problem, candidate: Candidate) -> bool:
    """Return whether a mode holds a chain at rest by two constraints."""
    return constraint_count(problem.system.elements, candidate.states) == MOST_CONSTRAINTS


def _rests(problem: Problem, candidate: Candidate, orders: Orders) -> bool:
    """Return whether a mode holds a chain at rest by one constraint, with these orders of events.

    Where the loads on one link balance, it stays at rest while only the other one is held. They may
    balance for an instant only: then the chain leaves its rest by a higher derivative.
    """
    if constraint_count(problem.system.elements, candidate.states) == 0 or departs(orders):
        return False
    return not accelerates(problem, candidate.solution.du)


def _preferred(
    problem: Problem, found: list[Candidate], orders: Mapping[States, Orders]
) -> Selection:
    """Return the mode selected by the rules, and the modes whose motion differs from it."""
    overloaded = _most_overloaded(problem) if len(found) > 1 else None
    slipping = [c for c in found if overloaded is not None and c.states[overloaded].slips]
    best = min(slipping or found, key=lambda candidate: _cost(problem, candidate))
    others = other_motions(problem, found, best.solution.du)
    others = tuple(dict.fromkeys((*others, *other_slides(problem, best.states))))
    return Selection(best.states, others, orders=orders.get(best.states, NO_ORDERS))


def _cost(problem: Problem, candidate: Candidate) -> tuple[float, ...]:
    """Return the numbers by which modes are preferred, the smallest first (rule 3)."""
    states, normal = candidate.states, 0.0
    for index, (state, forces) in enumerate(zip(states, candidate.solution.forces, strict=True)):
        if problem.system.elements[index].rigid and state is not ContactState.OPEN:
            normal += abs(float(forces.normal))
    opens = sum(
        state is ContactState.OPEN and index in problem.state.touching
        for index, state in enumerate(states)
    )
    return _begins(problem, candidate), sum(s.pressed for s in states), opens, normal


def _most_overloaded(problem: Problem) -> int | None:
    """Return the element whose static limit is exceeded most if all at rest are held (rule 2)."""
    stuck = _all_held(problem)
    if not is_solvable(problem, stuck):
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
    # Of equal ratios that of the first element counts: round-off selects none.
    band = 1 - tolerances.SAME_LIMIT * problem.system.rounding
    largest = max(ratios.values(), default=0.0)
    return next((index for index, ratio in ratios.items() if ratio >= band * largest), None)
