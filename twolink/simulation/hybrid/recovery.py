"""The recovery of compliant surfaces that are no longer pressed."""

from __future__ import annotations

from typing import Any

from twolink.simulation.hybrid import compliant_state
from twolink.simulation.hybrid.compliant_state import CompliantState
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem


def next_recovery(system: HybridSystem, state: HybridState, end: Any) -> Any:
    """Return the time (s) at which the next surface has recovered, the `end` without one."""
    times = [
        _left(system, index, own)
        for index, own in enumerate(state.compliant)
        if own is not None and own.residual_depth != 0
    ]
    return state.t + system.number(min(times)) if times else end


def recovered(system: HybridSystem, state: HybridState) -> HybridState:
    """Return the state in which surfaces that have recovered are undeformed."""
    compliant = state.compliant
    if not any(compliant):
        return state
    for index, own in enumerate(compliant):
        if own is None or own.residual_depth == 0:
            continue
        if _left(system, index, own) == 0:
            compliant = put(compliant, index, compliant_state.relaxed(own))
    return state if compliant is state.compliant else state._replace(compliant=compliant)


def _left(system: HybridSystem, index: int, own: CompliantState) -> float:
    """Return the time (s) until a surface has recovered, 0 if it has."""
    least = system.scales.resolution * system.scales.sizes[index]
    return compliant_state.relaxation_time(system.elements[index], own, least)
