"""The fastest rate of the surfaces of an arc: the reason why steps become too short, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator

from twolink.arithmetic import sqrt
from twolink.simulation.hybrid.mode import Mode
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import SHORT_STEPS


def fastest_rate(system: HybridSystem, mode: Mode, state: HybridState) -> str:
    """Return the surface that recovers or damps fastest, in words; empty if none is fast.

    The words continue a sentence: ", while D on floor damps at 1e+07 1/s". Steps are about as long
    as the inverse of a rate: a slower one is no reason for short steps.
    """
    fast = 1 / (SHORT_STEPS * float(system.longest_step))
    every = *_recovering(system, state), *_damping(system, state)
    rates = [found for found in every if found[0] > fast]
    if not rates:
        return ""
    rate, index, verb = max(rates)
    return f", while {mode.names[index]} {verb} at {rate:.2g} 1/s"


def _recovering(system: HybridSystem, state: HybridState) -> Iterator[tuple[float, int, str]]:
    """Yield the rate (1/s) of each released surface that springs back."""
    for index, (element, own) in enumerate(zip(system.elements, state.compliant, strict=True)):
        rate = None if element.compliant is None else element.compliant.relaxation
        if own is not None and own.residual_depth and rate is not None:
            yield float(rate), index, "recovers"


def _damping(system: HybridSystem, state: HybridState) -> Iterator[tuple[float, int, str]]:
    """Yield the rate (1/s) at which each pressed surface damps the approach of its point.

    It is the slope of the force by the rate of the depth, times the acceleration by a unit of
    force.
    """
    pose = system.pose(state.q)
    for index in sorted(state.touching):
        element, own, gap = system.elements[index], state.compliant[index], state.gaps[index]
        if own is None or gap is None or element.normal is None:
            continue
        # A law that has no use for the root is integrated without it.
        root = sqrt(max(-gap, 0 * gap)) if own.sqrt_depth is None else own.sqrt_depth
        row, law = pose.row(element.normal), element.branch(own.plastic).law
        still, moving = (float(law.force(root * root, root, speed)) for speed in (0, 1))
        rate = (moving - still) * float(pose.response(row, row))
        if 0 < rate < math.inf:
            yield rate, index, "damps"
