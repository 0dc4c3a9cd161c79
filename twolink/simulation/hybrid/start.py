"""The initial hybrid state: touching contacts and pressed surfaces."""

from __future__ import annotations

from typing import Any

from twolink.contact.elements import ContactElement
from twolink.errors import SimulationError
from twolink.integration.precisions import PRECISIONS
from twolink.scene import Scene
from twolink.simulation.hybrid import compliant_state, tolerances
from twolink.simulation.hybrid.collision import place
from twolink.simulation.hybrid.constraint import parallel
from twolink.simulation.hybrid.impact import at_rest, is_left_over, largest, speed_along, stopped
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.reactions import press
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem

# A start is given in float64.
_ROUNDING = PRECISIONS["double"].rounding

# From the round-off of float64 to that of every precision.
_NEWTON_STEPS = 2


def start_state(system: HybridSystem, scene: Scene) -> HybridState:
    """Return the initial state of a scene, before any impact.

    Raises `SimulationError` if a point starts inside a rigid contact.
    """
    number = system.number
    q = number(scene.q[0]), number(scene.q[1])
    u = number(scene.u[0]), number(scene.u[1])
    pose = system.pose(q)
    state = HybridState(
        t=number(0),
        q=q,
        u=u,
        gaps=tuple(_gap(system, element, q) for element in system.elements),
        touching=frozenset(),
        sliding=tuple(_sliding(pose, element, u) for element in system.elements),
        compliant=tuple(compliant_state.undisturbed(element) for element in system.elements),
    )
    for index, element in enumerate(system.elements):
        if element.normal is not None:
            pose = system.pose(state.q)
            state = _touched(system, state, pose, index)
    return _on_contacts(system, state)


def _on_contacts(system: HybridSystem, state: HybridState) -> HybridState:
    """Return the state exactly on the rigid contacts that it rests on, without normal speed.

    A start is given in float64, whose round-off is a gap and a speed in longer precisions.
    """
    held = [i for i in sorted(state.touching) if system.elements[i].rigid]
    pose = _placed(system, system.pose(state.q), held, state)
    normals = [system.elements[index].normal for index in held]
    u = stopped(pose, normals, state.u, _ROUNDING)  # type: ignore[arg-type]
    change = largest((u[0] - state.u[0], u[1] - state.u[1]))
    if change > tolerances.UNDECIDED * _ROUNDING * largest(state.u):
        # Along two nearly parallel normals, a speed of round-off is no state of rest.
        u = state.u
    gaps = tuple(
        _gap(system, element, pose.q) if gap else gap
        for element, gap in zip(system.elements, state.gaps, strict=True)
    )
    return state._replace(q=pose.q, u=u, gaps=gaps)


def _placed(system: HybridSystem, pose: Pose, held: list[int], state: HybridState) -> Pose:
    """Return the pose in which the gaps of contacts are zero: of two that determine it, or of one.

    The pose stays where a gap of round-off would move it by more, near a singular pose.
    """
    normals = {index: pose.row(system.elements[index].normal) for index in held}  # type: ignore[arg-type]
    others = [i for i in held if not parallel(normals[held[0]], normals[i], system.lever)]
    if not others:
        return place(system, pose, held[0], state) if held else pose
    pair = [system.elements[index] for index in (held[0], others[0])]
    for _ in range(_NEWTON_STEPS):
        (x1, y1), (x2, y2) = (pose.row(element.normal) for element in pair)  # type: ignore[arg-type]
        one, two = (_gap(system, element, pose.q) for element in pair)
        across = x1 * y2 - x2 * y1
        dq = (one * y2 - two * y1) / across, (two * x1 - one * x2) / across
        if largest(dq) > tolerances.UNDECIDED * _ROUNDING * max(1, largest(pose.q)):
            return pose
        pose = system.pose((pose.q[0] - dq[0], pose.q[1] - dq[1]))
    return pose


def _gap(system: HybridSystem, element: ContactElement, q: Any) -> Any:
    if element.normal is None:
        return None
    return element.normal.coordinate(system.chain, q) - element.bound


def _touched(system: HybridSystem, state: HybridState, pose: Pose, index: int) -> HybridState:
    """Return the state in which a contact is touched or pressed, if it is."""
    element, gap = system.elements[index], state.gaps[index]
    assert element.normal is not None
    assert gap is not None
    # A start is given in float64, and lies on a contact within round-off of float64.
    near = tolerances.CONTACT_GAP * _ROUNDING * max(1.0, abs(float(element.bound)))
    row = pose.row(element.normal)
    still = is_left_over(row, state.u, state.u, _ROUNDING)
    if gap > near:
        return state
    if gap < -near:
        if element.rigid:
            raise SimulationError(
                f"{element.name}: the scene must start outside or in contact; got a start"
                f" {-float(gap):.6g} inside"
            )
        return _pressed_in(system, state, index, -gap)
    state = state._replace(gaps=put(state.gaps, index, system.number(0)))
    recedes = not still and speed_along(row, state.u) > 0
    if recedes or (element.rigid and not still):
        # Its gap is zero exactly, and the pose must agree, from which the other gaps follow.
        return state._replace(q=place(system, pose, index, state).q)
    if not element.rigid:
        # Round-off of the position would cause a force of a stiff surface.
        pose = place(system, pose, index, state)
        return press(system, state._replace(q=pose.q), pose, index, still)
    return state._replace(touching=state.touching | {index})


def _sliding(pose: Pose, element: ContactElement, u: Any) -> int:
    """Return the direction in which an element slides at the start, given in float64."""
    if element.tangent is None or at_rest(pose.row(element.tangent), u, _ROUNDING):
        return 0
    return 1 if speed_along(pose.row(element.tangent), u) > 0 else -1


def _pressed_in(system: HybridSystem, state: HybridState, index: int, depth: Any) -> HybridState:
    """Return the state of a scene that starts pressed into a compliant surface, to a depth (m)."""
    element, own = system.elements[index], state.compliant[index]
    assert element.normal is not None
    assert own is not None
    pressed = compliant_state.pressed_at(element, own, depth)
    rate = -element.normal.speed(system.chain, state.q, state.u)
    force = element.branch(pressed.plastic).law.force(depth, pressed.sqrt_depth or 0, rate)
    gaps = put(state.gaps, index, system.number(0))
    if force < 0 and element.hysteresis is not None:
        pressed = compliant_state.turned(element, pressed)
    elif force < 0:
        # The point moves out faster than the surface recovers.
        pressed = compliant_state.overtaken(element, pressed, depth)
        return state._replace(compliant=put(state.compliant, index, pressed), gaps=gaps)
    return state._replace(
        compliant=put(state.compliant, index, pressed), gaps=gaps,
        touching=state.touching | {index},
    )  # fmt: skip
