"""Why the laws admit no motion, or no single one: the sentence of an error."""

from __future__ import annotations

from collections.abc import Callable

from twolink.simulation.hybrid.collision import touched_names
from twolink.simulation.hybrid.complementarity import is_at_rest
from twolink.simulation.hybrid.grip import is_gripped
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.singular_pose import (
    pinned,
    turned_about,
    wedged,
    wedged_between,
)
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem


def sentence_on(system: HybridSystem, state: HybridState, pose: Pose) -> str:
    """Return why there is no motion from a state: the first cause that applies."""
    causes = (cause(system, state, pose) for cause in _CAUSES)
    return f"at {float(state.t):.9g} s {next(filter(None, causes))}"


def sentence_on_endless(system: HybridSystem, state: HybridState, modes: str) -> str:
    """Return why modes follow each other at one instant without end; `modes` has the last ones."""
    numbers = turned_about(system, state, system.pose(state.q))
    if not numbers:
        return f"modes follow each other without end at {float(state.t):.9g} s: {modes}"
    names = ", ".join(system.names[index] for index in numbers)
    return (
        f"at {float(state.t):.9g} s the folded links can turn together about A, and the laws do "
        f"not determine the forces on link 2 there ({names}) beside the torque of joint B; such "
        "motions are not simulated"
    )


def _wedged(system: HybridSystem, state: HybridState, pose: Pose) -> str:
    stuck = wedged(system, state, pose)
    if not stuck:
        return ""
    without = "impulse on the point stops" if any(state.u) else "force on the point holds"
    return (
        f"{system.names[stuck[0]]} is wedged: in this stretched or folded pose no finite {without} "
        "the links, and rigid bodies have no motion from here"
    )


def _wedged_between(system: HybridSystem, state: HybridState, pose: Pose) -> str:
    both = wedged_between(system, state, pose)
    if not both:
        return ""
    one, other = (system.names[index] for index in both)
    return (
        f"the chain is wedged between {one} and {other}: the links turn along both, which would "
        "carry a point through one of them, and no finite force stops the links; rigid bodies have "
        "no motion from here"
    )


def _gripped(system: HybridSystem, state: HybridState, pose: Pose) -> str:
    if not (is_at_rest(system, state) and is_gripped(system, state, pose)):
        return ""
    return (
        "only contacts that press against each other could hold the chain, with forces that no "
        "load determines; such a rest is not simulated; elements in contact: "
        f"{touched_names(system, state)}"
    )


def _pinned(system: HybridSystem, state: HybridState, pose: Pose) -> str:
    fixed = pinned(system, state, pose)
    if not fixed:
        return ""
    return (
        f"{system.names[fixed[0]]} is pinned: in this folded pose the links turn together about "
        "the point, and the laws do not determine the force of its friction; such motions are not "
        "simulated"
    )


def _other(system: HybridSystem, state: HybridState, pose: Pose) -> str:
    return (
        "the laws of Coulomb friction and contact allow no motion; elements in contact: "
        f"{touched_names(system, state)}"
    )


_CAUSES: tuple[Callable[[HybridSystem, HybridState, Pose], str], ...] = (
    _wedged, _wedged_between, _gripped, _pinned, _other,
)  # fmt: skip
