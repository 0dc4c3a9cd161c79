"""Checks of a trajectory: each returns a sentence on the worst violation, or None.

Tolerances come from the accuracy asked for, times lengths, sizes of forces and stiffnesses; see
each check. A check must neither miss a fault nor report a correct motion.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Any

import numpy as np

from tests.campaign.checks_of_motion import MOTION
from tests.campaign.departures import rest_is_left_for_a_cause
from tests.campaign.seen import CUSHION, FRICTION, OBSTACLE, RESTING, SLIDING, Seen
from tests.campaign.verdict import Verdict, worst

# Rounding of a length (m) or an angle (rad) of order one.
_ROUNDING = 1e-13


def names_agree(seen: Seen) -> Verdict:
    """Return whether modes and forces have the names of the scene's elements."""
    expected = tuple(element.name for element in seen.elements)
    run = seen.trajectory
    if not expected:
        return None
    if not run.events:
        return f"there are {len(expected)} frictions and obstacles, and no event"
    given = tuple(force.name for force in run.contact_forces([float(run.t[0])]))
    for names in (given, *(event.mode.names for event in run.events)):
        if tuple(names) != expected:
            return f"names are {names}, those of the scene {expected}"
    return None


def not_silent(seen: Seen) -> Verdict:
    """Return whether a note says so where the accuracy is not met, and all of the run is there."""
    run = seen.trajectory
    if not run.met and not run.notes:
        return f"accuracy is not met (error {run.error:.2g}) and there is no note"
    if run.t[-1] != seen.scene.duration and not run.failure:
        return f"the run ends at {run.t[-1]:.9g} s, the scene at {seen.scene.duration:.9g} s"
    if not (np.isfinite(seen.q).all() and np.isfinite(seen.u).all()):
        return "q or u is not finite"
    return None


def no_penetration(seen: Seen) -> Verdict:
    """Return whether no stop or rigid surface is entered by more than twice the accuracy."""
    found = []
    for _, element in seen.of_kind(OBSTACLE):
        allowed = 2 * seen.slack * element.way.reach(seen.chain) + _ROUNDING
        found.append(worst(seen, element.name, -seen.gap(element), allowed, "is inside by"))
    return next(filter(None, found), None)


def no_passing_through_cushions(seen: Seen) -> Verdict:
    """Return whether every point inside a compliant surface presses it.

    A damped one may be sunk in still, and one that yields may have a dent, as deep as any before.
    """
    for i, element in seen.of_kind(CUSHION):
        gap = seen.gap(element)
        allowed = seen.sunk(i) + 4 * seen.slack * element.way.reach(seen.chain) + _ROUNDING
        if element.yields:
            pressed = np.where(seen.states(i) == "OPEN", 0.0, -gap)
            allowed = allowed + np.maximum.accumulate(np.maximum(pressed, 0.0))
            # A short press may fall between two of the times: its events do not.
            place = np.searchsorted(seen.moments, seen.t, side="right")
            allowed = allowed + np.append(0.0, _deepest_at_events(seen, i, element))[place]
        assert element.law is not None
        # A point that leaves faster than the law can push is not pushed.
        pushed = element.law(-gap, -element.way.speed(seen.chain, seen.q, seen.u)) > 0
        free = (seen.states(i) == "OPEN") & (pushed | (element.relaxation is not None))
        inside = np.where(free, -gap, 0.0)
        said = worst(seen, element.name, inside, allowed, "is free and inside by")
        if said:
            return said
    return None


def _deepest_at_events(seen: Seen, number: int, element: Any) -> Any:
    """Return how deep (m) a point has pressed a cushion at any event up to each."""
    q, _ = seen.trajectory.at(np.minimum(seen.moments, seen.trajectory.t[-1]))
    gap = element.way.coordinate(seen.chain, q) - element.bound
    before = np.maximum(seen.modes_at(seen.moments) - 1, 0)
    pressed = seen.states(number, before) != "OPEN"
    return np.maximum.accumulate(np.where(pressed, np.maximum(-gap, 0.0), 0.0))


def surfaces_push(seen: Seen) -> Verdict:
    """Return whether obstacles and cushions push and never pull, and give nothing while free."""
    for i, element in seen.of_kind(OBSTACLE, CUSHION):
        row = element.way.row(seen.chain, seen.q)
        pull = -seen.normal[i] * np.abs(row).max(axis=0)
        free = seen.states(i) == "OPEN"
        pull = np.where(free, np.abs(seen.normal[i]) + np.abs(seen.tangential[i]), pull)
        allowed = np.where(free, 1e-12, seen.force_slack * seen.crossing + _ROUNDING)
        said = worst(seen, element.name, pull, allowed, "pulls, or acts while free, by (N m)")
        if said:
            return said
    return None


def impulses_push(seen: Seen) -> Verdict:
    """Return whether impulses push, are inside the cone of friction, and leave no approach.

    Where bounces die away an impulse may take back a rebound too low to be seen.
    """
    by_name = {element.name: element for element in seen.elements}
    for impact in seen.trajectory.impacts:
        element = by_name.get(impact.name)
        if element is None or element.kind != OBSTACLE:
            return f"impact at {impact.time:.9g} s on {impact.name}, which is no obstacle"
        if impact.time > seen.until or _dies_away(seen, impact):
            continue
        normal, tangential = impact.normal_impulse, impact.tangential_impulse
        size = abs(normal) + abs(tangential)
        allowed = 1e-9 * size + 1e-13
        if normal < -allowed:
            return f"{impact.name}: impulse {normal:.3g} at {impact.time:.9g} s pulls"
        if element.tangent is not None and abs(tangential) > element.kinetic * normal + allowed:
            return (
                f"{impact.name}: at {impact.time:.9g} s the tangential impulse {tangential:.6g} is"
                f" beyond {element.kinetic:.6g} times {normal:.6g}"
            )
        before, after = impact.speeds
        if after < -1e-9 * abs(before) - 1e-12:
            return f"{impact.name}: still approached at {after:.3g} after {impact.time:.9g} s"
    return None


def _dies_away(seen: Seen, impact: Any) -> bool:
    """Return whether an impact stands for bounces that are too low to be seen."""
    slow = max(map(abs, impact.speeds)) <= seen.slack
    return slow or getattr(impact, "regime", "") == "bounces die away"


def impacts_lose_energy(seen: Seen) -> Verdict:
    """Return whether impacts take kinetic energy, but for Newton's laws with friction."""
    by_name = {element.name: element for element in seen.elements}
    for impact in seen.trajectory.impacts:
        before, after = impact.kinetic_energy
        element = by_name[impact.name]
        if impact.time > seen.until or element.gains or _dies_away(seen, impact):
            continue
        if after - before > 1e-10 * max(before, after) + 1e-15:
            return f"{impact.name}: impact at {impact.time:.9g} s gives {after - before:.3g} J"
    return None


def restitution_holds(seen: Seen) -> Verdict:
    """Return whether a smooth obstacle sends back e times the speed of approach."""
    by_name = {element.name: element for element in seen.elements}
    for impact in seen.trajectory.impacts:
        element = by_name[impact.name]
        rough = element.tangent is not None and element.kinetic > 0
        if impact.time > seen.until or rough or _dies_away(seen, impact):
            continue
        before, after = impact.speeds
        if abs(after + element.restitution * before) > 1e-9 * abs(before) + 1e-12:
            return (
                f"{impact.name}: at {impact.time:.9g} s {before:.9g} becomes {after:.9g}, e is"
                f" {element.restitution:.6g}"
            )
    return None


def coulomb_holds(seen: Seen) -> Verdict:
    """Return whether contact friction is exactly kinetic while sliding, at most static at rest."""
    for i, element in seen.of_kind(OBSTACLE, CUSHION):
        if element.tangent is None:
            continue
        states, long = seen.states(i), np.abs(element.tangent.row(seen.chain, seen.q)).max(axis=0)
        push = np.maximum(seen.normal[i], 0.0)
        excess = np.abs(seen.tangential[i]) - element.static * push
        for name, sense in SLIDING.items():
            wrong = np.abs(seen.tangential[i] + sense * element.kinetic * seen.normal[i])
            excess = np.where(states == name, wrong, excess)
        allowed = (1 + element.static) * seen.force_slack * seen.crossing + _ROUNDING
        said = worst(seen, element.name, long * excess, allowed, "offends Coulomb's law by (N m)")
        if said:
            return said
    return None


def dry_friction_holds(seen: Seen) -> Verdict:
    """Return whether dry friction is exactly kinetic while it slips, at most static at rest."""
    for i, element in seen.of_kind(FRICTION):
        states, long = seen.states(i), np.abs(element.way.row(seen.chain, seen.q)).max(axis=0)
        excess = np.abs(seen.normal[i]) - element.static
        for name, sense in SLIDING.items():
            wrong = np.abs(seen.normal[i] + sense * element.kinetic)
            excess = np.where(states == name, wrong, excess)
        allowed = seen.force_slack * seen.crossing + _ROUNDING
        said = worst(seen, element.name, long * excess, allowed, "friction is off by (N m)")
        if said:
            return said
    return None


def directions_agree(seen: Seen) -> Verdict:
    """Return whether slipping elements slip in their direction, to four times the accuracy."""
    for i, element in enumerate(seen.elements):
        if element.slides is None:
            continue
        speed, states = element.slides.speed(seen.chain, seen.q, seen.u), seen.states(i)
        allowed = 4 * seen.slack * element.slides.reach(seen.chain) + _ROUNDING
        for name, sense in SLIDING.items():
            against = np.where(states == name, -sense * speed, 0.0)
            said = worst(seen, element.name, against, allowed, f"slips against {name} at")
            if said:
                return said
    return None


def friction_brakes(seen: Seen) -> Verdict:
    """Return whether friction never drives: its power is that of the allowed speed at most."""
    for i, element in enumerate(seen.elements):
        if element.slides is None:
            continue
        force = seen.normal[i]
        if element.kind != FRICTION:
            # The fault is a surface that pulls, not its friction.
            force = np.where(seen.normal[i] > 0, seen.tangential[i], 0.0)
        speed = element.slides.speed(seen.chain, seen.q, seen.u)
        slow = 4 * seen.slack * element.slides.reach(seen.chain) + _ROUNDING
        allowed = np.abs(force) * slow + _ROUNDING
        said = worst(seen, element.name, force * speed, allowed, "friction drives with (W)")
        if said:
            return said
    return None


def rest_is_rest(seen: Seen) -> Verdict:
    """Return whether sticking elements have no speed, and resting ones no gap and no rate."""
    for i, element in enumerate(seen.elements):
        states = seen.states(i)
        if element.kind == OBSTACLE:
            closed, reach = states != "OPEN", element.way.reach(seen.chain)
            allowed = 4 * seen.slack * reach + _ROUNDING
            gap = np.where(closed, np.abs(seen.gap(element)), 0.0)
            rate = np.abs(element.way.speed(seen.chain, seen.q, seen.u))
            said = worst(seen, element.name, gap, allowed, "rests at a gap of") or worst(
                seen, element.name, np.where(closed, rate, 0.0), allowed, "rests with the rate"
            )
            if said:
                return said
        if element.slides is not None:
            allowed = 4 * seen.slack * element.slides.reach(seen.chain) + _ROUNDING
            speed = np.abs(element.slides.speed(seen.chain, seen.q, seen.u))
            sticks = np.where(np.isin(states, RESTING), speed, 0.0)
            said = worst(seen, element.name, sticks, allowed, "sticks and moves at")
            if said:
                return said
    return None


def compliant_laws_hold(seen: Seen) -> Verdict:
    """Return whether cushions push with the force of their law, to the error of the depth.

    One that yields pushes no more than an elastic one, whose force its published law exceeds by
    less than a tenth.
    """
    for i, element in seen.of_kind(CUSHION):
        assert element.law is not None
        depth, rate = -seen.gap(element), -element.way.speed(seen.chain, seen.q, seen.u)
        off = 2 * seen.slack * element.way.reach(seen.chain) + _ROUNDING
        force = np.maximum(element.law(depth, rate), 0.0)
        change = np.abs(element.law(depth + off, rate + off) - element.law(depth, rate))
        allowed = change + 1e-7 * np.abs(force) + 1e-10
        wrong = np.abs(seen.normal[i] - force)
        if element.yields:
            wrong = seen.normal[i] - 1.1 * force
        wrong = np.where(seen.states(i) == "OPEN", 0.0, wrong)
        said = worst(seen, element.name, wrong, allowed, "is off its law by (N)")
        if said:
            return said
    return None


CHECKS: dict[str, Callable[[Seen], Verdict]] = {
    "names": names_agree,
    "silent": not_silent,
    "penetration": no_penetration,
    "passed through a cushion": no_passing_through_cushions,
    "pull": surfaces_push,
    "impulse": impulses_push,
    "impact energy": impacts_lose_energy,
    "restitution": restitution_holds,
    "Coulomb's law": coulomb_holds,
    "dry friction": dry_friction_holds,
    "direction": directions_agree,
    "friction drives": friction_brakes,
    "rest": rest_is_rest,
    "departure": rest_is_left_for_a_cause,
    "compliant law": compliant_laws_hold,
    **MOTION,
}


def violations(trajectory: Any) -> list[tuple[str, str]]:
    """Return the name and the sentence of each check that a trajectory fails."""
    seen = Seen(trajectory)
    wrong = names_agree(seen)
    if wrong:
        return [("names", wrong)]
    verdicts = [(name, _said(check, seen)) for name, check in CHECKS.items()]
    return [(name, sentence) for name, sentence in verdicts if sentence]


def _said(check: Callable[[Seen], Verdict], seen: Seen) -> Verdict:
    """Return the verdict of a check; a trajectory that cannot be looked at fails it."""
    try:
        return check(seen)
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"cannot be checked: {type(error).__name__}: {error} ({place.name}:{place.lineno})"
