"""Doubts: events that the error of a run may have made, or may have let pass.

A gap that touches zero, or comes as close as the error of a run, may have been an impact, and an
impact that is as shallow may have been a pass. The change of the motion by such an impact is then
a part of the error.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from twolink.contact.states import EventKind
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.event_functions import EDGES
from twolink.simulation.hybrid.impact import Impacts
from twolink.simulation.hybrid.missed_change import change_by_impact, change_by_press
from twolink.simulation.hybrid.mode import Doubt, Mode, Remark, Trigger
from twolink.simulation.hybrid.polishing import horner, lowest
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.roots import Search
from twolink.simulation.hybrid.steepness import steepness
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import (
    FLAT,
    NEAR_EDGE,
    NEAR_END,
    NEAR_LIMIT,
    SATURATED,
    STANDING_CLOCK,
)
from twolink.simulation.series import powers_of

_BREAKAWAY = (EventKind.BREAKS, EventKind.STOPS)


class StepOfArc(NamedTuple):
    """A step, number `place` of a block, of an arc in a `mode` that `begins` at a time (s).

    `clock` is the variable of time since then, where that is not the independent one.
    """

    system: HybridSystem
    mode: Mode
    clock: int | None
    begins: float
    block: Block
    place: int

    def time(self, x: float) -> tuple[float, float]:
        """Return the time (s) at x in [0, 1] of the step, and its rate (s)."""
        start, length = self.block.starts[self.place], self.block.lengths[self.place]
        if self.clock is None:
            return float(start) + x * float(length), float(length)
        terms = [float(c) for c in self._scaled(self.clock, 1.0)]
        time = self.begins + sum(c * x**k for k, c in enumerate(terms))
        return time, sum(k * c * x ** (k - 1) for k, c in enumerate(terms) if k)

    def change(self, x: float, index: int, speed: float) -> float:
        """Return a bound on the change of u (rad/s) by an impact of an element at a speed, at x."""
        system, element = self.system, self.system.elements[index]
        q1, q2, u1, u2 = self._state(x)
        pose = Pose(system.chain, system.formulation, (q1, q2))
        impacts = Impacts(pose, system.elements, 0.0, system.rounding)
        if element.rigid:
            return change_by_impact(impacts, index, speed, (u1, u2))
        return change_by_press(pose, element.principal, speed, impacts.energy((u1, u2)))

    def steepness(self, x: float, trigger: Trigger) -> float:
        """Return the change of an event function at x by one of every angle and speed (1/rad)."""
        return steepness(self.system, self.mode, self._state(x), self.time(x)[0], trigger)

    def _state(self, x: float) -> list[Any]:
        """Return q (rad) and u (rad/s) at x."""
        return [sum(self._scaled(k, x)) for k in range(4)]

    def _scaled(self, variable: int, x: float) -> list[Any]:
        """Return the terms of the series of a variable at x."""
        row = self.block.coefficients[self.place, variable]
        length = self.block.lengths[self.place : self.place + 1] * self.system.number(x)
        terms: list[Any] = (row * powers_of(length, len(row))).tolist()
        return terms


def near_to_zero(system: HybridSystem, trigger: Trigger) -> float:
    """Return how near to zero an event function may leave a doubt, in its unit.

    A gap does within the error of a run, and so do other functions at whose zero the motion changes
    by more than the function. How large the error is then decides on the doubt.
    """
    if trigger.kind is EventKind.HITS:
        return system.scales.grazing(trigger.index)
    if trigger.kind in EDGES:
        size = system.scales.sizes[trigger.index]
        return NEAR_EDGE * size if trigger.kind is EventKind.CLEARS else NEAR_END * math.sqrt(size)
    if trigger.kind in _BREAKAWAY and system.elements[trigger.index].hysteretic:
        return NEAR_LIMIT
    return 0.0


def may_jump(system: HybridSystem, mode: Mode, trigger: Trigger) -> bool:
    """Return whether forces change by more than an event function where that is zero.

    Friction does if its static limit is above the kinetic one. A point beyond the edge of its dent
    meets an undamaged surface. At the end of a branch of a force law, or within `NEAR_END` beyond
    it, the force may jump.
    """
    element = system.elements[trigger.index]
    if trigger.kind in _BREAKAWAY:
        return element.hysteretic
    if trigger.kind is EventKind.REACHES:
        hysteresis, dent = element.hysteresis, mode.dent(trigger.index)
        assert hysteresis is not None
        assert dent is not None
        branch = hysteresis.branch(dent)
        beyond = float(hysteresis.jump(dent)) - float(branch.residual)
        near = NEAR_END * math.sqrt(system.scales.sizes[trigger.index])
        return math.sqrt(beyond) - float(branch.reach or 0.0) <= near
    return trigger.kind is EventKind.CLEARS


def doubt_of(
    step: StepOfArc,
    trigger: Trigger,
    polynomial: Sequence[Any],
    search: Search,
    bound: float,
    rounding: float,
) -> Doubt | None:
    """Return the doubt caused by a touch, or None if the motion does not depend on it.

    `bound` is that on the error of the event function, or its depth, and `rounding` its round-off.
    The doubt begins where the event function comes within the bound.
    """
    x = float(search.touch or 0.0)
    speed = change = math.inf
    within = 0.0
    slope, bend = (abs(derivative) for derivative in _derivatives(polynomial, x))
    before = max(x - _width(slope, bend, bound), 0.0)
    if trigger.kind is EventKind.HITS and not search.unsure:
        pace = step.time(x)[1]
        if x > 0 and pace <= STANDING_CLOCK * step.time(0.0)[1]:
            # The press ends here, and beyond it the polynomials go back in time.
            return None
        speed = math.sqrt(2 * bend * bound) / pace if pace > 0 else math.inf
        change = step.change(before, trigger.index, speed)
    elif not search.unsure:
        if not may_jump(step.system, step.mode, trigger):
            return None
        # Above round-off, the error of a run decides only if it is as large.
        missed = abs(float(horner(polynomial, x)))
        if missed > 2 * rounding:
            within = missed / max(step.steepness(x, trigger), FLAT)
    until = 1.0 if float(sum(polynomial)) <= bound and not within else x
    return Doubt(step.time(before)[0], trigger, speed, change, step.time(until)[0], within)


def undecided_at(doubts: Iterable[Doubt], end: float) -> tuple[list[Doubt], list[Doubt]]:
    """Return the doubts of an arc before its end (s), and those that last until there.

    The latter are those on a friction limit or the end of a slide: at the end of the arc, it is
    their order with the event there that is in doubt.
    """
    before: list[Doubt] = []
    last: list[Doubt] = []
    for doubt in doubts:
        # A step is as long as a rounded difference of times.
        lasts = math.nextafter(doubt.until, math.inf) >= end
        (last if lasts and doubt.trigger.kind in _BREAKAWAY else before).append(doubt)
    return before, last


def reason_of(doubt: Doubt, names: Sequence[str]) -> str:
    """Return why an error is unknown by a doubt without a bound on its change."""
    name = names[doubt.trigger.index]
    if math.isfinite(doubt.speed) and not doubt.rate:
        return f"the bounces on {name} that are left out at {doubt.time:.9g} s may grow again"
    decides = "the error of the run" if doubt.within else "round-off"
    return f"{decides} decides at {doubt.time:.9g} s whether {doubt.trigger.kind.value} ({name})"


def remarks_of(doubts: Iterable[Doubt], names: Sequence[str]) -> Iterator[Remark]:
    """Yield a sentence on each doubt that changes the motion, by the names of the elements."""
    for doubt in doubts:
        if doubt.change > SATURATED and not doubt.within:
            choice = f"whether {doubt.trigger.kind.value} ({names[doubt.trigger.index]})"
            sentence = f"At {doubt.time:.9g} s the error of the run decides {choice}."
            yield Remark(choice, doubt.time, sentence)


def with_dip(
    search: Search, polynomial: list[Any], grazing: float, bound: float
) -> tuple[Search, float]:
    """Return a search with the place of the minimum after a fall that is no deeper than `grazing`.

    The error of a run may have turned a pass into such a fall. The bound is the depth then.
    """
    place = lowest(polynomial, 0.0)
    if place is None:
        return search, bound
    depth = -float(horner(polynomial, place))
    return (search._replace(touch=place), depth) if depth < grazing else (search, bound)


def _width(slope: float, bend: float, bound: float) -> float:
    """Return how far before zero a falling polynomial is at a bound, infinity for a constant.

    `slope` and `bend` are the sizes of its derivatives.
    """
    steepness = slope + math.sqrt(slope * slope + 2 * bend * bound)
    return 2 * bound / steepness if steepness > 0 else math.inf


def _derivatives(polynomial: Sequence[Any], x: float) -> tuple[float, float]:
    """Return the first and the second derivative of a polynomial, in float64."""
    coefficients = [float(c) for c in polynomial]
    first = sum(k * c * x ** (k - 1) for k, c in enumerate(coefficients) if k)
    return first, sum(k * (k - 1) * c * x ** (k - 2) for k, c in enumerate(coefficients) if k > 1)
