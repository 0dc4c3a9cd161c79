"""Impact resolution: the impacts of all approached contacts, one after the other."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from twolink.arithmetic import Pair
from twolink.errors import IntegrationError
from twolink.simulation.hybrid.constraint import parallel
from twolink.simulation.hybrid.dynamics import MOST_CONSTRAINTS
from twolink.simulation.hybrid.impact import (
    Impacts,
    Strike,
    approach,
    at_rest,
    is_left_over,
    largest,
    stopped,
)
from twolink.simulation.hybrid.tolerances import MOST_ENERGY, MOST_IMPACTS, NO_REBOUND, UNDECIDED

_STICKING: Mapping[int, int] = MappingProxyType({})


class Resolution(NamedTuple):
    """The speeds u (rad/s) after impacts, the impacts, and the contacts that end at rest."""

    u: Pair
    strikes: tuple[Strike, ...]
    resting: frozenset[int]


def resolve(
    impacts: Impacts, u: Pair, contacts: Collection[int], resting: Collection[int]
) -> Resolution:
    """Return the speeds after the impacts of all approached contacts.

    Impacts are sequential, that with the most energy of approach first, until no contact is
    approached any more. `resting` has those contacts whose normal speed is zero exactly. Raises
    `IntegrationError` where a law is out of its range.
    """
    rounding, lever = impacts.rounding, impacts.pose.lever
    strikes: list[Strike] = []
    rows: dict[int, Pair] = {}
    still: set[int] = set()
    for index in contacts:
        row = rows[index] = impacts.row(index)
        if index in resting or at_rest(row, u, rounding, lever):
            still.add(index)
    before = u
    for _ in range(MOST_IMPACTS):
        if strikes:
            for index, row in rows.items():
                if is_left_over(row, u, before, rounding):
                    still.add(index)
        if strikes and still:
            if _is_lost(impacts, still, u, before):
                strikes += ended(impacts, sorted(still), u)
            normals = [impacts.contact(i).normal for i in sorted(still)]
            u = stopped(impacts.pose, normals, u, rounding)
        approached = [
            i for i, row in rows.items() if i not in still and approach(row, u, rounding, lever)
        ]
        if not approached:
            return Resolution(u, tuple(strikes), frozenset(still))
        index = strongest(impacts, approached, u)
        strike = impacts.impact(index, u)
        _refuse_energy(impacts, strike, before)
        strikes.append(strike)
        u = strike.u[1]
        if still:
            still = {i for i in still if i != index and at_rest(rows[i], u, rounding, lever)}
        if abs(strike.speeds[1]) <= NO_REBOUND * rounding * abs(strike.speeds[0]):
            still.add(index)
    return _in_limit(impacts, strikes, rows)


def _in_limit(impacts: Impacts, strikes: Sequence[Strike], rows: Mapping[int, Pair]) -> Resolution:
    """Return the limit of repeated impacts between contacts: all of those come to rest.

    Raises `IntegrationError` if the impacts have not become weaker.
    """
    before, struck = strikes[0].u[0], sorted({strike.number for strike in strikes})
    _refuse_growth(impacts, struck, before, strikes[-1].u[1])
    every = (*strikes, *ended(impacts, struck, strikes[-1].u[1]))
    u = every[-1].u[1]
    still = {i for i, row in rows.items() if is_left_over(row, u, before, impacts.rounding)}
    return Resolution(u, every, frozenset(still))


def strongest(impacts: Impacts, approached: Sequence[int], u: Pair) -> int:
    """Return the contact with the most energy of approach v²/(2 G).

    G is the change of the normal speed v by a unit of normal impulse. Unlike speeds, energies of
    joint stops and of surfaces have one unit. Of equal ones that with the least restitution is
    taken, and then the first by name, so that the order of the effects does not count.
    """
    if len(approached) == 1:
        return approached[0]
    energies = {index: impacts.energy_of_approach(index, u) for index in approached}
    least = (1 - UNDECIDED * impacts.rounding) * max(energies.values())
    equal = [impacts.contact(index) for index, energy in energies.items() if energy >= least]
    taken = min(equal, key=lambda contact: (contact.restitution, contact.name))
    return next(index for index in energies if impacts.contact(index) is taken)


def ended(
    impacts: Impacts, indices: Sequence[int], u: Pair, sliding: Mapping[int, int] = _STICKING
) -> list[Strike]:
    """Return the impacts that bring contacts to rest whose further bounces are omitted.

    Two independent contacts bring the chain to rest; `sliding` has the directions at the contacts
    along which a point slides on.
    """
    first = indices[0]
    for second in indices[1:]:
        if not parallel(impacts.row(first), impacts.row(second), impacts.pose.lever):
            return impacts.both_ended(first, second, u)
    return [impacts.clamped(first, u, sliding.get(first, 0))]


def _is_lost(impacts: Impacts, still: Collection[int], u: Pair, before: Pair) -> bool:
    """Return whether contacts at rest stop a motion of the chain that exceeds round-off.

    Two nearly parallel rows leave a motion across them that round-off hides.
    """
    if len(still) < MOST_CONSTRAINTS:
        return False
    rows = [impacts.row(index) for index in sorted(still)]
    fast = largest(u) > UNDECIDED * impacts.rounding * largest(before)
    return bool(fast) and any(not parallel(rows[0], row, impacts.pose.lever) for row in rows[1:])


def _refuse_energy(impacts: Impacts, strike: Strike, before: Pair) -> None:
    """Raise `IntegrationError` if a law of restitution is far outside its range.

    An impact may give too much energy at once, or several in turn, since the speeds `before`, ever
    more. Without friction every law takes energy, as no coefficient of restitution is above 1.
    """
    if impacts.contact(strike.number).tangent is None:
        return
    late, early = impacts.energy(strike.u[1]), impacts.energy(strike.u[0])
    begun = early if before is strike.u[0] else impacts.energy(before)
    if not late <= MOST_ENERGY * min(early, begun):
        law = impacts.contact(strike.number).law
        at_once = not late <= MOST_ENERGY * early
        cause = "near a singular pose it" if at_once else "after others at this instant it"
        raise IntegrationError(
            f"at {strike.time:.9g} s the impact on {strike.name} is beyond the range of its law "
            f"({law}): {cause} would give the chain {late:.3g} J, which had "
            f"{early if at_once else begun:.3g} J"
        )


def _refuse_growth(impacts: Impacts, struck: Sequence[int], before: Pair, u: Pair) -> None:
    """Raise `IntegrationError` for impacts that answer each other and do not become weaker."""
    first, last = impacts.energy(before), impacts.energy(u)
    if last < first:
        return
    names, laws = impacts.names_and_laws(struck)
    raise IntegrationError(
        f"at {impacts.time:.9g} s impacts on {names} answer each other without end, beyond the "
        f"range of their laws ({laws}): the chain, which had {first:.3g} J, has {last:.3g} J"
    )
