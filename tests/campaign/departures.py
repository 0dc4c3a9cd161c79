"""The check that a chain leaves its rest only where no forces within the laws can hold it.

The forces are found by a linear program, which knows nothing of modes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import linprog

from tests.campaign.seen import CUSHION, FRICTION, OBSTACLE, Seen
from tests.campaign.verdict import Verdict

# The part of each limit of friction that a rest must not need, so that it is certain.
_TO_SPARE = 0.02

# A chain whose links turn slower (rad/s) is at rest, and a gap that is smaller (rad, m) closed.
_AT_REST, _CLOSED = 1e-13, 1e-12

# A surface that a point cannot get beyond has no force: at its farthest place the point has no
# lever arm (m), or 1e-16 m by round-off.
_NO_LEVER = 1e-12

# The time (s) after a departure at which the chain moves, and those at which the loads are looked
# at: beside a jump, and later, as a linear program does not see loads that have just changed sign.
_LATER = 1e-3
_LOOKS = (1e-9, 0.25 * _LATER, 0.5 * _LATER, 0.75 * _LATER, _LATER)

# Of more departures than this some are looked at, evenly spread.
_MOST_DEPARTURES = 40

# SciPy's status codes of a linear program with an answer.
_SOLVED, _INFEASIBLE = 0, 2

# Words of the notes on choices between a rest and a motion that the laws both admit.
_CHOICES = ("leave a choice", "do not determine", "does not let")


def rest_is_left_for_a_cause(seen: Seen) -> Verdict:
    """Return whether no forces within the laws hold a chain where it leaves its rest.

    Where the laws admit both, a note says so, and surfaces that yield have no law of their depth.
    """
    notes = " ".join(seen.trajectory.notes)
    if any(element.yields for element in seen.elements) or any(w in notes for w in _CHOICES):
        return None
    found = _departures(seen)
    if len(found) > _MOST_DEPARTURES:
        found = found[np.linspace(0, len(found) - 1, _MOST_DEPARTURES).astype(int)]
    for time in found:
        if all(_can_rest(seen, float(time), later) for later in _LOOKS):
            return (
                f"the chain leaves its rest at {time:.9g} s, though forces that need at most"
                f" {1 - _TO_SPARE:.0%} of static friction hold it"
            )
    return None


def _departures(seen: Seen) -> Any:
    """Return the times (s) of events at which a chain at rest begins to move."""
    entered = np.unique([0.0, *(event.entered for event in seen.trajectory.events)])
    entered = entered[entered < seen.until - _LATER]
    if len(entered) < 2:
        return np.zeros(0)
    _, middle = seen.trajectory.at((entered[:-1] + entered[1:]) / 2)
    _, before = seen.trajectory.at(entered[1:], side="left")
    _, after = seen.trajectory.at(entered[1:] + _LATER)
    rested = np.abs(np.concatenate([middle, before])).max(axis=0) <= _AT_REST
    return entered[1:][rested & (np.abs(after).max(axis=0) > 10 * seen.slack)]


def _can_rest(seen: Seen, time: float, later: float) -> bool:
    """Return whether forces hold the chain in its pose at a time (s), with some to spare.

    The loads are those that act `later` (s).
    """
    q, _ = seen.trajectory.at([time])
    at_rest = np.zeros((2, 1))
    load, sizes = seen.smooth_force(q, at_rest, np.array([time + later]))
    held, bounds, cones = load[:, 0].copy(), [], []
    columns: list[Any] = []

    def add(way: Any, least: float, most: float) -> int:
        columns.append(way.row(seen.chain, q)[:, 0])
        bounds.append((least, most))
        return len(columns) - 1

    for _, element in seen.of_kind(FRICTION, OBSTACLE, CUSHION):
        limit = (1 - _TO_SPARE) * element.static
        if element.kind == FRICTION:
            add(element.way, -limit, limit)
            continue
        gap = float(element.way.coordinate(seen.chain, q)[0]) - element.bound
        if element.kind == CUSHION:
            assert element.law is not None
            push = max(0.0, float(element.law(-gap, 0.0))) if gap < 0 else 0.0
            held += push * element.way.row(seen.chain, q)[:, 0]
            if element.tangent is not None:
                add(element.tangent, -limit * push, limit * push)
        elif gap <= _CLOSED and np.abs(element.way.row(seen.chain, q)).max() > _NO_LEVER:
            normal = add(element.way, 0.0, np.inf)
            if element.tangent is not None:
                cones.append((normal, add(element.tangent, -np.inf, np.inf), limit))
    scale = max(float(np.abs(held).max()), float(sizes.max()), 1e-12)
    return bool(columns) and _has_solution(np.array(columns).T, -held / scale, scale, bounds, cones)


def _has_solution(rows: Any, held: Any, scale: float, bounds: Any, cones: Any) -> bool:
    """Return whether forces within bounds, in units of a scale (N m), and cones balance a load."""
    within = [(least / scale, most / scale) for least, most in bounds]
    cone = np.zeros((2 * len(cones), rows.shape[1]))
    for place, (normal, tangential, limit) in enumerate(cones):
        for line, sense in ((2 * place, 1.0), (2 * place + 1, -1.0)):
            cone[line, normal], cone[line, tangential] = -limit, sense
    found = linprog(
        np.zeros(rows.shape[1]), A_ub=cone if cones else None,
        b_ub=np.zeros(len(cone)) if cones else None, A_eq=rows, b_eq=held, bounds=within,
    )  # fmt: skip
    if found.status not in (_SOLVED, _INFEASIBLE):
        raise RuntimeError(f"the linear program of a rest has no answer: {found.message}")
    return bool(found.status == _SOLVED)
