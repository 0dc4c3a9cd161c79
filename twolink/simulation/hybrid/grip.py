"""Contacts between which a chain at rest may be gripped: they could hold it against any load.

Contacts on opposite sides of a link may press on it with any force, which no load causes. Their
friction grows with that force.
"""

from __future__ import annotations

import itertools
import math

from twolink.simulation.hybrid.noise import vanishes
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import PARALLEL


def is_gripped(system: HybridSystem, state: HybridState, pose: Pose) -> bool:
    """Return whether rigid contacts that touch could hold the chain at rest against any load.

    Their forces are those in the cones of static friction. They balance every load if no half-plane
    of generalized forces has them all.
    """
    angles = sorted(math.atan2(y, x) for x, y in _edges(system, state, pose))
    if len(angles) <= 2:
        return False
    gaps = [after - own for own, after in itertools.pairwise([*angles, angles[0] + 2 * math.pi])]
    return max(gaps) < math.pi - PARALLEL


def _edges(system: HybridSystem, state: HybridState, pose: Pose) -> list[tuple[float, float]]:
    """Return the generalized forces at the edges of the cones, of any length."""
    found: list[tuple[float, float]] = []
    for index in sorted(state.touching):
        element = system.elements[index]
        if not element.rigid or element.normal is None:
            continue
        x, y = (float(entry) for entry in pose.row(element.normal))
        rows = [(x, y)]
        if element.tangent is not None:
            limit = float(element.limits(1)[1])
            along, across = (float(entry) for entry in pose.row(element.tangent))
            rows = [(x + s * along, y + s * across) for s in (-limit, limit)]
        found += [row for row in rows if not vanishes(system, row)]
    return found
