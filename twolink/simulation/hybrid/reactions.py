"""The reactions to events, one for each kind, in a table.

A reaction gives the state immediately after an event, and may restrict the states of some elements.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from twolink.arithmetic import Pair
from twolink.contact.coordinates import ConstraintCoordinate
from twolink.contact.states import ContactState, EventKind, pressed, slipping
from twolink.errors import IntegrationError
from twolink.simulation.hybrid import compliant_state, tolerances
from twolink.simulation.hybrid.collision import nearby, place, sliding_after, sliding_of
from twolink.simulation.hybrid.complementarity import States, coincide, is_at_rest
from twolink.simulation.hybrid.constraint import parallel, same_line
from twolink.simulation.hybrid.dynamics import is_fixed
from twolink.simulation.hybrid.impact import (
    Impacts,
    Strike,
    approach,
    is_left_over,
    largest,
    moves,
    speed_along,
    stopped,
)
from twolink.simulation.hybrid.mode import Mode, Trigger
from twolink.simulation.hybrid.noise import known_at
from twolink.simulation.hybrid.painleve import jammed
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem


class Reaction(NamedTuple):
    """The state immediately after an event, and the states to which elements are restricted."""

    state: HybridState
    known: Mapping[int, States]
    strikes: tuple[Strike, ...] = ()


def _hits(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A gap closes: a rigid contact has an impact, compliant ones begin to press."""
    index = trigger.index
    state = _out_of_dents(system, state)
    if state.compliant[index] is not None:
        for number in _met_with(system, state, index):
            state, pose, slow = _met(system, state, number)
            state = press(system, state, pose, number, slow)
        return Reaction(state, {})
    element = system.elements[index]
    assert element.normal is not None
    state = state.with_gap(index, system.number(0))
    if approach(
        system.pose(state.q).row(element.normal), state.u, system.rounding, system.scales.lever
    ):
        return Reaction(state, {})
    state, pose, _ = _met(system, state, index)
    # Other points at this place touch with it.
    alike = _touched_with(system, state, pose, element.normal)
    for number in alike | {index}:
        sliding = put(state.sliding, number, sliding_of(system, pose, number, state.u))
        state = state._replace(touching=state.touching | {number}, sliding=sliding)
    return Reaction(state, {})


def _touched_with(
    system: HybridSystem, state: HybridState, pose: Pose, normal: ConstraintCoordinate
) -> set[int]:
    """Return the contacts nearby that are at rest on the line of one that is touched without speed.

    Where the row of that one vanishes, others on its line may move.
    """
    found = set()
    for index in nearby(system, state):
        other = system.elements[index].normal
        assert other is not None
        alike = same_line(other, normal, system.scene_chain)
        if alike and not moves(pose.row(other), state.u, system.rounding, system.scales.slowest):
            found.add(index)
    return found


def _out_of_dents(system: HybridSystem, state: HybridState) -> HybridState:
    """Return the state in which points at the edges of their dents have left them.

    A point that an impact stops or turns back at the edge, within round-off, has left its dent in
    any run, as if it had reached the edge before the impact.
    """
    if not any(state.compliant):
        return state
    pose = system.pose(state.q)
    for number, (own, gap) in enumerate(zip(state.compliant, state.gaps, strict=True)):
        dent = None if own is None or number in state.touching else own.plastic
        if dent is None or not dent.is_kept:
            continue
        normal = system.elements[number].normal
        assert normal is not None
        x, y = pose.row(normal)
        at_edge = abs(gap - dent.residual) <= system.scales.places_of_rounding[number]
        if at_edge and approach((-x, -y), state.u, system.rounding, system.scales.lever):
            state = _cleared(system, state, number)
    return state


def _met_with(system: HybridSystem, state: HybridState, index: int) -> Iterator[int]:
    """Yield a compliant surface that is met, and those met at the same instant.

    While a press begins, time hardly grows with its own variable, so that a gap that closes at the
    same instant would seem to stay zero.
    """
    yield index
    pose = system.pose(state.q)
    for number, (own, gap) in enumerate(zip(state.compliant, state.gaps, strict=True)):
        normal = system.elements[number].normal
        if own is None or gap is None or normal is None or number in state.touching:
            continue
        met = number != index and abs(gap) <= system.scales.places_of_rounding[number]
        if met and approach(pose.row(normal), state.u, system.rounding, system.scales.lever):
            yield number


def _met(system: HybridSystem, state: HybridState, index: int) -> tuple[HybridState, Pose, bool]:
    """Return the state in which a gap is zero, its pose, and whether it is met without speed.

    A speed below the round-off of u counts as zero, as √depth would hardly grow with it.
    """
    normal = system.elements[index].normal
    assert normal is not None
    state = state.with_gap(index, system.number(0))
    pose = system.pose(state.q)
    row, u = pose.row(normal), state.u
    slow = not approach(row, u, system.rounding, system.scales.lever)
    slow = slow or is_left_over(row, u, u, system.rounding)
    state, pose = place(system, state, pose, index)
    if slow:
        state = state._replace(u=stopped(pose, [normal], state.u, system.rounding))
    return state, pose, slow


def press(
    system: HybridSystem, state: HybridState, pose: Pose, index: int, slow: bool
) -> HybridState:
    """Return the state at the beginning of a press on a compliant surface.

    A press without speed starts at the least depth, from which √depth can grow.
    """
    element, own = system.elements[index], state.compliant[index]
    assert element.normal is not None
    assert own is not None
    # Two values of √depth that are both zero would remain zero.
    slow = slow or any(other is not None and other.sqrt_depth == 0 for other in state.compliant)
    least = system.scales.least_root(index) if slow else system.number(0)
    compliant = put(state.compliant, index, compliant_state.pressed(element, own, least))
    sliding = put(state.sliding, index, sliding_of(system, pose, index, state.u))
    return state._replace(
        compliant=compliant, touching=state.touching | {index}, sliding=sliding,
        gaps=put(state.gaps, index, system.number(0)),
    )  # fmt: skip


def _leaves(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A normal force vanishes: the contact opens, unless it is jammed or wedged."""
    index = trigger.index
    pose = system.pose(state.q)
    if state.compliant[index] is None:
        if index in jammed(system, state, pose):
            return Reaction(state, {})
        return _opened(system, state, mode, index)
    for number in _left_with(system, state, pose, index):
        state = _released(system, state, pose, number)
    return Reaction(state, {index: (ContactState.OPEN,)})


def _opened(system: HybridSystem, state: HybridState, mode: Mode, index: int) -> Reaction:
    """Return the state after a rigid contact, and others in one place with it, have no force left.

    A point at rest may stay there, where other forces hold it, and the contact still touches:
    friction that does not slide may wedge the chain against it, or the loads may press it again.
    """
    element, own, chain = system.elements[index], mode.states[index], system.scene_chain
    stays = is_at_rest(system, state) or _may_be_held(system, mode, index)
    if own is not ContactState.STICKS and stays:
        return Reaction(state, {index: tuple(x for x in element.options(True, 0) if x is not own)})
    together = {i for i in state.touching if coincide(system.elements[i], element, chain)}
    gaps = tuple(system.number(0) if i in together else gap for i, gap in enumerate(state.gaps))
    state = state._replace(touching=state.touching - together, gaps=gaps)
    return Reaction(state, {index: (ContactState.OPEN,)})


def _may_be_held(system: HybridSystem, mode: Mode, index: int) -> bool:
    """Return whether friction at rest may hold the point of a contact that opens where it is."""
    elements, normal = system.elements, system.elements[index].normal
    assert normal is not None
    held = [
        coordinate
        for number, (element, own) in enumerate(zip(elements, mode.states, strict=True))
        if number != index and (own is ContactState.STICKS or own.pressed)
        for coordinate in element.holds(ContactState.STICKS)
    ]
    return is_fixed(normal, held, system.scene_chain)


def _left_with(system: HybridSystem, state: HybridState, pose: Pose, index: int) -> Iterator[int]:
    """Yield a compliant surface that is left, and those left at the same instant.

    A surface that does not push beyond round-off is left unless its point approaches it. If √depth
    stayed at zero, time, which grows in proportion to it while a surface is pressed, would stand
    still.
    """
    yield index
    for number in sorted(state.touching - {index}):
        normal = system.elements[number].normal
        if normal is None or state.compliant[number] is None:
            continue
        away = not approach(pose.row(normal), state.u, system.rounding, system.scales.lever)
        small = system.scales.places_of_rounding[number]
        if away and _depth_of_force(system, state, pose, number) <= small:
            yield number


def _depth_of_force(system: HybridSystem, state: HybridState, pose: Pose, index: int) -> Any:
    """Return the depth (m) of a pressed surface beyond that at which it does not push."""
    element, own = system.elements[index], state.compliant[index]
    assert element.compliant is not None
    assert element.normal is not None
    assert own is not None
    if own.sqrt_depth is not None:
        return own.sqrt_depth * own.sqrt_depth
    depth = element.bound - own.offset - element.normal.coordinate(system.chain, state.q)
    rate = element.compliant.relaxation
    return depth if rate is None else depth - speed_along(pose.row(element.normal), state.u) / rate


def _released(system: HybridSystem, state: HybridState, pose: Pose, index: int) -> HybridState:
    """Return the state after a point has separated from a compliant surface."""
    element, own = system.elements[index], state.compliant[index]
    assert element.normal is not None
    assert own is not None
    speed = speed_along(pose.row(element.normal), state.u)
    depth = element.bound - own.offset - element.normal.coordinate(system.chain, state.q)
    small = system.scales.places_of_rounding[index]
    released = compliant_state.released(element, own, speed, depth, small)
    return state._replace(
        touching=state.touching - {index}, gaps=put(state.gaps, index, system.number(0)),
        compliant=put(state.compliant, index, released),
    )  # fmt: skip


def _stops(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A slide comes to rest: its speed, and those that the mode holds, become exactly zero."""
    index = trigger.index
    tangent = system.elements[index].tangent
    assert tangent is not None
    still = [tangent, *system.held(mode.states)]
    return Reaction(_brought_to_rest(system, state, still, trigger.index), {})


def _brought_to_rest(
    system: HybridSystem, state: HybridState, still: list[Any], index: int
) -> HybridState:
    """Return the state with zero speed along some coordinates and a stopped slide of an element.

    Other slides along the same line stop with it, except those of a point of link 1 in a singular
    pose while the link turns.
    """
    pose = system.pose(state.q)
    u = stopped(pose, still, state.u, system.rounding, system.scales.slowest)
    _check_round_off(system, state, u, index)
    if u[0] == 0 and u[1] == 0:
        return state._replace(u=u, sliding=(0,) * len(state.sliding))
    tangent, chain = system.elements[index].tangent, system.scene_chain
    assert tangent is not None
    sliding = tuple(
        0
        if element.tangent is not None
        and same_line(element.tangent, tangent, chain)
        and not moves(pose.row(element.tangent), u, system.rounding, system.scales.slowest)
        else direction
        for element, direction in zip(system.elements, state.sliding, strict=True)
    )
    return state._replace(u=u, sliding=put(sliding, index, 0))


def _check_round_off(system: HybridSystem, state: HybridState, u: Pair, index: int) -> None:
    """Raise `IntegrationError` if a slide takes more than round-off from the speeds as it stops."""
    change = float(largest((u[0] - state.u[0], u[1] - state.u[1])))
    if change * system.longest_step > tolerances.MOST_STOPPED:
        raise IntegrationError(
            f"at {float(state.t):.9g} s {system.names[index]} comes to rest, and round-off does "
            f"not decide whether the links do: they turn at {change:.2g} rad/s"
        )


def _breaks(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A static limit is reached: the element slides, or is saturated if other elements hold it.

    Where frictions are saturated already, the shares of the forces are not unique, and so neither
    is the element that reaches its limit: any element at rest may slide.
    """
    sense = trigger.sense
    if any(own.pressed for own in mode.states):
        return Reaction(state, {})
    return Reaction(state, {trigger.index: (slipping(sense), pressed(sense))})


def _jams(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A slide jams or no longer does: the mode is selected again.

    With a sense, the normal force has grown without bound and the slide ends in an impact.
    """
    if not trigger.sense:
        return Reaction(state, {})
    pose = system.pose(state.q)
    impacts = Impacts(pose, system.elements, float(state.t), system.rounding)
    strike = impacts.locked(trigger.index, state.u, trigger.sense)
    if not impacts.stops(strike):
        raise IntegrationError(
            f"at {float(state.t):.9g} s the slide of {system.names[trigger.index]} jams, and no "
            "impulse of its friction stops the links"
        )
    after = strike.u[1]
    sliding = sliding_after(system, pose, state.u, after, known_at(state.t, system.rounding))
    sliding = put(sliding, trigger.index, 0)
    return Reaction(state._replace(u=after, sliding=sliding), {}, (strike,))


def _reaches(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """A branch of a force law ends: the force may jump, and an element that sticks may slide."""
    return Reaction(_with(system, state, trigger.index, compliant_state.reached), {})


def _turns(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """Compression turns into restitution, or back; or a law no longer pushes, or does so again.

    If the mode holds the chain in another direction, the chain is at rest at this instant.
    """
    index = trigger.index
    turns_at = system.elements[index].branch(mode.dent(index)).rate
    state = _with(system, state, index, compliant_state.turned)
    if turns_at:
        # The law would pull: the point keeps moving.
        return Reaction(state, _as_before(mode))
    normal = system.elements[index].normal
    assert normal is not None
    still = [normal, *system.held(mode.states)]
    pose = system.pose(state.q)
    rows = [pose.row(coordinate) for coordinate in still]
    if all(parallel(rows[0], row, pose.lever) for row in rows[1:]):
        return Reaction(state, _as_before(mode))
    return Reaction(_brought_to_rest(system, state, still, index), {})


def _clears(system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger) -> Reaction:
    """The point leaves a plastic indentation: the surface is as undeformed again."""
    return Reaction(_cleared(system, state, trigger.index), _as_before(mode))


def _cleared(system: HybridSystem, state: HybridState, index: int) -> HybridState:
    """Return the state in which a point has left its dent."""
    own = state.compliant[index]
    assert own is not None
    return state._replace(
        compliant=put(state.compliant, index, compliant_state.cleared(own)),
        gaps=put(state.gaps, index, system.number(0)),
    )  # fmt: skip


def _with(
    system: HybridSystem, state: HybridState, index: int, change: Callable[..., Any]
) -> HybridState:
    """Return the state after a change of a compliant surface."""
    own = change(system.elements[index], state.compliant[index])
    return state._replace(compliant=put(state.compliant, index, own))


def _as_before(mode: Mode) -> dict[int, States]:
    """Return the restriction of all elements to their present states."""
    return {index: (state,) for index, state in enumerate(mode.states)}


REACTIONS: dict[EventKind, Callable[[HybridSystem, HybridState, Mode, Trigger], Reaction]] = {
    EventKind.HITS: _hits,
    EventKind.LEAVES: _leaves,
    EventKind.STOPS: _stops,
    EventKind.BREAKS: _breaks,
    EventKind.JAMS: _jams,
    EventKind.REACHES: _reaches,
    EventKind.TURNS: _turns,
    EventKind.CLEARS: _clears,
}
