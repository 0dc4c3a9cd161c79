"""Doubts on the initial state of a run: it is that of its scene within round-off."""

from __future__ import annotations

import math
from collections.abc import Iterator

from twolink.arithmetic import Pair
from twolink.contact.force_laws import Phase, PlasticState
from twolink.contact.states import EventKind
from twolink.effects import contact_elements, pieces_at, smooth_loads
from twolink.formulations import FORMULATIONS
from twolink.integration.precisions import PRECISIONS
from twolink.scene import Scene
from twolink.simulation.hybrid.doubts_of_jump import of_slow_slides
from twolink.simulation.hybrid.impact import approach, at_rest, largest, speed_along
from twolink.simulation.hybrid.mode import Doubt, Trigger
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.select import select
from twolink.simulation.hybrid.start import sense_along, start_state
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import UNDECIDED
from twolink.simulation.smooth.longest_step import default_longest_step

# A start is given in float64.
_ROUNDING = PRECISIONS["double"].rounding

# A point surely reaches a contact if the square of its speed is so many times as large as it needs.
_SURELY = 2

# The change of a speed by an impact, in the speed, with friction at most.
_MOST_OF_AN_IMPACT = 4


def doubts_of_start(system: HybridSystem, scene: Scene, state: HybridState) -> list[Doubt]:
    """Return the doubts on an initial state that is not that of its scene, within round-off.

    One is the largest change of q (rad) and u (rad/s). Runs and their judges share that of u, and
    their difference does not show it. Others are slides that count as rest within round-off,
    presses to a depth at which a force jumps, and impacts that would come later, or not at all.
    """
    resting = any(
        tangent is not None and not direction
        for tangent, direction in zip(system.tangents, state.sliding, strict=True)
    )
    unsure = [*_presses_at_jumps(system, state), *_early_impacts(system, scene, state)]
    unsure += _slides_at_rest(scene, state) if resting else []
    change = 0.0
    for given, own in ((scene.q, state.q), (scene.u, state.u)):
        moved = float(largest((own[0] - given[0], own[1] - given[1])))
        if moved > _ROUNDING * max(map(abs, given)):
            change = max(change, moved)
    if not change:
        return unsure
    # A contact that is closed; friction alone brings speeds to rest without one.
    index = next((i for i, gap in enumerate(state.gaps) if gap == 0), 0)
    return [Doubt(0.0, Trigger(EventKind.HITS, index), 0.0, change, 0.0), *unsure]


def _early_impacts(system: HybridSystem, scene: Scene, state: HybridState) -> Iterator[Doubt]:
    """Yield doubts on impacts at the start of points that are slightly off a rigid contact.

    They come at the start, and in truth after the time that the point needs. Where loads may turn
    it before, the speeds after the impact are in doubt.
    """
    q = system.number(scene.q[0]), system.number(scene.q[1])
    pose = system.pose(q)
    # The contacts of a judge are moved to the pose.
    given = contact_elements(system.effects, system.chain)
    for index, element in enumerate(given):
        normal = element.normal
        if normal is None or not element.rigid or state.gaps[index] != 0:
            continue
        gap, row = pose.value(normal, q) - element.bound, pose.row(normal)
        speed = approach(row, state.u, _ROUNDING, system.scales.lever)
        if not (gap > 0 and speed < 0):
            continue
        away = speed_along(row, _free_accelerations(system, pose, state))
        away += pose.bias(normal, state.u)
        impulse, late = _MOST_OF_AN_IMPACT * speed / pose.response(row, row), float(gap / -speed)
        change = float(largest(pose.impulse_response((impulse * row[0], impulse * row[1]))))
        if not away > 0 or speed * speed > _SURELY * 2 * gap * away:
            # It is later by so many seconds, as those of other impacts are. Within round-off of the
            # time only the place differs, as it does between a run and its judge.
            if late <= UNDECIDED * _ROUNDING * system.longest_step:
                continue
            change = min(change, late)
        yield Doubt(0.0, Trigger(EventKind.HITS, index), 0.0, change, 0.0)


def _free_accelerations(system: HybridSystem, pose: Pose, state: HybridState) -> Pair:
    """Return u' (rad/s²) under all loads but those of contacts and dry friction."""
    loads = smooth_loads(system.effects, system.chain, pose.q, state.u, state.t)
    active = system.formulation.generalized_active_force(system.chain, pose.q, loads)
    along = pose.velocity_terms(state.u)
    return pose.impulse_response((active[0] - along[0], active[1] - along[1]))


def _presses_at_jumps(system: HybridSystem, state: HybridState) -> Iterator[Doubt]:
    """Yield doubts on starts in surfaces whose force jumps at their depth, within round-off.

    A point that moves in passes the jump at once, and others turn on one side of it.
    """
    pose = system.pose(state.q)
    for index, element in enumerate(system.elements):
        law, normal, own = element.hysteresis, element.normal, state.compliant[index]
        if law is None or normal is None or own is None or own.plastic is None:
            continue
        row = pose.row(normal)
        if speed_along(row, state.u) < 0 and not at_rest(
            row, state.u, _ROUNDING, system.scales.lever
        ):
            continue
        depth = element.bound - pose.value(normal, state.q)
        jumps = {float(law.jump(PlasticState(phase))) for phase in Phase}
        if any(
            abs(float(depth - jump)) <= system.scales.places_of_rounding[index] for jump in jumps
        ):
            trigger = Trigger(EventKind.REACHES, index)
            yield Doubt(0.0, trigger, math.inf, math.inf, 0.0)


def _slides_at_rest(scene: Scene, state: HybridState) -> list[Doubt]:
    """Return the doubts on slides that count as rest, and would go on if they did not."""
    chain, effects = scene.moving_chain, pieces_at(scene.effects, 0.0)
    pose = Pose(chain, FORMULATIONS["lagrange"].equations, scene.q)
    senses = [sense_along(pose, element, scene.u) for element in contact_elements(effects, chain)]
    if not any(sense and not own for sense, own in zip(senses, state.sliding, strict=True)):
        return []
    # Only here, as the longest step of a scene takes longer than two events.
    system = _system_of(scene)
    pose = system.pose(scene.q)
    given = start_state(system, scene)
    at_rest = select(system, given, pose, {})
    if at_rest is None:
        return []
    return [*of_slow_slides(system, given, pose, tuple(senses), at_rest.states)]


def _system_of(scene: Scene) -> HybridSystem:
    """Return the system at the start of a scene, in float64."""
    chain, effects = scene.moving_chain, pieces_at(scene.effects, 0.0)
    return HybridSystem(
        chain, chain, FORMULATIONS["lagrange"].equations, effects,
        contact_elements(effects, chain), "double", None, float, _ROUNDING,
        default_longest_step(scene),
    )  # fmt: skip
