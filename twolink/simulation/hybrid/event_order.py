"""The order of events at one instant, where it is within the error of a run.

A slide that comes to rest, a static limit that is reached and loads that jump change the forces on
all elements at once. Where static friction is above kinetic friction the motion may depend on which
of them is the first: an element that has begun to slide is held less than one that has not. So the
events that come next after the one that ends an arc are taken in every other order as well. Where
that leads to another motion, the distance of the events is a doubt.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations
from typing import NamedTuple

from twolink.contact.states import EventKind
from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.ends_of_events import Ends
from twolink.simulation.hybrid.mode import Doubt, Mode, Trigger
from twolink.simulation.hybrid.replayed_order import (
    LOADS,
    Instant,
    Switch,
    are_alike,
    bound_slides,
    followed,
)
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import CLOSING, MOST_TOGETHER

_KINDS = (EventKind.STOPS, EventKind.BREAKS)

_INFINITE = math.inf


class _Next(NamedTuple):
    """An event that comes next: it is the first if the error of an angle is `within` (rad)."""

    trigger: Trigger | None
    within: float


def doubts_on_order(
    system: HybridSystem,
    arc: Arc,
    switch: Switch | None,
    touched: Sequence[Doubt] = (),
    *,
    judges: bool = True,
) -> tuple[Doubt, ...]:
    """Return the doubts on events at the end of an arc, where the motion depends on their order.

    The arc ends by its event or, without one, by the `switch`, which otherwise may follow. Doubts
    that last until there have `touched` zero: they are on the order as well, but those on whether
    the event that ends the arc comes at all. A run that `judges` no other has doubts only on events
    that coincide.
    """
    cause = LOADS if arc.event is None else arc.event
    if cause is not None and cause.kind not in _KINDS:
        return tuple(touched)
    hysteretic = any(element.hysteretic for element in system.elements)
    if not hysteretic or not _lasts(arc):
        # In an arc without a duration the events are those next after the arc before.
        return tuple(touched)
    # A function that stays zero within its error just until it falls has not passed zero.
    end = math.nextafter(float(arc.end.t), _INFINITE)
    own = tuple(doubt for doubt in touched if doubt.trigger == cause and doubt.until > end)
    coming = _following if judges else _coinciding
    following = sorted(coming(system, arc, switch, touched), key=lambda each: each.within)
    return own + _on_order(system, arc, switch, following)


def _lasts(arc: Arc) -> bool:
    """Return whether an arc has a duration."""
    return bool(arc.blocks) and bool(arc.step_count > 1 or arc.blocks[0].lengths[0] > 0)


def _on_order(
    system: HybridSystem, arc: Arc, switch: Switch | None, following: Sequence[_Next]
) -> tuple[Doubt, ...]:
    """Return doubts on the order of more and more events at the end of an arc, the next ones first.

    Events that coincide are taken in every order at once, and the others where an error of the run
    turns out to reach them.
    """
    cause, now = arc.event, float(arc.end.t)
    found: list[Doubt] = []
    for count in range(1, min(len(following), MOST_TOGETHER - 1) + 1):
        last = following[count - 1]
        order = _Order(system, arc, (cause, *(each.trigger for each in following[:count])), switch)
        named = last.trigger or cause
        assert named is not None
        doubt = Doubt(now, named, _INFINITE, _INFINITE, now, last.within, order.matters)
        if last.within:
            found.append(doubt)
        elif order.matters():
            return (doubt,)
    return tuple(found)


@dataclass(frozen=True)
class _Order:
    """Events at the end of an arc, whose order may matter; `None` among them are the loads."""

    system: HybridSystem
    arc: Arc
    events: tuple[Trigger | None, ...]
    switch: Switch | None

    def matters(self) -> bool:
        """Return whether the events in another order lead to another motion."""
        return self._depends

    @cached_property
    def _depends(self) -> bool:
        instant = Instant.of(self.system, self.arc, self.events, self.switch)
        outcomes = (followed(instant, order) for order in permutations(self.events))
        first = next(outcomes)
        return any(not are_alike(first, other) for other in outcomes)


def _following(
    system: HybridSystem, arc: Arc, switch: Switch | None, touched: Sequence[Doubt]
) -> Iterator[_Next]:
    """Yield the events that come next after that at the end of an arc."""
    near = {doubt.trigger: doubt.within for doubt in touched}
    ends = Ends(system, arc)
    for trigger in _others(system, arc, ends):
        within = min(ends.within(trigger, arc.event), near.get(trigger, _INFINITE))
        if within <= CLOSING:
            yield _Next(trigger, within)
    if arc.event is not None and switch is not None:
        within = ends.within_time(arc.event, float(switch.time - arc.end.t))
        if within <= CLOSING:
            yield _Next(LOADS, within)


def _coinciding(
    system: HybridSystem, arc: Arc, switch: Switch | None, touched: Sequence[Doubt]
) -> Iterator[_Next]:
    """Yield the events that coincide with that at the end of an arc, within round-off."""
    near = {doubt.trigger for doubt in touched if not doubt.within}
    ends = Ends(system, arc)
    for trigger in _others(system, arc, ends):
        if trigger in near or ends.arrives(trigger):
            yield _Next(trigger, 0.0)
    if arc.event is None or switch is None:
        return
    if ends.is_at(arc.event, float(switch.time - arc.end.t)):
        yield _Next(LOADS, 0.0)


def _others(system: HybridSystem, arc: Arc, ends: Ends) -> Iterator[Trigger]:
    """Yield the events that may change the forces beside that at the end of an arc."""
    together = _stopping_together(system, arc.mode, arc.event)
    for trigger in ends.triggers:
        if trigger.kind in _KINDS and trigger not in (arc.event, *together):
            yield trigger


def _stopping_together(system: HybridSystem, mode: Mode, event: Trigger | None) -> list[Trigger]:
    """Return the ends of slides that are one event with another such end, by the constraints."""
    if event is None or event.kind is not EventKind.STOPS:
        return []
    bound = bound_slides(system, mode, event.index)
    return [Trigger(EventKind.STOPS, index, mode.slides[index]) for index in bound]
