"""The event functions of a mode: positive quantities whose fall through zero ends the mode."""

from __future__ import annotations

from typing import NamedTuple

from twolink.arithmetic import Pair, Scalar
from twolink.contact.states import EventKind
from twolink.simulation.hybrid.dynamics import Solution
from twolink.simulation.hybrid.mode import Mode, Trigger
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import LOCKING

# Events whose function is an integration variable, or a constant minus one.
OF_GAP = (EventKind.HITS, EventKind.CLEARS)

EDGES = (EventKind.CLEARS, EventKind.REACHES)
"""Events at the ends of the branches of a force law."""

OF_FORCE = (EventKind.LEAVES, EventKind.BREAKS)
"""Events whose functions are those of forces."""


class Surfaces(NamedTuple):
    """Integration variables of the elements, by number: gaps (m), √depth (m^½)."""

    gaps: dict[int, Scalar]
    roots: dict[int, Scalar]


def triggers(system: HybridSystem, mode: Mode) -> tuple[Trigger, ...]:
    """Return the events that may end a mode."""
    return tuple(
        Trigger(kind, index, sense)
        for index, (element, state) in enumerate(zip(system.elements, mode.states, strict=True))
        for kind, sense in element.events(state, mode.dent(index))
    )


def value(
    trigger: Trigger,
    system: HybridSystem,
    mode: Mode,
    pose: Pose,
    u: Pair,
    solution: Solution | None,
    surfaces: Surfaces,
) -> Scalar:
    """Return the event function of a trigger, for numbers of any kind.

    It is a place (rad, m, m^½), a speed (rad/s, m/s), a force (N, N m), or a normal
    acceleration per unit of normal force (1/kg). The solution is used for forces alone.
    """
    kind, index, sense = trigger.kind, trigger.index, trigger.sense
    element = system.elements[index]
    if kind in (EventKind.HITS, EventKind.CLEARS, EventKind.REACHES):
        return _place(trigger, system, mode, surfaces)
    if kind is EventKind.JAMS:
        return response_to_push(system, mode, pose, index)
    if kind in OF_FORCE:
        assert solution is not None
        forces = solution.forces[index]
        if kind is EventKind.LEAVES:
            return surfaces.roots.get(index, forces.normal)
        # At the static limit against a direction the element begins to slide in that direction.
        return element.limits(forces.normal)[1] + sense * forces.tangential
    along = element.tangent if kind is EventKind.STOPS else element.normal
    assert along is not None
    speed = pose.speed(along, u)
    if kind is EventKind.STOPS:
        return sense * speed
    return -sense * (speed + element.branch(mode.dent(index)).rate)


def _place(trigger: Trigger, system: HybridSystem, mode: Mode, surfaces: Surfaces) -> Scalar:
    """Return the distance (m) of a point from a surface, or from the end of a branch of its law."""
    index = trigger.index
    if trigger.kind is EventKind.HITS:
        return surfaces.gaps[index]
    branch = system.elements[index].branch(mode.dent(index))
    if trigger.kind is EventKind.CLEARS:
        return branch.residual - surfaces.gaps[index]
    return branch.reach - surfaces.roots[index]


def locks(system: HybridSystem, mode: Mode, pose: Pose, index: int) -> bool:
    """Return whether friction almost cancels the normal acceleration by a normal force.

    The normal force then grows without bound while the slide stops (Painlevé).
    """
    normal = system.elements[index].normal
    assert normal is not None
    row = pose.row(normal)
    left = abs(response_to_push(system, mode, pose, index))
    return bool(left <= LOCKING * pose.response(row, row))


def response_to_push(system: HybridSystem, mode: Mode, pose: Pose, index: int) -> Scalar:
    """Return the normal acceleration per unit of normal force on a sliding contact (1/kg)."""
    element = system.elements[index]
    assert element.normal is not None
    assert element.tangent is not None
    row, tangent = pose.row(element.normal), pose.row(element.tangent)
    s = -mode.states[index].direction * element.limits(1)[0]
    return pose.response(row, (row[0] + s * tangent[0], row[1] + s * tangent[1]))
