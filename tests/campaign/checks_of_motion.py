"""Checks of the motion as a whole: its equations, its jumps, its energy and its work."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from tests.campaign.energy import energy, is_passive, may_store_unseen
from tests.campaign.seen import CUSHION, Seen
from tests.campaign.verdict import Verdict, worst
from twolink import lagrange

# The longest step of a finite difference (s), and the shortest at which it says anything.
_STEP, _SHORTEST = 2e-4, 1e-8

# Events nearer to each other than this (s) are looked at together.
_TOGETHER = 1e-9

# Of more events than this some are looked at, evenly spread.
_MOST_JUMPS = 400

# Vibrations on a stiff cushion may be lost between the nodes of `work`.
_VIBRATION = 1e-4


def samples_agree(seen: Seen) -> Verdict:
    """Return whether the samples begin at the start and are the values of `at`, but at events."""
    run = seen.trajectory
    now = (run.t <= seen.until) & (seen.distance(run.t) > seen.shortest)
    q, u = run.at(run.t[now])
    moved = float(np.abs(run.q[:, 0] - np.array(seen.scene.q)).max())
    if moved > seen.slack:
        return f"q at the start is {moved:.3g} rad from that of the scene"
    off = np.abs(np.concatenate([q - run.q[:, now], u - run.u[:, now]])).max(axis=0, initial=0.0)
    allowed = seen.slack * (1 + np.abs(u).max(axis=0, initial=0.0))
    return worst(seen, "at(t)", off, allowed, "differs from the samples by", t=run.t[now])


def _smooth_times(seen: Seen) -> tuple[Any, Any]:
    """Return times (s) far enough from all events for finite differences, and the step for each."""
    rng = np.random.default_rng(0)
    edges = np.append(seen.moments[seen.moments < seen.until], seen.until)
    if len(edges) > 80:
        chosen = rng.choice(len(edges) - 1, 80, replace=False)
    else:
        chosen = np.arange(len(edges) - 1)
    width = np.diff(edges)[chosen]
    inside = edges[chosen] + width * rng.uniform(0.1, 0.9, (3, len(chosen)))
    times = np.sort(np.concatenate([rng.uniform(0, seen.until, 80), inside.ravel()]))
    room = np.minimum(seen.distance(times), seen.until - times)
    step = np.minimum(_STEP, 0.2 * room)
    good = step > _SHORTEST
    return times[good], step[good]


class Slopes(NamedTuple):
    """Times t (s), the state there, and dq/dt and du/dt with their errors, of shape (4, n)."""

    t: Any
    q: Any
    u: Any
    slopes: Any
    error: Any


@lru_cache(maxsize=2)
def _slopes(seen: Seen, part: float) -> Slopes:
    """Return the rates by differences of fourth order over a part of the step, away from events.

    Half the step gives the value; the change from the whole step, and rounding, give the error.
    """
    t, h = _smooth_times(seen)
    h = part * h
    places = [t + k * h / 2 for k in (-4, -2, 2, 4, -1, 1, 0)]
    states = np.concatenate(seen.trajectory.at(np.concatenate(places)))
    a, b, c, d, e, f, here = np.split(states, len(places), axis=1)
    coarse = (a - 8 * b + 8 * c - d) / (12 * h)
    fine = (b - 8 * e + 8 * f - c) / (6 * h)
    noise = (1e-13 * (1 + np.abs(here)) + 1e-4 * seen.slack) / h
    return Slopes(t, here[:2], here[2:], fine, 10 * np.abs(fine - coarse) + noise)


# A vibration that is faster than the step of a difference deceives the estimate of its error, and
# shorter steps have more rounding: a law is violated if it is by both.
_PARTS = (1.0, 1 / 16)


def rates_are_speeds(seen: Seen) -> Verdict:
    """Return whether dq/dt is u, to the accuracy and the error of the difference."""
    found = [_speed_error(seen, _slopes(seen, part)) for part in _PARTS]
    return worst(seen, "q' - u", *_least(found), "is", t=_slopes(seen, 1.0).t)


def _speed_error(seen: Seen, found: Slopes) -> tuple[Any, Any]:
    off = np.abs(found.slopes[:2] - found.u)
    allowed = found.error[:2] + 2 * seen.slack * (1 + np.abs(found.u))
    return _widest(off, allowed)


def equations_hold(seen: Seen) -> Verdict:
    """Return whether M u' + C u is the sum of all effects and contact forces."""
    found = [_force_error(seen, _slopes(seen, part)) for part in _PARTS]
    return worst(seen, "M u' + C u - Q", *_least(found), "is (N m)", t=_slopes(seen, 1.0).t)


def _force_error(seen: Seen, found: Slopes) -> tuple[Any, Any]:
    t, q, u, slopes, error = found
    normal, tangential = seen.forces_at(t)
    given, _ = seen.smooth_force(q, u, t)
    given = given + seen.generalized(q, normal, tangential).sum(axis=0)
    M = _mass_matrix(seen, q)
    terms = np.array(lagrange.velocity_terms(seen.chain, (q[0], q[1]), (u[0], u[1])))
    inertia = M[:, 0] * slopes[2] + M[:, 1] * slopes[3]
    off = np.abs(inertia + terms - given)
    unsure = np.abs(M[:, 0]) * error[2] + np.abs(M[:, 1]) * error[3]
    size = seen.size_at(q, u, t, normal, tangential)
    allowed = unsure + (1e-6 + 10 * seen.slack) * size + 1e-11
    return _widest(off, allowed)


def _least(found: list[tuple[Any, Any]]) -> tuple[Any, Any]:
    """Return the error that exceeds least, at each time, and its allowed value."""
    offs, allowed = (np.array(rows) for rows in zip(*found, strict=True))
    row, column = np.argmin(offs / allowed, axis=0), np.arange(offs.shape[1])
    return offs[row, column], allowed[row, column]


def _mass_matrix(seen: Seen, q: Any) -> Any:
    """Return M (kg m²) at angles q of shape (2, n), as an array of shape (2, 2, n)."""
    rows = lagrange.mass_matrix(seen.chain, (q[0], q[1]))
    return np.array([[entry + 0 * q[0] for entry in row] for row in rows])


def _widest(off: Any, allowed: Any) -> tuple[Any, Any]:
    """Return the row that exceeds most, at each time, and its allowed value."""
    row = (off / allowed).argmax(axis=0)
    columns = np.arange(off.shape[1])
    return off[row, columns], allowed[row, columns]


# The places at which forces are evaluated between two sides of an event.
_PLACES_BETWEEN = 17


def jumps_are_impacts(seen: Seen) -> Verdict:
    """Return whether u jumps by the logged impulses and not otherwise: M Δu = Σ Jᵀ Λ.

    Allowed besides are the impulses of forces between the two sides, and the turning of the
    impulses' directions meanwhile, or by the error of q: near a singular pose a large impulse has
    little effect.
    """
    moments = seen.moments[seen.moments < seen.until - 10 * _TOGETHER]
    if not len(moments):
        return None
    edges = np.flatnonzero(np.diff(moments) > 4 * _TOGETHER)
    first = moments[np.concatenate([[0], edges + 1]).astype(int)] - _TOGETHER
    last = moments[np.concatenate([edges, [len(moments) - 1]]).astype(int)] + _TOGETHER
    if len(first) > _MOST_JUMPS:
        chosen = np.linspace(0, len(first) - 1, _MOST_JUMPS).astype(int)
        first, last = first[chosen], last[chosen]
    _, before = seen.trajectory.at(np.maximum(first, 0.0))
    q, after = seen.trajectory.at(last)
    before[:, first < 0] = np.array(seen.scene.u)[:, None]
    impulse, sizes = _impulses(seen, first, last, q)
    M = _mass_matrix(seen, q)
    # Forces that grow without bound do much in a moment: then the limits at the event count.
    _, limit = seen.trajectory.at(np.maximum(first + _TOGETHER, 0.0), side="left")
    off = np.minimum(
        *(
            np.abs(M[:, 0] * (after - u)[0] + M[:, 1] * (after - u)[1] - impulse)
            for u in (before, limit)
        )
    )
    # Where impacts follow each other, forces may be larger between them than at both ends.
    shares = np.linspace(0, 1, _PLACES_BETWEEN)
    force = np.max(
        [_size(seen, np.maximum(first + x * (last - first), 0.0)) for x in shares], axis=0
    )
    inertia, speed = (
        np.abs(M).sum(axis=(0, 1)),
        np.abs(before).max(axis=0) + np.abs(after).max(axis=0),
    )
    meanwhile = 4 * (last - first) * (force + (1 + speed) * sizes)
    unsure = inertia * (4 * seen.slack + 1e-8 * speed) + (4 * seen.slack + 1e-8) * sizes
    allowed = meanwhile + unsure
    where = "at an event beyond its impulses (N m s)"
    return worst(seen, "u jumps", off.max(axis=0), allowed, where, t=first + _TOGETHER)


def _size(seen: Seen, times: Any) -> Any:
    """Return the size of all generalized forces (N m) at times (s)."""
    q, u = seen.trajectory.at(times)
    normal, tangential = seen.forces_at(times)
    return seen.size_at(q, u, times, normal, tangential)


def _impulses(seen: Seen, first: Any, last: Any, q: Any) -> tuple[Any, Any]:
    """Return the generalized impulses of the impacts between times, and their sizes (N m s)."""
    lever = float(seen.chain.L1 + seen.chain.L2)
    by_name = {element.name: element for element in seen.elements}
    total, sizes = np.zeros_like(q), np.zeros(q.shape[1])
    for impact in seen.trajectory.impacts:
        place = int(np.searchsorted(first, impact.time, side="right")) - 1
        if place < 0 or impact.time > last[place]:
            continue
        element, pose = by_name[impact.name], q[:, place : place + 1]
        parts = [impact.normal_impulse * element.way.row(seen.chain, pose)[:, 0]]
        if element.tangent is not None:
            parts.append(impact.tangential_impulse * element.tangent.row(seen.chain, pose)[:, 0])
        total[:, place] += sum(parts)
        pushes = abs(impact.normal_impulse) + abs(impact.tangential_impulse)
        sizes[place] += pushes * max(lever, 1.0)
    return total, sizes


def energy_never_grows(seen: Seen) -> Verdict:
    """Return whether a passive scene never gains energy, by more than errors of the state."""
    if not is_passive(seen) or len(seen.t) == 0:
        return None
    E, parts = energy(seen)
    momentum = np.abs(_mass_matrix(seen, seen.q)).sum(axis=(0, 1)) * np.abs(seen.u).max(axis=0)
    allowed = 4 * seen.slack * (momentum + seen.size) + 1e-10 * parts + 1e-14
    trusted = np.ones(len(E), dtype=bool) if not may_store_unseen(seen) else _all_free(seen)
    before = np.where(trusted, E + allowed, np.inf)
    lowest = np.minimum.accumulate(before)
    gain = np.where(np.isfinite(lowest), E - lowest, -1.0)
    return worst(seen, "T + V", gain, allowed, "has grown by (J)")


def _all_free(seen: Seen) -> Any:
    """Return the times at which no cushion that yields is pressed: it may store energy."""
    free = np.ones(len(seen.t), dtype=bool)
    for i, element in enumerate(seen.elements):
        if element.yields:
            free &= seen.states(i) == "OPEN"
    return free


def work_balances(seen: Seen) -> Verdict:
    """Return whether the works of all effects sum up to the change of T since the start."""
    run = seen.trajectory
    works = run.work()
    start = lagrange.kinetic_energy(seen.chain, seen.scene.q, seen.scene.u)
    change = run.kinetic_energy - start
    total = sum(works.values(), np.zeros_like(run.t))
    size = np.maximum.accumulate(run.kinetic_energy + sum(map(np.abs, works.values())) + start)
    now = (run.t <= seen.until) & ((seen.distance(run.t) > seen.shortest) | (run.t > 0))
    part = max(1e3 * seen.slack + 1e-8, _VIBRATION if seen.of_kind(CUSHION) else 0.0)
    off, allowed = np.abs(change - total), part * size + 1e-12
    return worst(seen, "work less T", off[now], allowed[now], "is (J)", t=run.t[now])


MOTION: dict[str, Callable[[Seen], Verdict]] = {
    "samples": samples_agree,
    "q' = u": rates_are_speeds,
    "equations of motion": equations_hold,
    "jump": jumps_are_impacts,
    "energy": energy_never_grows,
    "work": work_balances,
}
