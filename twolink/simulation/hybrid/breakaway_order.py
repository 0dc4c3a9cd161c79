"""The order of breakaways at one instant, on which the motion depends.

An element that begins to slide has less friction at once, and the forces on the others change. Of
two static limits that are reached together, either may be the first: the laws determine no order.
"""

from __future__ import annotations

from collections.abc import Iterator

from twolink.contact.states import ContactState, EventKind
from twolink.simulation.hybrid.event_functions import Surfaces, triggers, value
from twolink.simulation.hybrid.mode import Mode, Remark, Trigger
from twolink.simulation.hybrid.mode_at import solution_at
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import SAME_LIMIT


def remarks_on_order(
    system: HybridSystem, state: HybridState, mode: Mode, trigger: Trigger
) -> tuple[Remark, ...]:
    """Return a remark where a breakaway is the first of several at one instant."""
    if trigger.kind is not EventKind.BREAKS or not system.elements[trigger.index].hysteretic:
        return ()
    others = [each for each in triggers(system, mode) if _may_tie(system, mode, trigger, each)]
    if not others:
        return ()
    names = [system.names[index] for index in _reached(system, state, mode, others)]
    if not names:
        return ()
    now, own = float(state.t), system.names[trigger.index]
    choice = "static limits are reached at one instant"
    sentence = (
        f"At {now:.9g} s the static limits of {own} and {' and '.join(names)} are reached at one "
        f"instant: {own} is the first to slide; another order may lead to another motion."
    )
    return (Remark(choice, now, sentence),)


def _may_tie(system: HybridSystem, mode: Mode, first: Trigger, other: Trigger) -> bool:
    """Return whether another event is a breakaway of another element, with a drop of friction."""
    return (
        other.kind is EventKind.BREAKS
        and other.index != first.index
        and mode.states[other.index] is ContactState.STICKS
        and system.elements[other.index].hysteretic
    )


def _reached(
    system: HybridSystem, state: HybridState, mode: Mode, others: list[Trigger]
) -> Iterator[int]:
    """Yield the elements whose static limit is reached within round-off."""
    pose = system.pose(state.q)
    solution = solution_at(system, pose, state, mode)
    for each in others:
        left = value(each, system, mode, pose, state.u, solution, Surfaces({}, {}))
        limit = system.elements[each.index].limits(solution.forces[each.index].normal)[1]
        if abs(left) <= SAME_LIMIT * system.rounding * abs(limit):
            yield each.index
