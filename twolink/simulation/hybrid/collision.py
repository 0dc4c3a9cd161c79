"""Collision: the state after the impacts of all contacts with a negative normal speed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from twolink.arithmetic import Pair, sqrt
from twolink.contact.coordinates import ConstraintCoordinate
from twolink.contact.states import EventKind
from twolink.errors import IntegrationError
from twolink.simulation.hybrid import compliant_state
from twolink.simulation.hybrid.constraint import same_line
from twolink.simulation.hybrid.impact import (
    Impacts,
    Strike,
    approach,
    at_rest,
    is_left_over,
    largest,
    placed,
    speed_along,
)
from twolink.simulation.hybrid.impact_order import choices
from twolink.simulation.hybrid.mode import Doubt, Remark, Trigger, doubt_of_change
from twolink.simulation.hybrid.noise import known_at
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.resolution import Resolution, resolve
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import SAME_INSTANT


def nearby(system: HybridSystem, state: HybridState) -> list[int]:
    """Return the rigid contacts whose gap is zero within round-off."""
    found, gaps = [], state.gaps
    for index, near in system.scales.near:
        gap = gaps[index]
        if gap is not None and abs(gap) <= near:
            found.append(index)
    return found


def closed(system: HybridSystem, state: HybridState, pose: Pose) -> list[int]:
    """Return the rigid contacts that are touched or struck at this instant, and their neighbours.

    A gap is a variable that keeps its relative accuracy: a contact that is approached, and not
    closed yet, is struck now only if it closes within the rounding of the time, and at its own
    instant otherwise. Points that move along the line of such a contact are closed with it, within
    the rounding of a place.
    """
    near = nearby(system, state)
    found = [i for i in near if i in state.touching or _closes_now(system, state, pose, i)]
    if not 0 < len(found) < len(near):
        return found
    lines = [system.elements[index].normal for index in found]
    return [i for i in near if i in found or _is_along(system, system.elements[i].normal, lines)]


def _closes_now(system: HybridSystem, state: HybridState, pose: Pose, index: int) -> bool:
    """Return whether a gap is closed, or closes within the rounding of the time."""
    gap, normal = state.gaps[index], system.elements[index].normal
    assert gap is not None
    assert normal is not None
    if gap <= 0:
        return True
    speed = approach(
        pose.row(normal), state.u, known_at(state.t, system.rounding), system.scales.lever
    )
    instant = SAME_INSTANT * system.rounding * max(float(state.t), system.longest_step)
    return bool(gap <= -instant * speed)


def _is_along(
    system: HybridSystem,
    normal: ConstraintCoordinate | None,
    lines: Sequence[ConstraintCoordinate | None],
) -> bool:
    """Return whether a coordinate changes in proportion to one of others, in every pose."""
    return any(same_line(normal, line, system.scene_chain) for line in lines)  # type: ignore[arg-type]


def touched_names(system: HybridSystem, state: HybridState) -> str:
    """Return the names of the touching contacts, for a message."""
    return ", ".join(system.names[i] for i in sorted(state.touching)) or "none"


class Collision(NamedTuple):
    """The state and its pose after impacts, the impacts, and what their order left open."""

    state: HybridState
    pose: Pose
    strikes: tuple[Strike, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[Remark, ...] = ()


def collide(system: HybridSystem, state: HybridState, pose: Pose) -> Collision:
    """Return the state after the impacts of all approached contacts, and the impacts."""
    near, known = closed(system, state, pose), known_at(state.t, system.rounding)
    if not _any_approached(system, state, pose, near, known):
        return Collision(state, pose)
    for index in near:
        state, pose = place(system, state, pose, index)
    impacts = Impacts(pose, system.elements, float(state.t), known)
    found = resolve(impacts, state.u, near, state.touching)
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[Remark, ...] = ()
    if len(system.scales.near) > 1 and found.strikes:
        doubts, notes = choices(system, state, impacts, near, found)
    if known > system.rounding:
        doubts += _doubts_of_float64(system, state, pose, near, found)
    touching, gaps = found.resting, state.gaps
    if state.touching:
        touching |= {i for i in state.touching if not system.elements[i].rigid}
    for index in near:
        # A gap that has just closed is zero.
        if gaps[index] != 0:
            gaps = put(gaps, index, system.number(0))
    sliding = sliding_after(system, pose, state.u, found.u, known)
    state = HybridState(state.t, pose.q, found.u, gaps, touching, sliding, state.compliant)
    if any(state.compliant):
        state = surfaces_after(system, state, pose)
    return Collision(state, pose, found.strikes, doubts, notes)


def _doubts_of_float64(
    system: HybridSystem, state: HybridState, pose: Pose, near: Sequence[int], found: Resolution
) -> tuple[Doubt, ...]:
    """Return the doubt on u, which differs if impacts have the rounding of the precision."""
    impacts = Impacts(pose, system.elements, float(state.t), system.rounding)
    try:
        finer = resolve(impacts, state.u, near, state.touching)
    except IntegrationError:
        change = math.inf
    else:
        change = float(largest((found.u[0] - finer.u[0], found.u[1] - finer.u[1])))
    trigger = Trigger(EventKind.HITS, near[0])
    return (doubt_of_change(float(state.t), trigger, change),) if change else ()


def _any_approached(
    system: HybridSystem, state: HybridState, pose: Pose, contacts: Sequence[int], rounding: float
) -> bool:
    """Return whether a contact is approached that does not touch already.

    `rounding` is that of the speeds.
    """
    for index in contacts:
        normal = system.elements[index].normal
        if index in state.touching or normal is None:
            continue
        if approach(pose.row(normal), state.u, rounding, system.scales.lever):
            return True
    return False


def surfaces_after(system: HybridSystem, state: HybridState, pose: Pose) -> HybridState:
    """Return the state in which compliant surfaces have the phase that follows from the speed.

    Impulses on other contacts change the speed of penetration: a press that has just begun
    continues, starts at rest, or ends, and compression may turn into restitution, or back.
    """
    if not any(state.compliant):
        return state
    for index, own in enumerate(state.compliant):
        if own is None or index not in state.touching:
            continue
        if own.sqrt_depth is not None and own.sqrt_depth == 0:
            state = _begun(system, state, pose, index)
        elif _turns(system, state, pose, index):
            after = compliant_state.turned(system.elements[index], own)
            state = state._replace(compliant=put(state.compliant, index, after))
    return state


def _begun(system: HybridSystem, state: HybridState, pose: Pose, index: int) -> HybridState:
    """Return the state in which a press that has just begun continues, starts at rest, or ends."""
    own, normal = state.compliant[index], system.elements[index].normal
    assert own is not None
    assert normal is not None
    row = pose.row(normal)
    if at_rest(row, state.u, known_at(state.t, system.rounding), system.scales.lever):
        begun = own._replace(sqrt_depth=system.scales.least_root(index))
        return state._replace(compliant=put(state.compliant, index, begun))
    if speed_along(row, state.u) < 0:
        return state
    ended = own._replace(sqrt_depth=None)
    return state._replace(
        compliant=put(state.compliant, index, ended), touching=state.touching - {index}
    )


def _turns(system: HybridSystem, state: HybridState, pose: Pose, index: int) -> bool:
    """Return whether the rate of the depth is beyond the end of the branch of the law."""
    element, own = system.elements[index], state.compliant[index]
    assert own is not None
    assert element.normal is not None
    branch = element.branch(own.plastic)
    if not branch.turning:
        return False
    row = pose.row(element.normal)
    still = at_rest(row, state.u, known_at(state.t, system.rounding), system.scales.lever)
    speed = 0 if still else speed_along(row, state.u)
    return bool(branch.turning * (speed + branch.rate) > 0)


def place(
    system: HybridSystem, state: HybridState, pose: Pose, index: int
) -> tuple[HybridState, Pose]:
    """Return the state and its pose in which the gap of a contact is exactly zero.

    The gaps and depths of the other contacts, which are variables of their own, change with q.
    Otherwise contacts that take turns could each undo the placing of the other, ever farther.
    """
    element, own = system.elements[index], state.compliant[index]
    assert element.normal is not None
    surface = element.bound - (own.offset if own is not None else 0)
    known = known_at(state.t, system.scales.resolution)
    q = placed(pose, element.normal, surface, known, system.rounding)
    if q == pose.q:
        return state, pose
    return _moved(system, state, pose, q), system.pose(q)


def _moved(system: HybridSystem, state: HybridState, pose: Pose, q: Pair) -> HybridState:
    """Return the state that is moved to angles q (rad) nearby, with its gaps and depths there.

    Those within the round-off of a place, or of the change, are more accurate than q, and stay.
    """
    change = q[0] - pose.q[0], q[1] - pose.q[1]
    gaps, compliant = list(state.gaps), list(state.compliant)
    for index, (gap, own) in enumerate(zip(state.gaps, state.compliant, strict=True)):
        normal = system.elements[index].normal
        if gap is None or normal is None:
            continue
        rise = speed_along(pose.row(normal), change)
        small = max(system.scales.places_of_rounding[index], 2 * abs(rise))
        if abs(gap) > small:
            gaps[index] = gap + rise
        if own is None or own.sqrt_depth is None:
            continue
        depth = own.sqrt_depth * own.sqrt_depth
        if depth > small:
            compliant[index] = own._replace(sqrt_depth=sqrt(depth - rise))
    return HybridState(
        state.t, q, state.u, tuple(gaps), state.touching, state.sliding, tuple(compliant)
    )


def sliding_after(
    system: HybridSystem, pose: Pose, before: Pair, u: Pair, rounding: float
) -> tuple[int, ...]:
    """Return the direction in which each element slides at u, after the speeds were `before`.

    `rounding` is that of the speeds.
    """
    return tuple(
        [
            0 if tangent is None else direction_of(system, pose.row(tangent), before, u, rounding)
            for tangent in system.tangents
        ]
    )


def still_sliding(system: HybridSystem, state: HybridState, pose: Pose) -> tuple[int, ...]:
    """Return the direction in which each element slides that has a speed, 0 for all others."""
    rounding = known_at(state.t, system.rounding)
    directions = sliding_after(system, pose, state.u, state.u, rounding)
    return tuple([own and now for own, now in zip(state.sliding, directions, strict=True)])


def direction_of(system: HybridSystem, row: Pair, before: Pair, u: Pair, rounding: float) -> int:
    """Return the sign of row · u, 0 within the rounding of the speeds and of the pose."""
    if at_rest(row, u, rounding, system.scales.lever) or is_left_over(row, u, before, rounding):
        return 0
    return 1 if speed_along(row, u) > 0 else -1


def sliding_of(system: HybridSystem, pose: Pose, index: int, u: Pair) -> int:
    """Return the direction in which an element slides at u, 0 for none."""
    tangent = system.elements[index].tangent
    return 0 if tangent is None else direction_of(system, pose.row(tangent), u, u, system.rounding)
