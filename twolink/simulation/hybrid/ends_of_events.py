"""Event functions at the end of an arc, and the error of a run by which they come there as well."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.bernstein import rounding_bound
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.doubts import StepOfArc
from twolink.simulation.hybrid.event_polynomials import EventPolynomials
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.polishing import horner
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import FLAT, NEAR_LIMIT


class End(NamedTuple):
    """An event function at the end of an arc: its value, its rate of fall (1/s), its round-off."""

    left: float
    fall: float
    rounding: float


class Ends:
    """The event functions at the end of an arc."""

    def __init__(self, system: HybridSystem, arc: Arc) -> None:
        """Compute them from the last step."""
        block, compiled = arc.blocks[-1], arc.compiled
        place = len(block.lengths) - 1
        start = float(arc.start.t)
        self._step = StepOfArc(system, arc.mode, compiled.clock, start, block, place)
        # The last step may be cut at its start.
        self._length = block.lengths[place]
        one = 0 * block.lengths[place:] + system.number(1)
        last = Block(block.starts[place:], one, block.coefficients[place:])
        (rows,) = EventPolynomials(system, compiled, arc.mode).on(last)
        clock = None if compiled.clock is None else block.coefficients[place, compiled.clock]
        self._rate = 1.0 if clock is None else float(self._slope(clock.tolist()))
        self.triggers = compiled.layout.triggers
        self._rows = dict(zip(self.triggers, rows.tolist(), strict=True))
        self._time_of_rounding = system.rounding * float(arc.end.t)
        self._rounding = system.rounding
        self._uncertainties: dict[Trigger, float] = {}
        self._known: dict[Trigger, End] = {}

    def _at_end(self, trigger: Trigger) -> End:
        """Return an event function at the end of the arc, computed once."""
        found = self._known.get(trigger)
        if found is None:
            found = self._known[trigger] = self._computed(trigger)
        return found

    def _computed(self, trigger: Trigger) -> End:
        row = self._rows[trigger]
        fall = -float(self._slope(row)) / self._rate if self._rate > 0 else 0.0
        scaled = [c * self._length**k for k, c in enumerate(row)]
        rounding = rounding_bound(scaled, self._rounding) + abs(fall) * self._time_of_rounding
        return End(float(sum(scaled)), fall, rounding)

    def _slope(self, row: Sequence[Any]) -> Any:
        """Return the derivative of a polynomial at the end of the step."""
        return horner([k * c for k, c in enumerate(row)][1:], self._length)

    def uncertainty(self, trigger: Trigger) -> float:
        """Return the change of the time of an event by an error of every angle (s/rad)."""
        if trigger not in self._uncertainties:
            steepness, fall = self._step.steepness(1.0, trigger), self._at_end(trigger).fall
            self._uncertainties[trigger] = steepness / max(fall, FLAT)
        return self._uncertainties[trigger]

    def arrives(self, trigger: Trigger) -> bool:
        """Return whether an event comes at the end of the arc, within round-off."""
        left, fall, rounding = self._at_end(trigger)
        return fall > 0 and left <= min(NEAR_LIMIT, 2 * rounding)

    def within(self, trigger: Trigger, cause: Trigger | None) -> float:
        """Return the error of an angle (rad) by which an event comes at the end of the arc.

        The end itself moves with the event that is its `cause`, if it has one. The error is
        infinite for an event that is not next.
        """
        left, fall, _ = self._at_end(trigger)
        if not (fall > 0 and left <= NEAR_LIMIT):
            return math.inf
        if self.arrives(trigger):
            return 0.0
        moved = 0.0 if cause is None else fall * self.uncertainty(cause)
        return left / max(self._step.steepness(1.0, trigger) + moved, FLAT)

    def is_at(self, trigger: Trigger, left: float) -> bool:
        """Return whether the event that ends the arc may come by a time later (s) by round-off."""
        _, fall, rounding = self._at_end(trigger)
        return fall * left <= min(NEAR_LIMIT, 2 * rounding)

    def within_time(self, trigger: Trigger, left: float) -> float:
        """Return the error of an angle (rad) by which an event that ends the arc is later (s)."""
        missed = self._at_end(trigger).fall * left
        if not missed <= NEAR_LIMIT:
            return math.inf
        if self.is_at(trigger, left):
            return 0.0
        return missed / max(self._step.steepness(1.0, trigger), FLAT)
