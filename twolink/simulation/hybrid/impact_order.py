"""The order of simultaneous impacts, which the laws of impact do not determine.

If another order leads to other speeds, the choice is noted. Contacts that close one after the other
within the error of a run may have closed in the other order: that is a doubt.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

from twolink.arithmetic import Pair
from twolink.contact.states import EventKind
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.impact import Impacts, approach, largest
from twolink.simulation.hybrid.mode import Doubt, Remark, Trigger
from twolink.simulation.hybrid.noise import known_at
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.resolution import Resolution, strongest
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem

# The part of the largest speed above which the change by another order is noted.
_NOTED = tolerances.NOTED * PRECISIONS["double"].rounding

# Impacts of a sequence by which another order is compared.
_IMPACTS = 4


class Rival(NamedTuple):
    """A contact that may have been struck first: its number, its speed, and its gap.

    The speed (rad/s or m/s) is that of its approach before the impacts, and the gap (rad or m) is 0
    for one that takes part in them.
    """

    number: int
    speed: float
    gap: float


def rivals(
    system: HybridSystem, state: HybridState, pose: Pose, near: Collection[int]
) -> Sequence[Rival]:
    """Return the contacts that are approached and closed, or that close very soon.

    `near` are those whose gap is zero within round-off.
    """
    found: list[Rival] = []
    for index, _ in system.scales.near:
        gap, normal = state.gaps[index], system.elements[index].normal
        if gap is None or normal is None or index in state.touching:
            continue
        if gap > tolerances.CLOSING * system.scales.sizes[index] and index not in near:
            continue
        speed = approach(
            pose.row(normal), state.u, known_at(state.t, system.rounding), system.scales.lever
        )
        if speed:
            found.append(Rival(index, float(speed), 0.0 if index in near else float(gap)))
    return found


def choices(
    system: HybridSystem,
    state: HybridState,
    impacts: Impacts,
    near: Collection[int],
    found: Resolution,
) -> tuple[tuple[Doubt, ...], tuple[Remark, ...]]:
    """Return the doubts and the remarks on the order of the impacts that were `found`."""
    doubts, remarks = _of_the_first(system, state, impacts, near, found.strikes[0].number)
    return doubts, (*remarks, *_of_later_ones(system, state, impacts, near, found))


def _of_the_first(
    system: HybridSystem,
    state: HybridState,
    impacts: Impacts,
    near: Collection[int],
    first: int,
) -> tuple[tuple[Doubt, ...], tuple[Remark, ...]]:
    """Return the doubts and the remarks on the first impact, on the contact `first`."""
    others = rivals(system, state, impacts.pose, near)
    if len(others) < 2:
        return (), ()
    rows = {rival.number: impacts.row(rival.number) for rival in others}
    own = next(rival for rival in others if rival.number == first)
    doubts: list[Doubt] = []
    remarks: list[Remark] = []
    for rival in others:
        if rival.number == first:
            continue
        contacts = [i for i in {*near, rival.number} if i not in state.touching]
        change = _change(impacts, contacts, state.u, (first, rival.number))
        if rival.number in near:
            if change > _NOTED * float(largest(state.u)):
                remarks.append(_remark(system, state, (first, rival.number), change))
            continue
        if not change > tolerances.SATURATED:
            # Small changes are those of bounces that die away: their gaps, which are variables, are
            # known relative to themselves, and two runs show another order.
            continue
        # The error of an angle (rad) by which the gaps close in the other order.
        share = abs(rival.speed / own.speed)
        within = rival.gap / float(largest(rows[rival.number]) + share * largest(rows[first]))
        trigger = Trigger(EventKind.HITS, rival.number)
        now = float(state.t)
        doubts.append(Doubt(now, trigger, abs(rival.speed), change, now, within))
    return tuple(doubts), tuple(remarks)


def _of_later_ones(
    system: HybridSystem,
    state: HybridState,
    impacts: Impacts,
    near: Collection[int],
    found: Resolution,
) -> Iterator[Remark]:
    """Yield the remarks on later impacts, of contacts that those before let approach."""
    known: set[frozenset[int]] = set()
    for strike in found.strikes[1:_IMPACTS]:
        u, own = strike.u[0], strike.number
        for other in near:
            pair = frozenset((own, other))
            if len(pair) < 2 or pair in known or not impacts.approach(other, u):
                continue
            known.add(pair)
            change = _change(impacts, near, u, (own, other))
            if change > _NOTED * float(largest(state.u)):
                yield _remark(system, state, (own, other), change)


def _change(impacts: Impacts, contacts: Collection[int], u: Pair, pair: tuple[int, int]) -> float:
    """Return the change of u (rad/s) if the second of a pair is struck first; it may be infinite.

    Further impacts are on `contacts`.
    """
    (one, two), (three, four) = (_speeds_after(impacts, contacts, u, number) for number in pair)
    change = float(largest((one - three, two - four)))
    return change if math.isfinite(change) else math.inf


def _speeds_after(impacts: Impacts, contacts: Collection[int], u: Pair, first: int) -> Pair:
    """Return u (rad/s) after the first impacts of a sequence that begins with a contact.

    Later ones are weaker, and would take longer than the motion itself where bounces die away.
    """
    approached: list[int] = [first]
    for _ in range(_IMPACTS):
        index = strongest(impacts, approached, u)
        u = impacts.impact(index, u).u[1]
        approached = [i for i in contacts if impacts.approach(i, u)]
        if not approached:
            break
    return u


def _remark(
    system: HybridSystem, state: HybridState, pair: tuple[int, int], change: float
) -> Remark:
    """Return the remark on two simultaneous impacts, on the first of a pair and on the second."""
    first, second = (system.names[number] for number in pair)
    choice = f"the order of simultaneous impacts ({first}, {second})"
    now = float(state.t)
    return Remark(
        choice,
        now,
        f"At {now:.9g} s the laws of impact do not determine {choice}: {first} is struck first; "
        f"the other order changes u by {change:.3g} rad/s.",
        change,
    )
