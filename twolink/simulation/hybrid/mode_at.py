"""The accelerations and forces of a mode at a hybrid state."""

from __future__ import annotations

from twolink.simulation.hybrid.dynamics import Solution, mode_solution
from twolink.simulation.hybrid.mode import Mode
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem


def solution_at(system: HybridSystem, pose: Pose, state: HybridState, mode: Mode) -> Solution:
    """Return du/dt (rad/s²) and the forces of all elements (N, N m); `pose` is that of the state.

    The depths of pressed surfaces are those of the state, which are more accurate than positions.
    """
    dents = [mode.dent(i) for i in range(len(mode.states))]
    roots = {
        i: own.sqrt_depth
        for i, own in enumerate(state.compliant)
        if own is not None and own.sqrt_depth is not None
    }
    return mode_solution(
        pose, system.effects, system.elements, mode.states, dents, state.u, state.t, roots
    )
