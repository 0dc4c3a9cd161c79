"""The certificate of an arc: no event function falls before the arc's end.

On each step every event function is a polynomial. It is proven positive, or its first root is
isolated there. No event function is ever switched off: one that starts at zero, as a gap does after
an impact, is divided by its leading power of time.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from twolink.contact.states import EventKind
from twolink.simulation.hybrid.compile import CompiledMode
from twolink.simulation.hybrid.complementarity import NO_ORDERS, Orders, size_of
from twolink.simulation.hybrid.mode import Doubt, Mode, Trigger
from twolink.simulation.hybrid.roots import Search, first_fall, lowest, margins_of, rounding_bound
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import CONTACT_GAP, GRAZING, LEADING, LEADING_SHARE
from twolink.simulation.series import powers


class Finding(NamedTuple):
    """The first event on a block of steps: on which step, at which x in [0, 1] of it, and which.

    `trigger` is None if the clock reaches the end of the arc first.
    """

    place: int
    x: Any
    trigger: Trigger | None


class Block(NamedTuple):
    """Steps taken one after another: starts, lengths, and coefficients of shape (n, v, p + 1)."""

    starts: Any
    lengths: Any
    coefficients: Any


# Event functions that are places, and those that are speeds.
_PLACES = frozenset((EventKind.HITS, EventKind.CLEARS))
_SPEEDS = frozenset((EventKind.STOPS, EventKind.TURNS))


class StartOfArc:
    """The powers of time with which event functions start, and the sizes below which they are zero.

    At the start of an arc, round-off decides which coefficients of an event function are zero.
    """

    def __init__(
        self,
        system: HybridSystem,
        compiled: CompiledMode,
        pressing: float,
        orders: Orders,
        state: HybridState | None,
    ) -> None:
        """Store the arguments of `Certificate`."""
        self._state = state
        self._system, self._compiled = system, compiled
        self._pressing, self._orders = pressing, orders
        self.lever = max(1.0, system.lever)
        self.place_of_rounding = self.lever * LEADING * system.rounding

    def order(self, trigger: Trigger, polynomial: list[Any], block: Block) -> int | None:
        """Return how many leading coefficients are zero, None if all are."""
        order = self._known_order(trigger, polynomial, block) if self._orders else None
        if order is not None:
            return order
        noise, pace = self._noise(trigger, polynomial, block), 1.0
        if self._compiled.clock is None:
            pace = float(block.lengths[0]) / float(self._system.longest_step)
        is_speed = trigger.kind in _SPEEDS
        if polynomial[0] > (self._speed_noise(trigger, noise) if is_speed else noise):
            return 0
        if polynomial[0] > 0 and trigger.kind in (EventKind.HITS, EventKind.LEAVES):
            # A lower bound, as it omits the contribution of a tiny growing gap.
            return 1 if polynomial[1] > noise * pace else 0
        # A gap is a variable of its own, and is zero only after a jump has set it to zero.
        first = 0.0 if trigger.kind is EventKind.HITS else noise
        own = self._system.rounding if trigger.kind is EventKind.HITS else self._system.resolution
        least = LEADING_SHARE * own * _size(polynomial)
        if is_speed:
            least += self._speed_of_rounding(block)
        return _leading_zeros(polynomial, first, noise, pace, least)

    def _known_order(self, trigger: Trigger, polynomial: list[Any], block: Block) -> int | None:
        """Return the order determined by the mode selection, or None.

        If the independent variable is not time, time starts as a power of that variable.
        """
        order = self._orders.get(trigger)
        if order is None:
            return None
        if self._compiled.clock is not None:
            clock = block.coefficients[0, self._compiled.clock]
            order *= next((k for k, c in enumerate(clock) if k and c != 0), len(clock))
        return order if order < len(polynomial) - 1 and polynomial[order] > 0 else None

    def _noise(self, trigger: Trigger, polynomial: list[Any], block: Block) -> float:
        """Return the size below which an event function at the start of an arc is zero."""
        if trigger.kind in _PLACES:
            return self.place_of_rounding
        size = _size(polynomial)
        if trigger.kind in _SPEEDS:
            # The change of speed is due to forces that may nearly cancel.
            rows = block.coefficients[0, 2:4] * powers(block.lengths[:1], len(polynomial))
            changes = float(np.abs(rows).astype(float).sum())
            size = max(size, self.lever * max(changes, 1 / float(self._system.longest_step)))
        elif trigger.kind is EventKind.BREAKS:
            size = max(size, 1.0)
        return LEADING * self._system.resolution * size + self._force_of_rounding(trigger)

    def _speed_noise(self, trigger: Trigger, noise: float) -> float:
        """Return the size below which a speed at the start of an arc is zero: at most `noise`.

        Near a singular pose the row of the speed is short, and so is the error of the speed due to
        that of u; the error of the row is round-off of the pose.
        """
        if self._state is None:
            return noise
        element = self._system.elements[trigger.index]
        along = element.normal if trigger.kind is EventKind.TURNS else element.tangent
        assert along is not None
        row = size_of(self._system.pose(self._state.q).row(along)) / self.lever
        own = LEADING * self._system.resolution * self.lever * size_of(self._state.u)
        return min(noise, own + row * noise)

    def _speed_of_rounding(self, block: Block) -> float:
        """Return the speed that round-off of large forces causes in the first step."""
        clock, duration = self._compiled.clock, float(block.lengths[0])
        if clock is not None:
            row = (
                block.coefficients[0, clock]
                * powers(block.lengths[:1], block.coefficients.shape[2])[0]
            )
            duration = abs(float(row[1:].sum()))
        return LEADING * self._system.resolution * self.lever * self._pressing * duration

    def _force_of_rounding(self, trigger: Trigger) -> float:
        """Return the scaled force that round-off of a position causes in a stiff surface."""
        element = self._system.elements[trigger.index]
        law = element.compliant
        if trigger.kind not in (EventKind.LEAVES, EventKind.BREAKS) or law is None or law.rooted:
            return 0.0
        depth = CONTACT_GAP * self._system.rounding * max(1.0, abs(float(element.bound)))
        return abs(float(law.force(depth, 0.0, 0.0))) * self._system.force_scale

    def zero_size(self, trigger: Trigger, polynomial: list[Any], block: Block) -> float:
        """Return the size up to which an event function that starts as zero stays zero."""
        if trigger.kind is EventKind.HITS:
            # A touching contact that carries no force: its gap stays zero.
            return math.inf
        return self._noise(trigger, polynomial, block)


class _Suspect(NamedTuple):
    """An event function that is not proven positive on a step: its number and its coefficients.

    `bernstein` are its Bernstein coefficients, or None if they are known in float64 only.
    """

    number: int
    polynomial: list[Any]
    bernstein: list[Any] | None


class Certificate:
    """The event functions of one arc, as polynomials of its steps."""

    def __init__(
        self,
        system: HybridSystem,
        compiled: CompiledMode,
        mode: Mode,
        span: Any,
        pressing: float = 0.0,
        orders: Orders = NO_ORDERS,
        state: HybridState | None = None,
    ) -> None:
        """Store the compiled mode and the time (s) after which the arc ends without an event.

        `pressing` is the sum of the accelerations (rad/s²) that single compliant surfaces give;
        `orders` are those of event functions that, by the selection, grow from zero. With the
        `state` at the start a speed is known better near a singular pose.
        """
        self._system, self._compiled, self._span = system, compiled, span
        layout = compiled.layout
        self._triggers, self._reversed = layout.triggers, layout.reversed
        self._start = StartOfArc(system, compiled, pressing, orders, state)
        self._grazing = self._start.lever * GRAZING * system.rounding
        # The least margins by which event functions are certified.
        self._required = [self._grazing if is_gap else 0.0 for is_gap in layout.of_gaps]
        # The event functions that are zero within these sizes since the start of the arc.
        self._zero: dict[int, float] = {}
        self._tails: dict[int, float] = {}
        self._offsets = {
            place: system.number(_offset(system, mode, self._triggers[place]))
            for place in layout.reversed
        }

    def polynomials(self, block: Block) -> Any:
        """Return the event functions on each step, on [0, 1]: shape (n, m, p + 1)."""
        layout = self._compiled.layout
        rows = block.coefficients[:, layout.variables]
        order = rows.shape[2]
        if layout.integral is not None or self._reversed:
            rows = rows.copy()
        if layout.integral is not None:
            rates = rows[:, layout.integral, 1:] * _counting(order, rows.dtype)
            rows[:, layout.integral, :-1] = rates
            rows[:, layout.integral, -1] = 0
        for place in self._reversed:
            rows[:, place] = -rows[:, place]
        for place, offset in self._offsets.items():
            rows[:, place, 0] = rows[:, place, 0] + offset
        return rows * powers(block.lengths, order)[:, None, :]

    def first_event(self, block: Block, at_start: bool) -> tuple[Finding | None, tuple[Doubt, ...]]:
        """Return the first event on a block of steps, and the touches before it.

        `at_start` says that the block begins with the first step of the arc.
        """
        doubts: list[Doubt] = []
        suspects = self._suspects(block, at_start) if self._triggers else {}
        # The clock can reach its end only on the last step.
        last = len(block.lengths) - 1
        for place in sorted({*suspects, last}):
            unseen = self._tails if at_start and place == 0 else {}
            earliest = self._earliest(block, place, suspects.get(place, ()), doubts, unseen)
            at_end = self._clock_root(block, place) if place == last else None
            if at_end is not None and (earliest is None or at_end <= earliest.x):
                return Finding(place, at_end, None), tuple(doubts)
            if earliest is not None:
                return earliest, tuple(doubts)
        return None, tuple(doubts)

    def _suspects(self, block: Block, at_start: bool) -> dict[int, list[_Suspect]]:
        """Return the event functions that are not proven positive, by the number of the step."""
        every = self.polynomials(block)
        if at_start:
            self._deflate(every, block)
        count, functions, length = every.shape
        margins, bernstein = margins_of(every.reshape(-1, length), self._system.rounding)
        zeros = {number: self._steps_of_zero(number, every[:, number]) for number in [*self._zero]}
        required = self._required * count
        if at_start:
            for number, tail in self._tails.items():
                required[number] = tail
        pairs = enumerate(zip(margins.tolist(), required, strict=True))
        # In longer precisions the Bernstein coefficients in float64 do not suffice.
        known = every.dtype == bernstein.dtype
        found: dict[int, list[_Suspect]] = {}
        for row in [row for row, (margin, least) in pairs if not margin > least]:
            place, number = divmod(row, functions)
            if place >= zeros.get(number, 0):
                form = bernstein[row].tolist() if known else None
                suspect = _Suspect(number, every[place, number].tolist(), form)
                found.setdefault(place, []).append(suspect)
        return found

    def _earliest(
        self,
        block: Block,
        place: int,
        suspects: Sequence[_Suspect],
        doubts: list[Doubt],
        tails: Mapping[int, float],
    ) -> Finding | None:
        """Return the first event on a step, among the event functions that are not certified.

        `tails` adds to the bounds of those that are deflated.
        """
        earliest: Finding | None = None
        for number, polynomial, bernstein in suspects:
            trigger = self._triggers[number]
            if polynomial[0] < 0:
                # The event function falls at the start of the step.
                return Finding(place, 0 * block.lengths[place], trigger)
            bound = rounding_bound(polynomial, self._system.rounding) + tails.get(number, 0.0)
            search = first_fall(polynomial, bound, bernstein)
            fall = search.fall
            if fall is None and search.touch is None and trigger.kind is EventKind.HITS:
                bound = self._grazing
                search = search._replace(touch=lowest(polynomial, bound))
            if search.touch is not None or search.unsure:
                doubt = self._doubt(block, place, trigger, polynomial, search, bound)
                doubts += [doubt] if doubt is not None else []
            if fall is not None and (earliest is None or fall < earliest.x):
                earliest = Finding(place, fall, trigger)
        return earliest

    def _deflate(self, every: Any, block: Block) -> None:
        """Divide event functions that start at zero by time, in place.

        The event function of jamming is monitored from either sign.
        """
        for number, trigger in enumerate(self._triggers):
            polynomial = every[0, number].tolist()
            if trigger.kind is EventKind.HITS and polynomial[0] > self._start.place_of_rounding:
                continue
            if trigger.kind is EventKind.JAMS and polynomial[0] < 0:
                every[:, number] = -every[:, number]
                self._reversed ^= {number}
                polynomial = [-c for c in polynomial]
            order = self._start.order(trigger, polynomial, block)
            if order is None:
                self._zero[number] = self._start.zero_size(trigger, polynomial, block)
            elif order:
                row = every[0, number]
                row[:-order] = row[order:]
                row[-order:] = 0
                # The last terms estimate the truncation error of the series.
                self._tails[number] = float(abs(polynomial[-1])) + float(abs(polynomial[-2]))

    def _steps_of_zero(self, number: int, polynomials: Any) -> int:
        """Return on how many steps of a block an event function is still zero.

        After the first step at whose end it is not, it is monitored.
        """
        ends = np.abs(polynomials.sum(axis=1).astype(float))
        grown = np.flatnonzero(ends > self._zero[number])
        if not len(grown):
            return len(ends)
        del self._zero[number]
        return int(grown[0]) + 1

    def _clock_root(self, block: Block, place: int) -> Any:
        """Return the place on a step at which the clock reaches the end of the arc, or None."""
        if self._compiled.clock is None:
            return None
        row = block.coefficients[place, self._compiled.clock]
        polynomial = -row * powers(block.lengths[place : place + 1], len(row))[0]
        polynomial[0] = polynomial[0] + self._span
        if polynomial.sum() > 0:
            return None
        end = first_fall(polynomial, 0.0).fall
        return 1 if end is None else end

    def _doubt(
        self,
        block: Block,
        place: int,
        trigger: Trigger,
        polynomial: Any,
        search: Search,
        bound: float,
    ) -> Doubt | None:
        """Return the doubt caused by a touch, or None if the motion does not depend on it."""
        element = self._system.elements[trigger.index]
        if search.unsure:
            speed = math.inf
        elif trigger.kind is EventKind.HITS:
            x = search.touch
            assert x is not None
            bend = sum(
                k * (k - 1) * float(c) * x ** (k - 2) for k, c in enumerate(polynomial) if k > 1
            )
            speed = math.sqrt(2 * abs(bend) * bound) / float(block.lengths[place])
        elif element.hysteretic and trigger.kind in (EventKind.BREAKS, EventKind.STOPS):
            speed = math.inf
        else:
            return None
        return Doubt(float(block.starts[place]), trigger, speed)


def _size(polynomial: list[Any]) -> float:
    """Return the sum of the sizes of all terms."""
    return float(sum(map(abs, polynomial)))


def _leading_zeros(
    polynomial: list[Any], first: float, noise: float, pace: float, least: float
) -> int | None:
    """Return the power of x with which a polynomial starts, or None if it is zero.

    The first coefficient is known within `first`, and the k-th after it within noise · pace^k, and
    within `least`.
    """
    for k in range(len(polynomial) - 1):
        if abs(polynomial[k]) > (max(noise * pace**k, least) if k else first):
            return k
    return None


def _offset(system: HybridSystem, mode: Mode, trigger: Trigger) -> Any:
    """Return the number that a variable is subtracted from to give an event function."""
    branch = system.elements[trigger.index].branch(mode.dent(trigger.index))
    return branch.residual if trigger.kind is EventKind.CLEARS else branch.reach


@functools.cache
def _counting(order: int, kind: Any) -> Any:
    return np.arange(1.0, order).astype(kind)
