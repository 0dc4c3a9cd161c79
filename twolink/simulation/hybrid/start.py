"""The initial hybrid state: touching contacts and pressed surfaces."""

from __future__ import annotations

from typing import Any

from twolink.contact.coordinates import JointCoordinate
from twolink.contact.elements import ContactElement
from twolink.errors import IntegrationError, SimulationError
from twolink.integration.precisions import PRECISIONS
from twolink.scene import Scene
from twolink.simulation.hybrid import compliant_state, tolerances
from twolink.simulation.hybrid.constraint import parallel
from twolink.simulation.hybrid.impact import (
    at_rest,
    is_left_over,
    largest,
    placed,
    speed_along,
    stopped,
)
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.reactions import press
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import NO_LEVER

# A start is given in float64.
_ROUNDING = PRECISIONS["double"].rounding

# From the round-off of float64 to that of every precision.
_NEWTON_STEPS = 2


def start_state(system: HybridSystem, scene: Scene) -> HybridState:
    """Return the initial state of a scene, before any impact.

    A start is given in float64, and lies on a contact within round-off of it. In every precision it
    is the state exactly on all contacts that are touched; depths and gaps are those of this state.
    `doubts_of_start` says how far the state is from the scene.
    Raises `SimulationError` if a point starts inside a rigid contact.
    """
    number = system.number
    u = number(scene.u[0]), number(scene.u[1])
    given = _given_pose(system, scene)
    pose, near = _touched_pose(system, given)
    sliding = tuple(_sliding(given, element, u) for element in system.elements)
    state = HybridState(
        t=number(0),
        q=pose.q,
        u=u,
        gaps=tuple(
            number(0) if index in near else _gap(system, element, pose.q)
            for index, element in enumerate(system.elements)
        ),
        touching=frozenset(),
        sliding=sliding,
        compliant=tuple(compliant_state.undisturbed(element) for element in system.elements),
    )
    for index, element in enumerate(system.elements):
        if index in near:
            state = _touched(system, state, pose, index)
        elif element.normal is not None and state.gaps[index] < 0:  # type: ignore[operator]
            try:
                state = _pressed_in(system, state, index, -state.gaps[index])  # type: ignore[operator]
            except IntegrationError as error:
                # A start beyond the range of a law is refused.
                raise SimulationError(str(error)) from error
    # Elements along one line slide or rest together: all of them by the rounding of float64, while
    # `press` has decided by that of the system.
    return _at_rest_on_contacts(system, state._replace(sliding=sliding), pose)


def through_start(system: HybridSystem, scene: Scene) -> HybridSystem:
    """Return the system whose contacts that a scene touches pass through its pose as it is given.

    They are moved by roundings of a place, instead of the chain.
    """
    given = _given_pose(system, scene)
    _, near = _touched_pose(system, given)
    places = [
        element.normal.coordinate(system.chain, given.q) if index in near else element.bound
        for index, element in enumerate(system.elements)
        if element.normal is not None
    ]
    return system.moved_to(places)


def _given_pose(system: HybridSystem, scene: Scene) -> Pose:
    return system.pose((system.number(scene.q[0]), system.number(scene.q[1])))


def _touched_pose(system: HybridSystem, given: Pose) -> tuple[Pose, list[int]]:
    """Return the pose exactly on the contacts that a given one touches, and their numbers."""
    near = _touching(system, given)
    pose = _placed(system, given, near)
    # Near a singular pose this closes rigid contacts that are open by little more than round-off.
    closed = [i for i, e in enumerate(system.elements) if e.rigid and _closed(system, e, pose.q)]
    return pose, list(dict.fromkeys([*near, *closed]))


def sense_along(pose: Pose, element: ContactElement, u: Any) -> int:
    """Return the sign of the speed along an element's tangent, however slow, 0 without one."""
    speed = 0 if element.tangent is None else speed_along(pose.row(element.tangent), u)
    return 0 if speed == 0 else 1 if speed > 0 else -1


def _touching(system: HybridSystem, pose: Pose) -> list[int]:
    """Return the contacts that a pose given in float64 touches."""
    found = []
    for index, element in enumerate(system.elements):
        gap = _gap(system, element, pose.q)
        if gap is None:
            continue
        rounding = _ROUNDING * system.scales.sizes[index]
        if abs(gap) <= tolerances.CONTACT_GAP * rounding:
            if gap <= max(tolerances.ROUNDED_PLACE * rounding, _rounded_place(pose, element)):
                found.append(index)
        elif gap < 0 and element.rigid:
            unit = "rad" if isinstance(element.normal, JointCoordinate) else "m"
            raise SimulationError(
                f"{element.name}: the scene must start outside or in contact; got a start"
                f" {-float(gap):.6g} {unit} inside"
            )
    return found


def _rounded_place(pose: Pose, element: ContactElement) -> Any:
    """Return the change of a coordinate (rad or m) by roundings of float64 of large angles."""
    row = pose.row(element.normal)  # type: ignore[arg-type]
    return _ROUNDING * largest(pose.q) * (abs(row[0]) + abs(row[1]))


def _closed(system: HybridSystem, element: ContactElement, q: Any) -> bool:
    """Return whether the gap of an element is negative."""
    gap = _gap(system, element, q)
    return gap is not None and bool(gap < 0)


def _at_rest_on_contacts(system: HybridSystem, state: HybridState, pose: Pose) -> HybridState:
    """Return the state without normal speed at the rigid contacts that it rests on.

    Round-off of float64 is a speed in longer precisions.
    """
    held = [i for i in sorted(state.touching) if system.elements[i].rigid]
    normals = [system.elements[index].normal for index in held]
    u = stopped(pose, normals, state.u, _ROUNDING)  # type: ignore[arg-type]
    change = largest((u[0] - state.u[0], u[1] - state.u[1]))
    if change > tolerances.UNDECIDED * _ROUNDING * largest(state.u):
        # Along two nearly parallel normals, a speed of round-off is no state of rest.
        return state
    return state._replace(u=u)


def _placed(system: HybridSystem, pose: Pose, near: list[int]) -> Pose:
    """Return the pose in which the gaps of contacts are zero: of two that determine it, or of one.

    The rigid ones are first. The pose stays where a gap of round-off would move it by more, near a
    singular pose.
    """
    # Along a row of zeros no point moves.
    able = [
        index
        for index in near
        if largest(pose.row(system.elements[index].normal)) > NO_LEVER * pose.lever  # type: ignore[arg-type]
    ]
    if not able:
        return pose
    first, *others = sorted(able, key=lambda index: not system.elements[index].rigid)
    element = system.elements[first]
    assert element.normal is not None
    row = pose.row(element.normal)
    for index in others:
        other = system.elements[index]
        if not parallel(row, pose.row(other.normal), system.scales.lever):  # type: ignore[arg-type]
            both = _on_both(system, pose, element, other)
            if both is not None:
                return both
    known = max(system.scales.resolution, _ROUNDING)
    return system.pose(placed(pose, element.normal, element.bound, known, system.rounding))


def _on_both(
    system: HybridSystem, pose: Pose, first: ContactElement, second: ContactElement
) -> Pose | None:
    """Return the pose in which the gaps of two contacts are zero, None if it is far."""
    for _ in range(_NEWTON_STEPS):
        (x1, y1), (x2, y2) = (pose.row(e.normal) for e in (first, second))  # type: ignore[arg-type]
        one, two = (_gap(system, element, pose.q) for element in (first, second))
        across = x1 * y2 - x2 * y1
        dq = (one * y2 - two * y1) / across, (two * x1 - one * x2) / across
        if largest(dq) > tolerances.UNDECIDED * _ROUNDING * max(1, largest(pose.q)):
            return None
        pose = system.pose((pose.q[0] - dq[0], pose.q[1] - dq[1]))
    return pose


def _gap(system: HybridSystem, element: ContactElement, q: Any) -> Any:
    if element.normal is None:
        return None
    return element.normal.coordinate(system.chain, q) - element.bound


def _touched(system: HybridSystem, state: HybridState, pose: Pose, index: int) -> HybridState:
    """Return the state in which a contact without a gap is touched or pressed, if it is.

    At a surface that it cannot get beyond, the point has neither a force nor an impact.
    """
    element = system.elements[index]
    assert element.normal is not None
    if not element.reachable:
        return state
    row = pose.row(element.normal)
    still = is_left_over(row, state.u, state.u, _ROUNDING)
    recedes = not still and speed_along(row, state.u) > 0
    if recedes or (element.rigid and not still):
        return state
    if not element.rigid:
        return press(system, state, pose, index, still)
    return state._replace(touching=state.touching | {index})


def _sliding(pose: Pose, element: ContactElement, u: Any) -> int:
    """Return the direction in which an element slides at the start, given in float64."""
    if element.tangent is None:
        return 0
    first, second = (x * own for x, own in zip(pose.row(element.tangent), u, strict=True))
    known = tolerances.ROUNDED_PLACE * _ROUNDING * (abs(first) + abs(second))
    return 0 if abs(first + second) <= known else sense_along(pose, element, u)


def _pressed_in(system: HybridSystem, state: HybridState, index: int, depth: Any) -> HybridState:
    """Return the state of a scene that starts pressed into a compliant surface, to a depth (m)."""
    element, own = system.elements[index], state.compliant[index]
    assert element.normal is not None
    assert own is not None
    pressed = compliant_state.pressed_at(element, own, depth)
    row = system.pose(state.q).row(element.normal)
    rate = (
        0 * depth
        if at_rest(row, state.u, _ROUNDING, system.scales.lever)
        else -speed_along(row, state.u)
    )
    branch = element.branch(pressed.plastic)
    force = branch.law.force(depth, pressed.sqrt_depth or 0, rate)
    gaps = put(state.gaps, index, system.number(0))
    if branch.turning * (rate - branch.rate) < 0:
        # The branch has ended at this rate: a point that moves out, or faster than the law pushes.
        pressed = compliant_state.turned(element, pressed)
    elif force < 0:
        # The point moves out faster than the surface recovers.
        pressed = compliant_state.overtaken(element, pressed, depth)
        return state._replace(compliant=put(state.compliant, index, pressed), gaps=gaps)
    return state._replace(
        compliant=put(state.compliant, index, pressed), gaps=gaps,
        touching=state.touching | {index},
    )  # fmt: skip
