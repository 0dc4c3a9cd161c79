"""Doubts on jumps: choices by round-off that two runs of long precisions may share."""

from __future__ import annotations

import math

from twolink.arithmetic import Pair
from twolink.contact.states import EventKind, slipping
from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.collision import sliding_after
from twolink.simulation.hybrid.complementarity import States, problem_at
from twolink.simulation.hybrid.dynamics import solve
from twolink.simulation.hybrid.impact import largest, speed_along
from twolink.simulation.hybrid.mode import (
    Doubt,
    Mode,
    Trigger,
    doubt_of_change,
)
from twolink.simulation.hybrid.mode_at import solution_at
from twolink.simulation.hybrid.noise import known_at
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.select import Selection, select
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import UNDECIDED


def of_zeroed_speeds(
    system: HybridSystem, state: HybridState, after: HybridState, trigger: Trigger
) -> tuple[Doubt, ...]:
    """Return the doubt on speeds that a reaction has set to zero, if they exceed round-off."""
    if after.u is state.u:
        return ()
    change = float(largest((after.u[0] - state.u[0], after.u[1] - state.u[1])))
    if change * system.longest_step <= UNDECIDED * system.scales.resolution:
        return ()
    return (doubt_of_change(float(state.t), trigger, change),)


def of_flat_event(system: HybridSystem, arc: Arc, after: HybridState, mode: Mode) -> Doubt:
    """Return the doubt on the time of an event whose event function is flat, before a mode.

    Two runs of long precisions find it too early or too late by nearly the same time.
    """
    state, trigger = arc.end, arc.event
    assert trigger is not None
    du = solution_at(system, system.pose(state.q), state, arc.mode).du
    dv = solution_at(system, system.pose(after.q), after, mode).du
    change = arc.spread * float(largest((dv[0] - du[0], dv[1] - du[1])))
    # The difference of two runs grows at once between their events, and as errors do beyond them.
    return doubt_of_change(float(state.t) + 2 * arc.spread, trigger, change)


def of_early_mode(state: HybridState, selection: Selection) -> tuple[Doubt, ...]:
    """Return the doubt on a mode that round-off may have selected a little too early."""
    early = selection.early
    if early is None or not early.change:
        return ()
    return (doubt_of_change(float(state.t), early.trigger, early.change),)


def of_slides_at_start(
    system: HybridSystem, state: HybridState, pose: Pose, before: Pair, selection: Selection
) -> tuple[Doubt, ...]:
    """Return the doubts on slides after impacts at a start that count as rest in float64.

    `before` are the speeds (rad/s) before the impacts.
    """
    if known_at(state.t, system.rounding) == system.rounding:
        return ()
    directions = sliding_after(system, pose, before, state.u, system.rounding)
    return of_slow_slides(system, state, pose, directions, selection.states)


def of_slow_slides(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    directions: tuple[int, ...],
    states: States,
) -> tuple[Doubt, ...]:
    """Return the doubts on slides in some directions that count as rest in the states of a mode.

    A slide that its friction stops is at rest after a rounding of the time. One that the loads
    drive on may be held by static friction where it counts as rest: another motion.
    """
    slow = [i for i, own in enumerate(directions) if own and not state.sliding[i]]
    if not slow:
        return ()
    sliding = tuple(now or own for now, own in zip(state.sliding, directions, strict=True))
    moving = state._replace(sliding=sliding)
    found = select(system, moving, pose, {})
    return tuple(
        doubt_of_change(
            float(state.t), Trigger(EventKind.STOPS, index, directions[index]), math.inf
        )
        for index in slow
        if states[index] is not slipping(directions[index])
        and (found is None or _goes_on(system, moving, pose, found.states, index))
    )


def _goes_on(
    system: HybridSystem, state: HybridState, pose: Pose, states: States, index: int
) -> bool:
    """Return whether a slide is driven on in a mode, beyond the round-off of its acceleration."""
    if not states[index].slips:
        return False
    tangent = system.elements[index].tangent
    assert tangent is not None
    problem = problem_at(system, state, pose, tuple((own,) for own in states))
    du, row = solve(problem.equations, system.elements, states).du, pose.row(tangent)
    gain = speed_along(row, du) + pose.bias(tangent, state.u)
    return bool(states[index].direction * gain > problem.noise.along(row, du))
