"""The Zeno limit: bounces that all end within rounding are left out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from twolink.arithmetic import Pair
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.collision import sliding_after
from twolink.simulation.hybrid.dynamics import Pose, mode_solution
from twolink.simulation.hybrid.impact import (
    Impacts,
    Strike,
    is_left_over,
    speed_along,
)
from twolink.simulation.hybrid.mode import Mode
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem


def left_out(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    mode: Mode,
    struck: Sequence[Strike],
    recent: Sequence[Strike],
) -> tuple[HybridState, list[Strike], float] | None:
    """Return the state in which contacts rest whose further bounces end within rounding, or None.

    From a speed v and under an acceleration −a bounces take the time 2v/a, e times that, e² times
    that, …: together 2v/a/(1 − e), where e is the ratio of the speeds of the last bounce. Contacts
    that interrupt each other have no such sum: if very many impacts fall into the Zeno time, all
    contacts that take part come to rest.
    """
    limit = tolerances.zeno_time(float(system.longest_step), system.rounding)
    now = float(state.t)
    flying = [s.number for s in struck if s.number not in state.touching]
    if not flying:
        return None
    crowd = [strike for strike in recent if strike.time >= now - limit]
    if len(crowd) > tolerances.MOST_IMPACTS_OF_A_BURST:
        return _clamped(system, state, pose, sorted({strike.number for strike in crowd}), 0.0)
    # A contact that was struck a moment before ends its bounces with those of the others.
    flying = list(dict.fromkeys([*flying, *(s.number for s in crowd)]))
    lasting = {
        index: _bounces_last(system, state, pose, mode, recent, index)
        for index in flying
        if index not in state.touching
    }
    ended = [index for index, time in lasting.items() if time <= limit]
    if not ended:
        return None
    return _clamped(system, state, pose, ended, max(lasting[index] for index in ended))


def _bounces_last(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    mode: Mode,
    recent: Sequence[Strike],
    index: int,
) -> float:
    """Return the time (s) of all further bounces on a contact, infinity if they do not end."""
    normal = system.elements[index].normal
    assert normal is not None
    row = pose.row(normal)
    speed, gap = speed_along(row, state.u), state.gaps[index]
    assert gap is not None
    dents = [mode.dent(i) for i in range(len(mode.states))]
    roots = {
        i: own.sqrt_depth
        for i, own in enumerate(state.compliant)
        if own is not None and own.sqrt_depth is not None
    }
    du = mode_solution(
        pose, system.effects, system.elements, mode.states, dents, state.u, state.t, roots
    ).du
    back = -(speed_along(row, du) + normal.bias(system.chain, state.q, state.u))
    if back <= 0:
        return math.inf
    before, after = next(s.speeds for s in reversed(recent) if s.number == index)
    ratio = float(after) / -float(before) if before < 0 else system.elements[index].restitution  # type: ignore[attr-defined]
    if ratio >= 1:
        return math.inf
    # Until it lands, and then for all bounces from the speed at which it does.
    lands = math.sqrt(max(float(speed) ** 2 + 2 * float(back) * float(gap), 0.0))
    return (float(speed) + lands + 2 * lands * ratio / (1 - ratio)) / float(back)


def _clamped(
    system: HybridSystem, state: HybridState, pose: Pose, indices: Sequence[int], delay: float
) -> tuple[HybridState, list[Strike], float]:
    """Return the state with contacts at rest, the impacts that take their speeds, and the delay."""
    impacts = Impacts(pose, system.elements, float(state.t), system.rounding)
    slides = [index for index in indices if state.sliding[index]]
    strikes = impacts.ended(indices, state.u, slides)
    u, gaps = strikes[-1].u[1], state.gaps
    for index in indices:
        gaps = put(gaps, index, system.number(0))
    still = {
        i
        for i in state.touching
        if not system.elements[i].rigid or _rests(system, pose, i, state.u, u)
    }
    sliding = sliding_after(system, pose, state.u, u)
    touching = frozenset({*indices, *still})
    return replace(state, u=u, gaps=gaps, touching=touching, sliding=sliding), strikes, delay


def _rests(system: HybridSystem, pose: Pose, index: int, before: Pair, u: Pair) -> bool:
    """Return whether the speed along a contact is zero, but for the rounding of what it was."""
    normal = system.elements[index].normal
    assert normal is not None
    return is_left_over(pose.row(normal), u, before, system.rounding)
