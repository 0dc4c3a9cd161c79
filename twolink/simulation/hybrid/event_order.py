"""The order of events at one instant, where it is within the error of a run.

A slide that comes to rest, a static limit that is reached and loads that jump change the forces on
all elements at once. Where static friction is above kinetic friction the motion may depend on which
of them is the first: an element that has begun to slide is held less than one that has not. So the
events that come next after the one that ends an arc are taken in every other order as well. Where
that leads to another motion, the distance of the events is a doubt.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations
from types import MappingProxyType
from typing import Any, NamedTuple

from twolink.arithmetic import Pair
from twolink.contact.coordinates import ConstraintCoordinate
from twolink.contact.states import ContactState, EventKind, pressed, slipping
from twolink.simulation.hybrid.bernstein import rounding_bound
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.certificate import Certificate
from twolink.simulation.hybrid.complementarity import States
from twolink.simulation.hybrid.doubts import StepOfArc
from twolink.simulation.hybrid.dynamics import MOST_CONSTRAINTS, is_fixed
from twolink.simulation.hybrid.event_functions import Surfaces, value
from twolink.simulation.hybrid.flow import Arc
from twolink.simulation.hybrid.impact import stopped
from twolink.simulation.hybrid.mode import Doubt, Mode, Trigger
from twolink.simulation.hybrid.mode_at import solution_at
from twolink.simulation.hybrid.polishing import horner
from twolink.simulation.hybrid.select import select
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import (
    CLOSING,
    DIFFERENCE,
    FLAT,
    MOST_TOGETHER,
    NEAR_LIMIT,
    SAME_LIMIT,
    SAME_MOTION,
)

_KINDS = (EventKind.STOPS, EventKind.BREAKS)

# Loads that jump, among events.
_LOADS = None

_INFINITE = math.inf


class Switch(NamedTuple):
    """A jump of the loads at a time (s), and the system after it."""

    time: Any
    system: HybridSystem


class _Next(NamedTuple):
    """An event that comes next: it is the first if the error of an angle is `within` (rad)."""

    trigger: Trigger | None
    within: float


def doubts_on_order(
    system: HybridSystem, arc: Arc, switch: Switch | None, touched: Sequence[Doubt] = ()
) -> tuple[Doubt, ...]:
    """Return the doubts on events at the end of an arc, where the motion depends on their order.

    The arc ends by its event or, without one, by the `switch`, which otherwise may follow. Doubts
    that last until there have `touched` zero: they are on the order as well, but those on whether
    the event that ends the arc comes at all.
    """
    cause = _LOADS if arc.event is None else arc.event
    if cause is not None and cause.kind not in _KINDS:
        return tuple(touched)
    hysteretic = any(element.hysteretic for element in system.elements)
    if not hysteretic or not _lasts(arc):
        # In an arc without a duration the events are those next after the arc before.
        return tuple(touched)
    # A function that stays zero within its error just until it falls has not passed zero.
    end = math.nextafter(float(arc.end.t), _INFINITE)
    own = tuple(doubt for doubt in touched if doubt.trigger == cause and doubt.until > end)
    return own + _on_order(system, arc, switch, touched)


def _lasts(arc: Arc) -> bool:
    """Return whether an arc has a duration."""
    return bool(arc.blocks) and bool(arc.step_count > 1 or arc.blocks[0].lengths[0] > 0)


def _on_order(
    system: HybridSystem, arc: Arc, switch: Switch | None, touched: Sequence[Doubt]
) -> tuple[Doubt, ...]:
    """Return doubts on the order of more and more events at the end of an arc.

    Events that coincide are taken in every order at once, and the others where an error of the run
    turns out to reach them.
    """
    cause, now = arc.event, float(arc.end.t)
    following = sorted(_following(system, arc, switch, touched), key=lambda each: each.within)
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
        instant = _Instant.of(self.system, self.arc, self.events, self.switch)
        courses = (_followed(instant, order) for order in permutations(self.events))
        first = next(courses)
        return any(not _are_alike(first, other) for other in courses)


def _following(
    system: HybridSystem, arc: Arc, switch: Switch | None, touched: Sequence[Doubt]
) -> Iterator[_Next]:
    """Yield the events that come next after that at the end of an arc."""
    near = {doubt.trigger: doubt.within for doubt in touched}
    ends = _Ends(system, arc)
    own = 0.0 if arc.event is None else ends.uncertainty(arc.event)
    together = _stopping_together(system, arc.mode, arc.event)
    for trigger in ends.triggers:
        if trigger in (arc.event, *together) or trigger.kind not in _KINDS:
            continue
        within = ends.within(trigger, own)
        if trigger in near:
            within = min(within, near[trigger])
        if within <= CLOSING:
            yield _Next(trigger, within)
    if arc.event is not None and switch is not None:
        within = ends.within_time(arc.event, float(switch.time - arc.end.t))
        if within <= CLOSING:
            yield _Next(_LOADS, within)


def _stopping_together(system: HybridSystem, mode: Mode, event: Trigger | None) -> list[Trigger]:
    """Return the ends of slides that are one event with another such end, by the constraints."""
    if event is None or event.kind is not EventKind.STOPS:
        return []
    bound = _bound_slides(system, mode, event.index)
    return [Trigger(EventKind.STOPS, index, mode.slides[index]) for index in bound]


def _bound_slides(system: HybridSystem, mode: Mode, index: int) -> list[int]:
    """Return the elements that slide as long as another one does, as a mode holds the chain."""
    tangent = system.tangents[index]
    assert tangent is not None
    held = [*system.held(mode.states), tangent]
    return [
        other
        for other, (own, direction) in enumerate(zip(system.tangents, mode.slides, strict=True))
        if direction and own is not None and is_fixed(own, held, system.scene_chain)
    ]


class _End(NamedTuple):
    """An event function at the end of an arc: its value, its rate of fall (1/s), its round-off."""

    left: float
    fall: float
    rounding: float


class _Ends:
    """The event functions at the end of an arc."""

    def __init__(self, system: HybridSystem, arc: Arc) -> None:
        """Compute them from the last step."""
        block, compiled = arc.blocks[-1], arc.compiled
        place = len(block.lengths) - 1
        start = float(arc.start.t)
        self._step = StepOfArc(system, arc.mode, compiled.clock, start, block, place)
        certificate = Certificate(system, compiled, arc.mode, 0.0, state=arc.start)
        # The last step may be cut at its start.
        one = 0 * block.lengths + system.number(1)
        rows = certificate.polynomials(Block(block.starts, one, block.coefficients))[place]
        self._length = block.lengths[place]
        clock = None if compiled.clock is None else block.coefficients[place, compiled.clock]
        self._rate = 1.0 if clock is None else float(self._slope(clock.tolist()))
        self.triggers = compiled.layout.triggers
        self._rows = dict(zip(self.triggers, rows.tolist(), strict=True))
        self._time_of_rounding = system.rounding * float(arc.end.t)
        self._rounding = system.rounding

    def _at_end(self, trigger: Trigger) -> _End:
        row = self._rows[trigger]
        fall = -float(self._slope(row)) / self._rate if self._rate > 0 else 0.0
        scaled = [c * self._length**k for k, c in enumerate(row)]
        rounding = rounding_bound(scaled, self._rounding) + abs(fall) * self._time_of_rounding
        return _End(float(sum(scaled)), fall, rounding)

    def _slope(self, row: Sequence[Any]) -> Any:
        """Return the derivative of a polynomial at the end of the step."""
        return horner([k * c for k, c in enumerate(row)][1:], self._length)

    def uncertainty(self, trigger: Trigger) -> float:
        """Return the change of the time of an event by an error of every angle (s/rad)."""
        return self._step.steepness(1.0, trigger) / max(self._at_end(trigger).fall, FLAT)

    def within(self, trigger: Trigger, uncertainty: float) -> float:
        """Return the error of an angle (rad) by which an event comes at the end of the arc.

        The end itself moves by its `uncertainty`. The error is infinite for an event that is not
        next.
        """
        left, fall, rounding = self._at_end(trigger)
        if not (fall > 0 and left <= NEAR_LIMIT):
            return _INFINITE
        if left <= 2 * rounding:
            return 0.0
        return left / max(self._step.steepness(1.0, trigger) + fall * uncertainty, FLAT)

    def within_time(self, trigger: Trigger, left: float) -> float:
        """Return the error of an angle (rad) by which an event that ends the arc is later (s)."""
        _, fall, rounding = self._at_end(trigger)
        missed = fall * left
        if not missed <= NEAR_LIMIT:
            return _INFINITE
        if missed <= 2 * rounding:
            return 0.0
        return missed / max(self._step.steepness(1.0, trigger), FLAT)


class _Instant(NamedTuple):
    """The state at which some events come together, the mode before them, and what may follow.

    `resting` are the elements that do not move there, and `left` the distances (N, N m) of static
    limits that are reached from the forces.
    """

    system: HybridSystem
    switch: Switch | None
    state: HybridState
    mode: Mode
    resting: frozenset[int]
    left: dict[Trigger, float]

    @classmethod
    def of(
        cls,
        system: HybridSystem,
        arc: Arc,
        events: Sequence[Trigger | None],
        switch: Switch | None,
    ) -> _Instant:
        """Return the end of an arc, at which all slides that stop have no speed."""
        stops = {each.index for each in events if each and each.kind is EventKind.STOPS}
        tangents = [system.tangents[index] for index in sorted(stops)]
        still = [*(each for each in tangents if each is not None), *system.held(arc.mode.states)]
        u = stopped(system.pose(arc.end.q), still, arc.end.u, system.rounding)
        slides = arc.mode.slides
        resting = frozenset(i for i, direction in enumerate(slides) if not direction) | stops
        sliding = tuple(own or other for own, other in zip(slides, arc.end.sliding, strict=True))
        now = switch.time if switch is not None and _LOADS in events else arc.end.t
        state = arc.end._replace(t=now, u=u, sliding=sliding)
        course = _Course(system, state, arc.mode)
        breaks = [each for each in events if each and each.kind is EventKind.BREAKS]
        left = {each: abs(course.left(each)[0]) for each in breaks}
        return cls(system, switch, state, arc.mode, resting, left)


class _Course(NamedTuple):
    """The system, the state and the mode after some of the events at an instant."""

    system: HybridSystem
    state: HybridState
    mode: Mode

    def selected(
        self, waiting: Mapping[Trigger, float], known: Mapping[int, States] = MappingProxyType({})
    ) -> _Course | None:
        """Return the course with the mode that is selected, None if the laws admit none.

        An element `waiting` to reach a static limit sticks beyond it by a distance (N, N m).
        """
        system, state, mode = self
        pose = system.pose(state.q)
        found = select(system, state, pose, known)
        if found is None and known:
            found = select(system, state, pose, {})
        if found is None:
            return None
        course = _Course(system, state, system.mode(found.states, mode.dents))
        for trigger, near in waiting.items():
            course = course._held(trigger, near)
        slides = course.mode.slides
        sliding = tuple(own or other for own, other in zip(slides, state.sliding, strict=True))
        return course._replace(state=state._replace(sliding=sliding))

    def _held(self, trigger: Trigger, near: float) -> _Course:
        """Return the course in which an element still sticks that slides by a distance (N, N m)."""
        index, states = trigger.index, self.mode.states
        begins = states[index].slips and not self.state.sliding[index]
        if not begins or states[index].direction != trigger.sense:
            return self
        held = put(states, index, ContactState.STICKS)
        if len(self.system.held(held)) > MOST_CONSTRAINTS:
            return self
        course = self._replace(mode=self.system.mode(held, self.mode.dents))
        left, limit = course.left(trigger)
        small = SAME_LIMIT * self.system.rounding * limit
        return course if left >= -2 * near - small else self

    def stops(self, index: int) -> bool:
        """Return whether an element without speed that slides slows down, or others hold it."""
        direction, tangent = self.mode.slides[index], self.system.tangents[index]
        if not direction or tangent is None:
            return False
        if is_fixed(tangent, self.system.held(self.mode.states), self.system.scene_chain):
            return True
        du = self.du
        along = direction * _along(self, tangent, du)
        return along < -SAME_MOTION * max(abs(float(x)) for x in du)

    @property
    def du(self) -> Pair:
        """The accelerations (rad/s²)."""
        return solution_at(self.system, self.system.pose(self.state.q), self.state, self.mode).du

    def breaks(self, trigger: Trigger, near: float) -> bool:
        """Return whether an element sticks, and its force grows, as `near` to its static limit."""
        if self.mode.states[trigger.index] is not ContactState.STICKS:
            return False
        now, limit = self.left(trigger)
        small = SAME_LIMIT * self.system.rounding * limit
        # The events before have changed the force by as much.
        if now > 2 * near + small:
            return False
        return self._moved().left(trigger)[0] < now - small

    def left(self, trigger: Trigger) -> tuple[float, float]:
        """Return how far the force of an element is from a static limit, and the limit."""
        system, state, mode = self
        pose = system.pose(state.q)
        solution = solution_at(system, pose, state, mode)
        left = value(trigger, system, mode, pose, state.u, solution, Surfaces({}, {}))
        limit = system.elements[trigger.index].limits(solution.forces[trigger.index].normal)[1]
        return float(left), abs(float(limit))

    def _moved(self) -> _Course:
        """Return the course after a short time, by its speeds and accelerations."""
        system, state, _ = self
        dt, du = system.number(DIFFERENCE * float(system.longest_step)), self.du
        q = tuple(x + dt * y for x, y in zip(state.q, state.u, strict=True))
        u = tuple(x + dt * y for x, y in zip(state.u, du, strict=True))
        return self._replace(state=state._replace(t=state.t + dt, q=q, u=u))

    def after(
        self, event: Trigger | None, instant: _Instant, waiting: Mapping[Trigger, float]
    ) -> _Course | None:
        """Return the course after an event, which need not come after those before it."""
        if event is None:
            assert instant.switch is not None
            return self._replace(system=instant.switch.system).selected(waiting)
        if event.kind is EventKind.STOPS:
            return self.stopped(event.index, waiting) if self.stops(event.index) else self
        if not self.breaks(event, instant.left[event]):
            return self
        sense = event.sense
        return self.selected(waiting, {event.index: (slipping(sense), pressed(sense))})

    def stopped(
        self, index: int, waiting: Mapping[Trigger, float] = MappingProxyType({})
    ) -> _Course | None:
        """Return the course after an element has come to rest, and those that slide with it."""
        bound = _bound_slides(self.system, self.mode, index)
        sliding = tuple(0 if i in bound else own for i, own in enumerate(self.state.sliding))
        return self._replace(state=self.state._replace(sliding=sliding)).selected(waiting)


def _along(course: _Course, tangent: ConstraintCoordinate, du: Pair) -> float:
    """Return the acceleration along a tangent (rad/s² or m/s²)."""
    system, state, _ = course
    x, y = system.pose(state.q).row(tangent)
    return float(x * du[0] + y * du[1] + tangent.bias(system.chain, state.q, state.u))


def _followed(instant: _Instant, order: Iterable[Trigger | None]) -> _Course | None:
    """Return the course after events in an order, None if the laws admit none."""
    course: _Course | None = _Course(instant.system, instant.state, instant.mode)
    waiting = dict(instant.left)
    for event in order:
        if event is not None:
            waiting.pop(event, None)
        if course is not None:
            course = course.after(event, instant, waiting)
    # A slide without speed may have to stop after later events.
    for _ in instant.mode.states:
        if course is None:
            break
        ending = next((i for i in sorted(instant.resting) if course.stops(i)), None)
        if ending is None:
            break
        course = course.stopped(ending)
    return course


def _are_alike(one: _Course | None, other: _Course | None) -> bool:
    """Return whether two courses go on in one way."""
    if one is None or other is None:
        return one is other
    if one.mode.slides != other.mode.slides:
        return False
    first, second = one.du, other.du
    size = max(abs(float(x)) for x in (*first, *second))
    return all(
        abs(float(x) - float(y)) <= SAME_MOTION * size for x, y in zip(first, second, strict=True)
    )
