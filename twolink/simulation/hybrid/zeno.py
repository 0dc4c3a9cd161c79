"""The Zeno limit: infinitely many bounces that end within round-off are replaced by rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from twolink.arithmetic import Pair
from twolink.contact.coordinates import JointCoordinate
from twolink.contact.elements import ContactElement
from twolink.contact.states import EventKind
from twolink.errors import IntegrationError
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.collision import sliding_after
from twolink.simulation.hybrid.impact import (
    Impacts,
    Strike,
    is_left_over,
    speed_along,
)
from twolink.simulation.hybrid.mode import Doubt, Mode, Remark, Trigger, doubt_of_change
from twolink.simulation.hybrid.mode_at import solution_at
from twolink.simulation.hybrid.noise import known_at, size_of
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.resolution import ended
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import NO_LEVER


class Past(NamedTuple):
    """The impacts before a jump, and the contacts with very many bounces.

    `last` has the time (s) of the last impact on each contact, by number. `tired` are those whose
    bounces are omitted if they would not end in the `remaining` time (s).
    """

    strikes: Sequence[Strike] = ()
    last: Mapping[int, float] = MappingProxyType({})
    tired: frozenset[int] = frozenset()
    remaining: float = 0.0


NO_PAST = Past()


class LeftOut(NamedTuple):
    """The state in which contacts rest, the impacts that stop them, and the `delay` (s).

    `doubts` and `notes` give the speeds of omitted bounces that would not have ended.
    """

    state: HybridState
    strikes: list[Strike]
    delay: float
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[Remark, ...] = ()


class _Flight(NamedTuple):
    """A bounce: the speeds (m/s or rad/s) at its ends, and the acceleration back, all normal.

    It ends at the speeds of the chain `landing` (rad/s).
    """

    leaves: float
    lands: float
    back: float
    landing: Pair

    @property
    def time(self) -> float:
        """The duration (s), infinity without an acceleration back."""
        return (self.leaves + self.lands) / self.back if self.back > 0 else math.inf


_NO_FLIGHTS: Mapping[int, _Flight] = MappingProxyType({})


def left_out(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    mode: Mode,
    struck: Sequence[Strike],
    past: Past,
    recent: Sequence[Strike],
) -> LeftOut | None:
    """Return the state in which contacts rest whose further bounces are omitted, or None.

    From a speed v and under an acceleration −a bounces take the time 2v/a, e times that, e² times
    that, …: together 2v/a/(1 − e), where e is the ratio of the speeds of the last bounce. Contacts
    that interrupt each other have no such sum: if very many impacts fall into the Zeno time, all
    contacts involved come to rest. Nor do bounces without loss: after very many, if far more would
    follow, the contact comes to rest, and a note says so. `recent` are the impacts of this jump, of
    which those in `struck` are the last.
    """
    crowd = _crowd(system, state, past, recent)
    if crowd:
        _check_energy(system, state, pose, crowd)
        # They need not bounce: a contact that stops another one may open by this, again and again.
        if len(crowd) > tolerances.MOST_IMPACTS_OF_A_BURST:
            return _after_burst(system, state, pose, crowd)
    flying = [strike.number for strike in struck if strike.number not in state.touching]
    if not flying:
        return None
    # A contact with a very recent impact comes to rest with the others.
    flying += [strike.number for strike in crowd]
    now = float(state.t)
    latest = max([past.last.get(index, now) for index in flying])
    if not past.tired and now - latest > tolerances.LONG_FLIGHT * system.scales.zeno_time:
        # Successive bounces do not shorten by so large a factor.
        return None
    flights = {
        index: _flight(system, state, pose, mode, index)
        for index in dict.fromkeys(flying)
        if index not in state.touching
    }
    return _ended(system, state, pose, flights, (*past.strikes, *recent), past)


def _crowd(
    system: HybridSystem, state: HybridState, past: Past, recent: Sequence[Strike]
) -> list[Strike]:
    """Return the impacts within the Zeno time before a state, if there are several."""
    if not past.strikes and len(recent) < 2:
        return []
    begins = float(state.t) - system.scales.zeno_time
    return [strike for strike in (*past.strikes, *recent) if strike.time >= begins]


def _ended(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    flights: dict[int, _Flight],
    strikes: Sequence[Strike],
    past: Past,
) -> LeftOut | None:
    """Return the state after the bounces that end within the Zeno time, or without end; or None."""
    lasting = {
        index: _bounces_last(flight, _ratio(system, strikes, index))
        for index, flight in flights.items()
    }
    dying = [index for index, time in lasting.items() if time <= system.scales.zeno_time]
    if dying:
        last = max(lasting[index] for index in dying)
        return _clamped(system, state, pose, dying, last, flights)
    endless = [
        index
        for index in flights
        if index in past.tired
        and lasting[index] > past.remaining > flights[index].time * tolerances.MOST_JUMPS
    ]
    return _given_up(system, state, pose, {i: flights[i] for i in endless}) if endless else None


def accumulated(
    system: HybridSystem, state: HybridState, pose: Pose, past: Past, recent: Sequence[Strike]
) -> LeftOut | None:
    """Return the state in which the contacts of a burst of impacts rest, or None without a burst.

    Where contacts that answer each other die away together, the last speeds are round-off, and may
    admit no motion that the limit, rest, admits.
    """
    crowd = _crowd(system, state, past, recent)
    if len(crowd) < tolerances.LEAST_IMPACTS_OF_A_BURST:
        return None
    _check_energy(system, state, pose, crowd)
    return _after_burst(system, state, pose, crowd)


def _after_burst(
    system: HybridSystem, state: HybridState, pose: Pose, crowd: Sequence[Strike]
) -> LeftOut:
    """Return the state in which the contacts of a burst of impacts rest.

    A burst that does not die away goes on, as between two stops without loss: its speed is an
    error then, whatever the precision, and a note says so.
    """
    numbers, now = sorted({strike.number for strike in crowd}), float(state.t)
    found = _clamped(system, state, pose, numbers, 0.0)
    (u1, u2), (v1, v2) = state.u, found.state.u
    lost = size_of((float(u1 - v1), float(u2 - v2)))
    impacts = Impacts(pose, system.elements, now, system.rounding)
    if not lost or _dies_away(impacts, crowd):
        return found
    names, _ = impacts.names_and_laws(numbers)
    kind = f"the impacts on {names}"
    sentence = (
        f"From {now:.9g} s on {kind} are left out, with {lost:.1e} rad/s of the chain: "
        f"{len(crowd)} of them follow each other in {now - crowd[0].time:.1e} s and do not die "
        "away."
    )
    # The chain may go either way.
    doubt = doubt_of_change(now, Trigger(EventKind.HITS, numbers[0]), 2 * lost)
    return found._replace(doubts=(doubt,), notes=(Remark(kind, now, sentence, lost),))


def _dies_away(impacts: Impacts, crowd: Sequence[Strike]) -> bool:
    """Return whether the impacts of a burst become weaker, and do not become rarer."""
    energies = [impacts.energy_of_approach(strike.number, strike.u[0]) for strike in crowd]
    part = max(len(crowd) // 3, 1)
    early, late = (crowd[part].time - crowd[0].time, crowd[-1].time - crowd[-1 - part].time)
    return late <= early and max(energies[-part:]) <= tolerances.DYING * max(energies[:part])


def _check_energy(
    system: HybridSystem, state: HybridState, pose: Pose, crowd: Sequence[Strike]
) -> None:
    """Raise `IntegrationError` for a burst of impacts that gains energy: it does not die away.

    That of a single impact is limited where it is resolved.
    """
    if len(crowd) < 2:
        return
    impacts = Impacts(pose, system.elements, float(state.t), system.rounding)
    first, last = impacts.energy(crowd[0].u[0]), impacts.energy(state.u)
    if not last <= tolerances.MOST_ENERGY * first:
        names, laws = impacts.names_and_laws(sorted({strike.number for strike in crowd}))
        raise IntegrationError(
            f"at {float(state.t):.9g} s the last {len(crowd)} impacts, on {names}, are beyond the "
            f"range of their laws ({laws}): the chain, which had {first:.3g} J, has {last:.3g} J"
        )


def _flight(
    system: HybridSystem, state: HybridState, pose: Pose, mode: Mode, index: int
) -> _Flight:
    """Return the bounce from a contact that begins in a state."""
    element = system.elements[index]
    normal = element.normal
    assert normal is not None
    row = pose.row(normal)
    speed, gap = float(speed_along(row, state.u)), state.gaps[index]
    assert gap is not None
    du = solution_at(system, pose, state, mode).du
    back = float(-(speed_along(row, du) + normal.bias(system.chain, state.q, state.u)))
    lands = math.sqrt(max(speed * speed + 2 * back * float(gap), 0.0))
    if back <= 0:
        return _Flight(speed, lands, back, state.u)
    time = (speed + lands) / back
    return _Flight(speed, lands, back, _landing(system, state, pose, element, du, time, lands))


def _landing(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    element: ContactElement,
    du: Pair,
    time: float,
    lands: float,
) -> Pair:
    """Return the speeds (rad/s) that give a point, in this pose, its speeds at the end of a bounce.

    The turning of the chain changes the speeds of the point by as much as its accelerations do.
    """
    assert element.normal is not None
    x, y = pose.row(element.normal)
    u1, u2 = state.u[0] + time * du[0], state.u[1] + time * du[1]
    if element.tangent is not None:
        z, w = pose.row(element.tangent)
        across = x * w - y * z
        if abs(across) > NO_LEVER * (abs(x * w) + abs(y * z)):
            along = z * u1 + w * u2 + time * element.tangent.bias(system.chain, state.q, state.u)
            return (-lands * w - along * y) / across, (x * along + z * lands) / across
    share = (-lands - (x * u1 + y * u2)) / (x * x + y * y)
    return u1 + share * x, u2 + share * y


def _ratio(system: HybridSystem, strikes: Sequence[Strike], index: int) -> float:
    """Return the ratio of the speeds after and before the last bounce on a contact."""
    before, after = next(s.speeds for s in reversed(strikes) if s.number == index)
    if before < 0:
        # In longer precisions a speed may be less than the least float.
        return float(after / -before)
    return float(system.elements[index].restitution)  # type: ignore[attr-defined]


def _bounces_last(flight: _Flight, ratio: float) -> float:
    """Return the duration (s) of all further bounces, infinity if they do not end."""
    if flight.back <= 0 or ratio >= 1:
        return math.inf
    # The flight until it lands, and then all bounces from the landing speed.
    return flight.time + 2 * flight.lands * ratio / (1 - ratio) / flight.back


def _given_up(
    system: HybridSystem, state: HybridState, pose: Pose, flights: dict[int, _Flight]
) -> LeftOut:
    """Return the state in which contacts rest although their bounces would not end."""
    now = float(state.t)
    found = _clamped(system, state, pose, sorted(flights), 0.0, flights)
    # They may grow again, with the load or where the contact opens: their change has no bound.
    doubts = tuple(
        Doubt(now, Trigger(EventKind.HITS, i), f.lands, math.inf, now) for i, f in flights.items()
    )
    notes = tuple(
        Remark(
            f"bounces of {system.names[i]}",
            now,
            f"From {now:.9g} s on the bounces of {system.names[i]} are left out: they follow each "
            f"other every {f.time:.1e} s without end, at {f.lands:.1e} "
            f"{'rad/s' if isinstance(system.elements[i].normal, JointCoordinate) else 'm/s'}.",
        )
        for i, f in flights.items()
    )
    return found._replace(doubts=doubts, notes=notes)


def _clamped(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    indices: Sequence[int],
    delay: float,
    flights: Mapping[int, _Flight] = _NO_FLIGHTS,
) -> LeftOut:
    """Return the state with contacts at rest, and the impacts that stop them."""
    impacts = Impacts(pose, system.elements, float(state.t), system.rounding)
    slides = {
        index: state.sliding[index] or _slides_on(impacts, index, flights.get(index))
        for index in indices
    }
    strikes = ended(impacts, indices, state.u, slides)
    u, gaps = strikes[-1].u[1], state.gaps
    for index in indices:
        gaps = put(gaps, index, system.number(0))
    still = {
        i
        for i in state.touching
        if not system.elements[i].rigid or _rests(system, pose, i, state.u, u)
    }
    sliding = sliding_after(system, pose, state.u, u, known_at(state.t, system.rounding))
    touching = frozenset({*indices, *still})
    state = state._replace(u=u, gaps=gaps, touching=touching, sliding=sliding)
    return LeftOut(state, strikes, delay)


def _slides_on(impacts: Impacts, index: int, flight: _Flight | None) -> int:
    """Return the direction in which a point slides after its next bounce, 0 if it sticks.

    All further bounces are alike. Near a singular pose a point that sticks in one impact may slide
    in all that follow, as their impulses are too small to stop the chain.
    """
    if flight is None or impacts.contact(index).tangent is None:
        return 0
    strike = impacts.impact(index, flight.landing)
    _, after = strike.sliding
    return 0 if strike.impulse.regime.ends_sticking or after == 0 else 1 if after > 0 else -1


def _rests(system: HybridSystem, pose: Pose, index: int, before: Pair, u: Pair) -> bool:
    """Return whether the speed along a contact is zero within round-off of its earlier value."""
    normal = system.elements[index].normal
    assert normal is not None
    return is_left_over(pose.row(normal), u, before, system.rounding)
