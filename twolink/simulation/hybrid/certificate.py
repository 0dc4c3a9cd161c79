"""The certificate of an arc: no event function falls before the arc's end.

On each step every event function is a polynomial. It is proven positive, or its first root is
isolated there. No event function is ever switched off: one that starts at zero, as a gap does after
an impact, is divided by its leading power of time.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from twolink.contact.states import EventKind
from twolink.simulation.hybrid.compile import CompiledMode
from twolink.simulation.hybrid.complementarity import NO_ORDERS, Orders, size_of
from twolink.simulation.hybrid.mode import Doubt, Mode, Trigger
from twolink.simulation.hybrid.roots import (
    Search,
    first_fall,
    is_positive_until,
    lowest,
    margins_of,
    rounding_bound,
)
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import CONTACT_GAP, LEADING, LEADING_SHARE
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
_HITS = EventKind.HITS
_PLACES = frozenset((_HITS, EventKind.CLEARS))
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

    def order(self, trigger: Trigger, polynomial: list[Any], block: Block) -> int | None:
        """Return how many leading coefficients are zero, None if all are."""
        order = self._known_order(trigger, polynomial, block)
        if order is not None:
            return order
        is_gap, is_speed = trigger.kind is _HITS, trigger.kind in _SPEEDS
        noise, pace = self._noise(trigger, polynomial, block), 1.0
        if self._compiled.clock is None:
            pace = float(block.lengths[0]) / float(self._system.longest_step)
        if polynomial[0] > (self._speed_noise(trigger, noise) if is_speed else noise):
            return 0
        if polynomial[0] > 0 and (is_gap or trigger.kind is EventKind.LEAVES):
            # A lower bound, as it omits the contribution of a tiny growing gap.
            return 1 if polynomial[1] > noise * pace else 0
        # A gap is a variable of its own, and is zero only after a jump has set it to zero.
        first = 0.0 if is_gap else noise
        own = self._system.rounding if is_gap else self._system.resolution
        least = LEADING_SHARE * own * _size(polynomial)
        if is_speed:
            least += self._speed_of_rounding(block)
        return _leading_zeros(polynomial, first, noise, pace, least)

    def _known_order(self, trigger: Trigger, polynomial: list[Any], block: Block) -> int | None:
        """Return the order determined by the mode selection or by a speed, or None.

        If the independent variable is not time, time starts as a power of that variable, and the
        first coefficients may all be below the round-off of a place.
        """
        order, clock = self._orders.get(trigger), self._compiled.clock
        if order is None and clock is not None and polynomial[0] == 0 and self._opens(trigger):
            order = 1
        if order is None:
            return None
        if clock is not None:
            row = block.coefficients[0, clock]
            order *= next((k for k, c in enumerate(row) if k and c != 0), len(row))
        return order if order < len(polynomial) - 1 and polynomial[order] > 0 else None

    def _opens(self, trigger: Trigger) -> bool:
        """Return whether an event function is a gap that opens with a speed above round-off."""
        state, index = self._state, trigger.index
        if trigger.kind is not _HITS or state is None or index in self._compiled.recovering:
            return False
        normal = self._system.elements[index].normal
        assert normal is not None
        speed = normal.speed(self._system.chain, state.q, state.u)
        return bool(speed > self._speed_of_state(state))

    def _speed_of_state(self, state: HybridState) -> float:
        """Return the error that the speed of a point has through that of u."""
        return LEADING * self._system.resolution * self._system.scale * size_of(state.u)

    def _noise(self, trigger: Trigger, polynomial: list[Any], block: Block) -> float:
        """Return the size below which an event function at the start of an arc is zero."""
        if trigger.kind in _PLACES:
            return self._system.place_of_rounding
        size = _size(polynomial)
        if trigger.kind in _SPEEDS:
            # The change of speed is due to forces that may nearly cancel.
            rows = block.coefficients[0, 2:4] * powers(block.lengths[:1], len(polynomial))
            changes = float(np.abs(rows).astype(float).sum())
            least = 1 / float(self._system.longest_step)
            size = max(size, self._system.scale * max(changes, least))
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
        row = size_of(self._system.pose(self._state.q).row(along)) / self._system.scale
        return min(noise, self._speed_of_state(self._state) + row * noise)

    def _speed_of_rounding(self, block: Block) -> float:
        """Return the speed that round-off of large forces causes in the first step."""
        clock, duration = self._compiled.clock, float(block.lengths[0])
        if clock is not None:
            row = (
                block.coefficients[0, clock]
                * powers(block.lengths[:1], block.coefficients.shape[2])[0]
            )
            duration = abs(float(row[1:].sum()))
        return LEADING * self._system.resolution * self._system.scale * self._pressing * duration

    def _force_of_rounding(self, trigger: Trigger) -> float:
        """Return the scaled force that round-off of a position causes in a stiff surface."""
        element = self._system.elements[trigger.index]
        law = element.compliant
        if trigger.kind not in (EventKind.LEAVES, EventKind.BREAKS) or law is None or law.uses_root:
            return 0.0
        depth = CONTACT_GAP * self._system.rounding * max(1.0, abs(float(element.bound)))
        return abs(float(law.force(depth, 0.0, 0.0))) * self._system.force_scale

    def zero_size(self, trigger: Trigger, polynomial: list[Any], block: Block) -> float:
        """Return the size up to which an event function that starts as zero stays zero."""
        state = self._state
        if trigger.kind is _HITS and (state is None or trigger.index in state.touching):
            # A touching contact that carries no force: its gap stays zero.
            return math.inf
        return self._noise(trigger, polynomial, block)


class _Suspect(NamedTuple):
    """An event function that is not proven positive on a step: its number and its coefficients.

    `place` is the number of the step, and `bound` that on the error of the values. `bernstein` are
    the Bernstein coefficients in float64.
    """

    place: int
    number: int
    polynomial: list[Any]
    bernstein: list[float]
    bound: float


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
        # The event functions that are zero within these sizes since the start of the arc.
        self._zero: dict[int, float] = {}
        self._tails: dict[int, float] = {}
        self._offsets: dict[int, Any] = {}
        for place in layout.reversed:
            self._offsets[place] = system.number(_offset(system, mode, self._triggers[place]))

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
        by_power = powers(block.lengths, order)
        if rows.shape[1] == 1:
            # NumPy multiplies matrices faster than it broadcasts.
            return (rows[:, 0] * by_power)[:, None]
        return rows * by_power[:, None]

    def first_event(self, block: Block, at_start: bool) -> tuple[Finding | None, tuple[Doubt, ...]]:
        """Return the first event on a block of steps, and the touches before it.

        `at_start` says that the block begins with the first step of the arc.
        """
        doubts: list[Doubt] = []
        suspects = self._suspects(block, at_start) if self._triggers else ()
        earliest = self._earliest(block, suspects, doubts)
        if self._compiled.clock is not None:
            # The clock can reach its end only on the last step.
            last = len(block.lengths) - 1
            if earliest is None or earliest.place == last:
                at_end = self._clock_root(block, last)
                if at_end is not None and (earliest is None or at_end <= earliest.x):
                    earliest = Finding(last, at_end, None)
        return earliest, tuple(doubts)

    def _suspects(self, block: Block, at_start: bool) -> list[_Suspect]:
        """Return the event functions that are not proven positive, in the order of the steps."""
        every = self.polynomials(block)
        if at_start:
            self._deflate(every, block)
        _, functions, length = every.shape
        rounding = self._system.rounding
        margins, bernstein, bounds = margins_of(every.reshape(-1, length), rounding)
        zeros: dict[int, int] = {}
        for number in [*self._zero]:
            zeros[number] = self._steps_of_zero(number, every[:, number])
        # The least margins by which event functions are certified.
        gaps, grazing = self._compiled.layout.of_gaps, self._system.grazing
        tails = self._tails if at_start else {}
        most = max(grazing, *tails.values()) if tails else grazing
        # In longer precisions the bounds in float64 do not suffice.
        known = every.dtype == bernstein.dtype
        found: list[_Suspect] = []
        for row, margin in enumerate(margins.tolist()):
            if margin > most:
                continue
            place, number = divmod(row, functions)
            tail = tails.get(number) if place == 0 else None
            least = tail if tail is not None else grazing if gaps[number] else 0.0
            if not margin > least and place >= zeros.get(number, 0):
                polynomial = every[place, number].tolist()
                bound = float(bounds[row]) if known else rounding_bound(polynomial, rounding)
                found.append(
                    _Suspect(
                        place, number, polynomial, bernstein[row].tolist(), bound + (tail or 0.0)
                    )
                )
        return found

    def _earliest(
        self, block: Block, suspects: Sequence[_Suspect], doubts: list[Doubt]
    ) -> Finding | None:
        """Return the first event among the event functions that are not certified."""
        for _, group in itertools.groupby(suspects, lambda suspect: suspect.place):
            on_step = tuple(group)
            for place, number, polynomial, *_ in on_step:
                if polynomial[0] < 0:
                    # The event function falls at the start of the step.
                    return Finding(place, 0 * block.lengths[place], self._triggers[number])
            found = self._first_on_step(block, on_step, doubts)
            if found is not None:
                return found
        return None

    def _first_on_step(
        self, block: Block, suspects: tuple[_Suspect, ...], doubts: list[Doubt]
    ) -> Finding | None:
        """Return the first event among event functions that are positive at the start of a step."""
        earliest: Finding | None = None
        first = -1
        for suspect in sorted(suspects, key=_guess) if len(suspects) > 1 else suspects:
            place, number, polynomial, *_ = suspect
            trigger = self._triggers[number]
            least = self._system.grazing if trigger.kind is _HITS else 0.0
            if earliest is not None and is_positive_until(
                polynomial, float(earliest.x), suspect.bound, least
            ):
                continue
            search, limit = _searched(suspect, least)
            if search.touch is not None or search.unsure:
                doubt = self._doubt(block, place, trigger, polynomial, search, limit)
                doubts += [doubt] if doubt is not None else []
            fall = search.fall
            if fall is not None and (earliest is None or (fall, number) < (earliest.x, first)):
                earliest, first = Finding(place, fall, trigger), number
        return earliest

    def _deflate(self, every: Any, block: Block) -> None:
        """Divide event functions that start at zero by time, in place.

        The event function of jamming is monitored from either sign.
        """
        for number, trigger in enumerate(self._triggers):
            polynomial = every[0, number].tolist()
            if trigger.kind is _HITS and polynomial[0] > self._system.place_of_rounding:
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
        elif trigger.kind is _HITS:
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


def _guess(suspect: _Suspect) -> int:
    """Return a number that is the smaller, the earlier an event function seems to fall."""
    bernstein = suspect.bernstein
    return next((k for k, b in enumerate(bernstein) if b <= 0), len(bernstein))


def _searched(suspect: _Suspect, grazing: float) -> tuple[Search, float]:
    """Return the first fall and touch of an event function, and the bound by which it touches.

    One that comes as close as `grazing`, if that is not zero, touches.
    """
    polynomial, bound = suspect.polynomial, suspect.bound
    known = suspect.bernstein if isinstance(polynomial[0], float) else None
    search = first_fall(polynomial, bound, known)
    if search.fall is None and search.touch is None and grazing:
        return search._replace(touch=lowest(polynomial, grazing)), grazing
    return search, bound


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
