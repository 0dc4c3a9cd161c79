"""Jumps: the state and the mode that follow an event.

Each kind of event has one reaction, found in a table. A reaction changes the state and may restrict
the states of some elements; then the jump is settled: contacts that are approached strike, bounces
that end within rounding are left out (Zeno), and the mode in which the motion goes on is selected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from twolink.arithmetic import Pair
from twolink.contact.states import ContactState, EventKind, pressed, slipping
from twolink.errors import IntegrationError
from twolink.simulation.hybrid import compliant_state, tolerances
from twolink.simulation.hybrid.constraint import parallel, same_line
from twolink.simulation.hybrid.dynamics import MOST_CONSTRAINTS, Pose, mode_solution
from twolink.simulation.hybrid.event_functions import locks
from twolink.simulation.hybrid.impact import (
    Impacts,
    Strike,
    at_rest,
    is_left_over,
    placed,
    speed_along,
    stopped,
)
from twolink.simulation.hybrid.mode import Mode, Trigger
from twolink.simulation.hybrid.select import Selection, States, jammed, select
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem

# Impacts without collision and Zeno limits at one instant before a jump is given up.
_MOST_ROUNDS = 40


@dataclass(frozen=True)
class Jump:
    """The state and mode after a jump, its impacts, and sentences on choices that the laws leave.

    `delay` (s) is the time by which bounces that were left out would have lasted.
    """

    state: HybridState
    mode: Mode
    strikes: tuple[Strike, ...] = ()
    notes: tuple[str, ...] = ()
    delay: float = 0.0


class Reaction(NamedTuple):
    """The state right after an event, and the states to which elements are restricted."""

    state: HybridState
    known: Mapping[int, States]
    strikes: tuple[Strike, ...] = ()


def jump(
    system: HybridSystem,
    state: HybridState,
    mode: Mode,
    trigger: Trigger | None,
    recent: Sequence[Strike] = (),
) -> Jump:
    """Return what follows an event, or a discontinuity of the effects (None).

    `recent` are the impacts of the last moments, for the Zeno limit of several contacts. Raises
    `IntegrationError` where the laws allow no motion.
    """
    reaction = Reaction(state, {})
    if trigger is not None:
        reaction = _REACTIONS[trigger.kind](system, state, mode, trigger)
    following = settle(system, reaction.state, reaction.known, recent)
    return replace(following, strikes=reaction.strikes + following.strikes)


def settle(
    system: HybridSystem,
    state: HybridState,
    known: Mapping[int, States],
    recent: Sequence[Strike] = (),
) -> Jump:
    """Return the mode that a state goes on in, after the impacts that come before it."""
    strikes: list[Strike] = []
    notes: list[str] = []
    delay = 0.0
    for _ in range(_MOST_ROUNDS):
        pose = Pose(system.chain, system.formulation, state.q)
        state, pose, struck = _collide(system, state, pose)
        strikes += struck
        if struck:
            known = {}
        selection = select(system, state, pose, known)
        if selection is None and known:
            selection, known = select(system, state, pose, {}), {}
        if selection is None:
            state, strike = _strike_without_collision(system, state, pose)
            strikes.append(strike)
            struck, known = [strike], {}
            selection = select(system, state, pose, {})
            if selection is None:
                continue
        mode = Mode(system.names, selection.states, _dents(state))
        clamped = _zeno(system, state, pose, mode, struck, [*recent, *strikes])
        if clamped is None:
            notes += _notes(system, state, mode, selection)
            return Jump(_tidied(system, state, mode), mode, tuple(strikes), tuple(notes), delay)
        state, strikes, delay, known = clamped[0], [*strikes, *clamped[1]], clamped[2], {}
    raise IntegrationError(
        f"at {float(state.t):.9g} s the laws of impact and friction lead from one impact to the "
        f"next without end; elements in contact: {_names(system, state)}"
    )


def _dents(state: HybridState) -> tuple[Any, ...]:
    dents = tuple(own.plastic if own is not None else None for own in state.compliant)
    return dents if any(dents) else ()


def _names(system: HybridSystem, state: HybridState) -> str:
    return ", ".join(system.names[i] for i in sorted(state.touching)) or "none"


def _notes(system: HybridSystem, state: HybridState, mode: Mode, selection: Selection) -> list[str]:
    """Return a sentence if the laws leave a choice, or rounding does not let them decide."""
    if not selection.confirmed:
        return [
            f"At {float(state.t):.9g} s rounding does not let the laws of contact decide: "
            f"{mode} is taken."
        ]
    if not selection.others:
        return []
    others = "; or ".join(
        dict.fromkeys(str(replace(mode, states=states)) for states in selection.others)
    )
    return [
        f"At {float(state.t):.9g} s the laws of contact leave a choice (Painlevé): "
        f"{mode} is taken; or {others}."
    ]


def nearby(system: HybridSystem, state: HybridState) -> list[int]:
    """Return the rigid contacts whose gap is zero, but for rounding."""
    found = []
    for index, element in enumerate(system.elements):
        gap = state.gaps[index]
        if not element.rigid or gap is None:
            continue
        size = max(1.0, abs(float(element.bound)))
        if abs(gap) <= tolerances.CONTACT_GAP * system.rounding * size:
            found.append(index)
    return found


def _collide(
    system: HybridSystem, state: HybridState, pose: Pose
) -> tuple[HybridState, Pose, list[Strike]]:
    """Return the state after all contacts that are approached have struck, and the impacts."""
    near = nearby(system, state)
    impacts = Impacts(pose, system.elements, float(state.t), system.rounding)
    if not any(impacts.approached(i, state.u) for i in near if i not in state.touching):
        return state, pose, []
    placed_at = pose
    for index in near:
        placed_at = _place(system, placed_at, index, state)
    if placed_at is not pose:
        pose = placed_at
        impacts = Impacts(pose, system.elements, float(state.t), system.rounding)
    resting = [i for i in near if i in state.touching]
    found = impacts.resolve(state.u, near, resting)
    pressed_on = {i for i in state.touching if not system.elements[i].rigid}
    gaps = state.gaps
    for index in near:
        gaps = put(gaps, index, system.number(0))
    state = replace(
        state, q=pose.q, u=found.u, gaps=gaps, touching=found.resting | pressed_on,
        sliding=sliding_after(system, pose, state.u, found.u),
    )  # fmt: skip
    return state, pose, list(found.strikes)


def _place(system: HybridSystem, pose: Pose, index: int, state: HybridState) -> Pose:
    """Return the pose in which a contact is touched exactly."""
    element, own = system.elements[index], state.compliant[index]
    assert element.normal is not None
    surface = element.bound - (own.offset if own is not None else 0)
    q = placed(pose, element.normal, surface)
    return pose if q == pose.q else Pose(system.chain, system.formulation, q)


def sliding_after(system: HybridSystem, pose: Pose, before: Pair, u: Pair) -> tuple[int, ...]:
    """Return the direction in which each element slides at u, after the speeds were `before`."""
    return tuple(
        0 if element.tangent is None else direction_of(system, pose.row(element.tangent), before, u)
        for element in system.elements
    )


def direction_of(system: HybridSystem, row: Pair, before: Pair, u: Pair) -> int:
    """Return the sign of row · u, 0 where that is the rounding of zero."""
    if at_rest(row, u, system.rounding) or is_left_over(row, u, before, system.rounding):
        return 0
    return 1 if speed_along(row, u) > 0 else -1


def _strike_without_collision(
    system: HybridSystem, state: HybridState, pose: Pose
) -> tuple[HybridState, Strike]:
    """Return the state after the impact of a slide that friction locks (Painlevé).

    Neither sliding on nor leaving is possible. Friction drives the point into an impact, although
    it does not approach, until it no longer slides.
    """
    locked = jammed(system, state, pose)
    if not locked:
        raise IntegrationError(
            f"at {float(state.t):.9g} s the laws of Coulomb friction and contact allow no motion; "
            f"elements in contact: {_names(system, state)}"
        )
    index = locked[0]
    normal = system.elements[index].normal
    assert normal is not None
    impacts = Impacts(pose, system.elements, float(state.t), system.rounding)
    u = stopped(pose, [normal], state.u, system.rounding)
    strike = impacts.impact(index, u, without_collision=True)
    after = strike.u[1]
    leaves = abs(strike.speeds[1]) > tolerances.LEFT_OVER * system.rounding * max(
        abs(x) for x in state.u
    )
    touching = state.touching - {index} if leaves else state.touching
    if not leaves:
        after = stopped(pose, [normal], after, system.rounding)
    sliding = sliding_after(system, pose, state.u, after)
    if strike.impulse.regime.endswith("sticks"):
        sliding = put(sliding, index, 0)
    state = replace(state, u=after, touching=touching, sliding=sliding)
    return state, strike


def _zeno(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    mode: Mode,
    struck: Sequence[Strike],
    recent: Sequence[Strike],
) -> tuple[HybridState, list[Strike], float] | None:
    """Return the state in which contacts rest whose further bounces end within rounding, or None.

    From a speed v and under an acceleration −a bounces take the time 2v/a, e times that, e² times
    that, …: together 2v/a/(1 − e), where e is the ratio of the speeds of the last bounce. Contacts
    that interrupt each other have no such sum: if very many impacts fall into the Zeno time, all
    contacts that take part come to rest.
    """
    limit = tolerances.zeno_time(float(system.longest_step), system.rounding)
    now = float(state.t)
    flying = [s.number for s in struck if s.number not in state.touching]
    if not flying:
        return None
    crowd = [strike for strike in recent if strike.time >= now - limit]
    if len(crowd) > tolerances.MOST_IMPACTS_OF_A_BURST:
        return _clamped(system, state, pose, sorted({strike.number for strike in crowd}), 0.0)
    # A contact that was struck a moment before ends its bounces with those of the others.
    flying = list(dict.fromkeys([*flying, *(s.number for s in crowd)]))
    lasting = {
        index: _bounces_last(system, state, pose, mode, recent, index)
        for index in flying
        if index not in state.touching
    }
    ended = [index for index, time in lasting.items() if time <= limit]
    if not ended:
        return None
    return _clamped(system, state, pose, ended, max(lasting[index] for index in ended))


def _bounces_last(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    mode: Mode,
    recent: Sequence[Strike],
    index: int,
) -> float:
    """Return the time (s) of all further bounces on a contact, infinity if they do not end."""
    normal = system.elements[index].normal
    assert normal is not None
    row = pose.row(normal)
    speed, gap = speed_along(row, state.u), state.gaps[index]
    assert gap is not None
    dents = [mode.dent(i) for i in range(len(mode.states))]
    roots = {
        i: own.sqrt_depth
        for i, own in enumerate(state.compliant)
        if own is not None and own.sqrt_depth is not None
    }
    du = mode_solution(
        pose, system.effects, system.elements, mode.states, dents, state.u, state.t, roots
    ).du
    back = -(speed_along(row, du) + normal.bias(system.chain, state.q, state.u))
    if back <= 0:
        return math.inf
    before, after = next(s.speeds for s in reversed(recent) if s.number == index)
    ratio = float(after) / -float(before) if before < 0 else system.elements[index].restitution  # type: ignore[attr-defined]
    if ratio >= 1:
        return math.inf
    # Until it lands, and then for all bounces from the speed at which it does.
    lands = math.sqrt(max(float(speed) ** 2 + 2 * float(back) * float(gap), 0.0))
    return (float(speed) + lands + 2 * lands * ratio / (1 - ratio)) / float(back)


def _clamped(
    system: HybridSystem, state: HybridState, pose: Pose, indices: Sequence[int], delay: float
) -> tuple[HybridState, list[Strike], float]:
    """Return the state with contacts at rest, the impacts that take their speeds, and the delay."""
    impacts = Impacts(pose, system.elements, float(state.t), system.rounding)
    slides = [index for index in indices if state.sliding[index]]
    strikes = impacts.ended(indices, state.u, slides)
    u, gaps = strikes[-1].u[1], state.gaps
    for index in indices:
        gaps = put(gaps, index, system.number(0))
    still = {
        i
        for i in state.touching
        if not system.elements[i].rigid or _rests(system, pose, i, state.u, u)
    }
    sliding = sliding_after(system, pose, state.u, u)
    touching = frozenset({*indices, *still})
    return replace(state, u=u, gaps=gaps, touching=touching, sliding=sliding), strikes, delay


def _rests(system: HybridSystem, pose: Pose, index: int, before: Pair, u: Pair) -> bool:
    """Return whether the speed along a contact is zero, but for the rounding of what it was."""
    normal = system.elements[index].normal
    assert normal is not None
    return is_left_over(pose.row(normal), u, before, system.rounding)


def _tidied(system: HybridSystem, state: HybridState, mode: Mode) -> HybridState:
    """Return the state in which contacts that a mode lets go are no longer touched.

    A contact that is held off by others is touched still.
    """
    elements = system.elements
    held = [
        coordinate
        for element, own in zip(elements, mode.states, strict=True)
        for coordinate in element.holds(own)
    ]
    leaving = set()
    for index in state.touching:
        normal = elements[index].normal
        if mode.states[index] is not ContactState.OPEN or normal is None:
            continue
        if len(held) < MOST_CONSTRAINTS and not any(same_line(normal, other) for other in held):
            leaving.add(index)
    return replace(state, touching=state.touching - leaving) if leaving else state


# Reactions, one for each kind of event.


def _hits(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A contact is made: a rigid one is placed for its impact, a compliant one begins to press."""
    index = trigger.index
    element, own = system.elements[index], state.compliant[index]
    pose = _place(system, Pose(system.chain, system.formulation, state.q), index, state)
    state = replace(state, q=pose.q, gaps=put(state.gaps, index, system.number(0)))
    assert element.normal is not None
    row = pose.row(element.normal)
    slow = at_rest(row, state.u, system.rounding) or bool(speed_along(row, state.u) >= 0)
    if slow:
        # It is reached without speed.
        state = replace(state, u=stopped(pose, [element.normal], state.u, system.rounding))
    if own is not None:
        return Reaction(press(system, state, pose, index, slow), {})
    if slow:
        sliding = put(state.sliding, index, _sliding_of(system, pose, index, state.u))
        state = replace(state, touching=state.touching | {index}, sliding=sliding)
    return Reaction(state, {})


def press(
    system: HybridSystem, state: HybridState, pose: Pose, index: int, slow: bool
) -> HybridState:
    """Return the state at the beginning of a press on a compliant surface.

    One that is touched without speed starts at the least depth, from where its root can grow.
    """
    element, own = system.elements[index], state.compliant[index]
    assert element.normal is not None
    assert own is not None
    # Two roots that are both zero would stay so.
    slow = slow or any(other is not None and other.sqrt_depth == 0 for other in state.compliant)
    least = system.number(system.rounding**0.5 if slow else 0)
    compliant = put(state.compliant, index, compliant_state.pressed(element, own, least))
    sliding = put(state.sliding, index, _sliding_of(system, pose, index, state.u))
    return replace(
        state, compliant=compliant, touching=state.touching | {index}, sliding=sliding,
        gaps=put(state.gaps, index, system.number(0)),
    )  # fmt: skip


def _sliding_of(system: HybridSystem, pose: Pose, index: int, u: Pair) -> int:
    tangent = system.elements[index].tangent
    return 0 if tangent is None else direction_of(system, pose.row(tangent), u, u)


def _leaves(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A contact no longer pushes: it opens, unless a push would press it on."""
    index = trigger.index
    element, own = system.elements[index], state.compliant[index]
    pose = Pose(system.chain, system.formulation, state.q)
    if own is None:
        if index in jammed(system, state, pose):
            return Reaction(state, {})
        state = replace(state, touching=state.touching - {index})
        state = replace(state, gaps=put(state.gaps, index, system.number(0)))
        return Reaction(state, {index: (ContactState.OPEN,)})
    assert element.normal is not None
    speed = speed_along(pose.row(element.normal), state.u)
    depth = element.bound - own.offset - element.normal.coordinate(system.chain, state.q)
    released = compliant_state.released(element, own, speed, depth)
    state = replace(
        state, touching=state.touching - {index}, gaps=put(state.gaps, index, system.number(0)),
        compliant=put(state.compliant, index, released),
    )  # fmt: skip
    return Reaction(state, {index: (ContactState.OPEN,)})


def _stops(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A slide comes to rest: its speed, and those that the mode holds, become exactly zero."""
    index = trigger.index
    tangent = system.elements[index].tangent
    assert tangent is not None
    pose = Pose(system.chain, system.formulation, state.q)
    if system.elements[index].rigid and locks(system, mode, pose, index):
        return _jams(system, state, mode, Trigger(EventKind.JAMS, index, trigger.sense))
    still = [tangent, *_held(system, mode)]
    return Reaction(_brought_to_rest(system, state, still, trigger.index), {})


def _held(system: HybridSystem, mode: Mode) -> list[Any]:
    return [
        coordinate
        for element, own in zip(system.elements, mode.states, strict=True)
        for coordinate in element.holds(own)
    ]


def _brought_to_rest(
    system: HybridSystem, state: HybridState, still: list[Any], index: int
) -> HybridState:
    """Return the state without speed along some coordinates and without an element's slide."""
    pose = Pose(system.chain, system.formulation, state.q)
    u = stopped(pose, still, state.u, system.rounding)
    if u[0] == 0 and u[1] == 0:
        return replace(state, u=u, sliding=(0,) * len(state.sliding))
    return replace(state, u=u, sliding=put(state.sliding, index, 0))


def _breaks(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A static limit is reached: the element slides, or is saturated where others hold it."""
    sense = trigger.sense
    return Reaction(state, {trigger.index: (slipping(sense), pressed(sense))})


def _jams(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """Friction locks a slide, or no longer does: the mode is selected again.

    With a sense the normal force has grown without bound, and the slide ends in an impact.
    """
    if not trigger.sense:
        return Reaction(state, {})
    pose = Pose(system.chain, system.formulation, state.q)
    impacts = Impacts(pose, system.elements, float(state.t), system.rounding)
    strike = impacts.locked(trigger.index, state.u, trigger.sense)
    after = strike.u[1]
    sliding = put(sliding_after(system, pose, state.u, after), trigger.index, 0)
    return Reaction(replace(state, u=after, sliding=sliding), {}, (strike,))


def _reaches(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A branch of a force law ends: the force may jump, and an element that sticks may slide."""
    return Reaction(_with(system, state, trigger.index, compliant_state.reached), {})


def _turns(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """Compression turns into restitution, or back.

    Where the mode holds the chain in another direction, all of it is at rest at this instant.
    """
    index = trigger.index
    state = _with(system, state, index, compliant_state.turned)
    normal = system.elements[index].normal
    assert normal is not None
    still = [normal, *_held(system, mode)]
    pose = Pose(system.chain, system.formulation, state.q)
    rows = [pose.row(coordinate) for coordinate in still]
    if all(parallel(rows[0], row) for row in rows[1:]):
        return Reaction(state, _as_before(mode))
    return Reaction(_brought_to_rest(system, state, still, index), {})


def _clears(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A dent is left behind: its surface is whole again."""
    own = state.compliant[trigger.index]
    assert own is not None
    state = replace(
        state, compliant=put(state.compliant, trigger.index, compliant_state.cleared(own)),
        gaps=put(state.gaps, trigger.index, system.number(0)),
    )  # fmt: skip
    return Reaction(state, _as_before(mode))


def _with(
    system: HybridSystem, state: HybridState, index: int, change: Callable[..., Any]
) -> HybridState:
    """Return the state after a change of a compliant surface."""
    own = change(system.elements[index], state.compliant[index])
    return replace(state, compliant=put(state.compliant, index, own))


def _as_before(mode: Mode) -> dict[int, States]:
    """Return the restriction of all elements to the states that they have."""
    return {index: (state,) for index, state in enumerate(mode.states)}


_REACTIONS: dict[EventKind, Callable[[HybridSystem, HybridState, Mode, Trigger], Reaction]] = {
    EventKind.HITS: _hits,
    EventKind.LEAVES: _leaves,
    EventKind.STOPS: _stops,
    EventKind.BREAKS: _breaks,
    EventKind.JAMS: _jams,
    EventKind.REACHES: _reaches,
    EventKind.TURNS: _turns,
    EventKind.CLEARS: _clears,
}
