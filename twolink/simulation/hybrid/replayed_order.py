"""The motion after events at one instant, taken in a given order.

The state does not change: events change which elements slide, and so the forces on all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from twolink.arithmetic import Pair
from twolink.contact.coordinates import ConstraintCoordinate
from twolink.contact.states import ContactState, EventKind, pressed, slipping
from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.complementarity import States
from twolink.simulation.hybrid.dynamics import MOST_CONSTRAINTS, is_fixed
from twolink.simulation.hybrid.event_functions import Surfaces, value
from twolink.simulation.hybrid.impact import stopped
from twolink.simulation.hybrid.mode import Mode, Trigger
from twolink.simulation.hybrid.mode_at import solution_at
from twolink.simulation.hybrid.select import select
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import DIFFERENCE, SAME_LIMIT, SAME_MOTION

LOADS = None
"""Loads that jump, among events."""


class Switch(NamedTuple):
    """A jump of the loads at a time (s), and the system after it."""

    time: Any
    system: HybridSystem


class Instant(NamedTuple):
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
    ) -> Instant:
        """Return the end of an arc, at which all slides that stop have no speed."""
        stops = {each.index for each in events if each and each.kind is EventKind.STOPS}
        tangents = [system.tangents[index] for index in sorted(stops)]
        still = [*(each for each in tangents if each is not None), *system.held(arc.mode.states)]
        u = stopped(
            system.pose(arc.end.q), still, arc.end.u, system.rounding, system.scales.slowest
        )
        slides = arc.mode.slides
        resting = frozenset(i for i, direction in enumerate(slides) if not direction) | stops
        sliding = tuple(own or other for own, other in zip(slides, arc.end.sliding, strict=True))
        now = switch.time if switch is not None and LOADS in events else arc.end.t
        state = arc.end._replace(t=now, u=u, sliding=sliding)
        outcome = Outcome(system, state, arc.mode)
        breaks = [each for each in events if each and each.kind is EventKind.BREAKS]
        left = {each: abs(outcome.left(each)[0]) for each in breaks}
        return cls(system, switch, state, arc.mode, resting, left)


class Outcome(NamedTuple):
    """The system, the state and the mode after some of the events at an instant."""

    system: HybridSystem
    state: HybridState
    mode: Mode

    def selected(
        self, waiting: Mapping[Trigger, float], known: Mapping[int, States] = MappingProxyType({})
    ) -> Outcome | None:
        """Return the outcome with the mode that is selected, None if the laws admit none.

        An element `waiting` to reach a static limit sticks beyond it by a distance (N, N m).
        """
        system, state, mode = self
        pose = system.pose(state.q)
        found = select(system, state, pose, known)
        if found is None and known:
            found = select(system, state, pose, {})
        if found is None:
            return None
        outcome = Outcome(system, state, system.mode(found.states, mode.dents))
        for trigger, near in waiting.items():
            outcome = outcome._held(trigger, near)
        slides = outcome.mode.slides
        sliding = tuple(own or other for own, other in zip(slides, state.sliding, strict=True))
        return outcome._replace(state=state._replace(sliding=sliding))

    def _held(self, trigger: Trigger, near: float) -> Outcome:
        """Return the outcome with an element still sticking that slides by a distance (N, N m)."""
        index, states = trigger.index, self.mode.states
        begins = states[index].slips and not self.state.sliding[index]
        if not begins or states[index].direction != trigger.sense:
            return self
        held = put(states, index, ContactState.STICKS)
        if len(self.system.held(held)) > MOST_CONSTRAINTS:
            return self
        outcome = self._replace(mode=self.system.mode(held, self.mode.dents))
        left, limit = outcome.left(trigger)
        small = SAME_LIMIT * self.system.rounding * limit
        return outcome if left >= -2 * near - small else self

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

    def _moved(self) -> Outcome:
        """Return the outcome after a short time, by its speeds and accelerations."""
        system, state, _ = self
        dt, du = system.number(DIFFERENCE * float(system.longest_step)), self.du
        q = tuple(x + dt * y for x, y in zip(state.q, state.u, strict=True))
        u = tuple(x + dt * y for x, y in zip(state.u, du, strict=True))
        return self._replace(state=state._replace(t=state.t + dt, q=q, u=u))

    def after(
        self, event: Trigger | None, instant: Instant, waiting: Mapping[Trigger, float]
    ) -> Outcome | None:
        """Return the outcome after an event, which need not come after those before it."""
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
    ) -> Outcome | None:
        """Return the outcome after an element has come to rest, and those that slide with it."""
        bound = bound_slides(self.system, self.mode, index)
        sliding = tuple(0 if i in bound else own for i, own in enumerate(self.state.sliding))
        return self._replace(state=self.state._replace(sliding=sliding)).selected(waiting)


def _along(outcome: Outcome, tangent: ConstraintCoordinate, du: Pair) -> float:
    """Return the acceleration along a tangent (rad/s² or m/s²)."""
    system, state, _ = outcome
    x, y = system.pose(state.q).row(tangent)
    return float(x * du[0] + y * du[1] + tangent.bias(system.chain, state.q, state.u))


def followed(instant: Instant, order: Iterable[Trigger | None]) -> Outcome | None:
    """Return the outcome after events in an order, None if the laws admit none."""
    outcome: Outcome | None = Outcome(instant.system, instant.state, instant.mode)
    waiting = dict(instant.left)
    for event in order:
        if event is not None:
            waiting.pop(event, None)
        if outcome is not None:
            outcome = outcome.after(event, instant, waiting)
    # A slide without speed may have to stop after later events.
    for _ in instant.mode.states:
        if outcome is None:
            break
        ending = next((i for i in sorted(instant.resting) if outcome.stops(i)), None)
        if ending is None:
            break
        outcome = outcome.stopped(ending)
    return outcome


def are_alike(one: Outcome | None, other: Outcome | None) -> bool:
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


def bound_slides(system: HybridSystem, mode: Mode, index: int) -> list[int]:
    """Return the elements that slide as long as another one does, as a mode holds the chain."""
    tangent = system.tangents[index]
    assert tangent is not None
    held = [*system.held(mode.states), tangent]
    return [
        other
        for other, (own, direction) in enumerate(zip(system.tangents, mode.slides, strict=True))
        if direction and own is not None and is_fixed(own, held, system.scene_chain)
    ]
