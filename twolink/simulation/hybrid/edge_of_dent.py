"""Doubts on a point at the edge of its dent at the end of an arc: it may leave it in any case."""

from __future__ import annotations

import math

from twolink.contact.states import EventKind
from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.collision import nearby
from twolink.simulation.hybrid.impact import speed_along
from twolink.simulation.hybrid.mode import Doubt, Trigger
from twolink.simulation.hybrid.mode_at import solution_at
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import FLAT

# The events at which neither speeds nor forces jump.
_WITHOUT_JUMP = (EventKind.LEAVES, EventKind.CLEARS)


def doubts_with_rise(system: HybridSystem, arc: Arc) -> tuple[Doubt, ...]:
    """Return the doubts of an arc; those on an edge at its end count for large errors only.

    If the point has not left its dent at the event that ends the arc, it does so next: neither its
    speed nor its acceleration jumps. Only an error as large as its rise beyond the edge keeps it
    there. An impact at the same instant may throw it back: then the doubts stay as they are.
    """
    if arc.event is None or arc.event.kind not in _WITHOUT_JUMP:
        return arc.doubts
    if any(index not in arc.end.touching for index in nearby(system, arc.end)):
        return arc.doubts
    end = float(arc.end.t)
    return tuple(
        doubt._replace(within=max(doubt.within, _rise(system, arc, doubt.trigger)))
        if doubt.trigger.kind is EventKind.CLEARS and math.nextafter(doubt.until, math.inf) >= end
        else doubt
        for doubt in arc.doubts
    )


def _rise(system: HybridSystem, arc: Arc, trigger: Trigger) -> float:
    """Return the error of angles (rad) and speeds (rad/s) by which a point stays in its dent.

    From the edge it rises by v²/(2 a), v its speed along the normal and a its acceleration toward
    the surface. The event functions do not show it: the clock of an arc stands still where a point
    leaves a pressed surface.
    """
    state, normal = arc.end, system.elements[trigger.index].normal
    assert normal is not None
    pose = system.pose(state.q)
    row, du = pose.row(normal), solution_at(system, pose, state, arc.mode).du
    speed = max(float(speed_along(row, state.u)), 0.0)
    fall = -float(speed_along(row, du) + pose.bias(normal, state.u))
    rise = speed * speed / (2 * fall) if fall > 0 else math.inf
    return min(rise, speed) / max(float(abs(row[0]) + abs(row[1])), FLAT)
