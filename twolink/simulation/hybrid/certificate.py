"""The certificate of an arc: no event function falls before the arc's end.

On each step every event function is a polynomial. It is proven positive, or its first root is
isolated there. No event function is ever switched off: one that starts at zero, as a gap does after
an impact, is divided by the power of time with which it starts.
"""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import numpy as np

from twolink.contact.states import EventKind
from twolink.simulation.hybrid.compile import CompiledMode
from twolink.simulation.hybrid.complementarity import NO_ORDERS, Orders
from twolink.simulation.hybrid.mode import Doubt, Mode, Trigger
from twolink.simulation.hybrid.roots import Root, are_positive, first_fall, rounding_bounds
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import CONTACT_GAP, LEADING, LEADING_SHARE


class Finding(NamedTuple):
    """The first event on a block of steps: on which step, at which x in [0, 1] of it, and which.

    `trigger` is None if the clock comes to the end of the arc first.
    """

    place: int
    x: Any
    trigger: Trigger | None


class Block(NamedTuple):
    """Steps taken one after another: starts, lengths, and coefficients of shape (n, v, p + 1)."""

    starts: Any
    lengths: Any
    coefficients: Any


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
    ) -> None:
        """Take the compiled mode, and the time (s) after which the arc ends in any case.

        `pressing` is the sum of the accelerations (rad/s²) that single compliant surfaces give;
        `orders` are those of event functions that the selection has found to grow from zero.
        """
        self._orders = orders
        self._system, self._compiled, self._span = system, compiled, span
        self._pressing = pressing
        watched = compiled.watched
        self._triggers = [w.trigger for w in watched]
        self._variables = np.array([w.variable for w in watched], dtype=int)
        self._integral = np.array([w.integral for w in watched], dtype=bool)
        self._has_integrals = any(w.integral for w in watched)
        self._reversed = {place for place, w in enumerate(watched) if w.factor < 0}
        chain = system.scene_chain
        self._lever = max(1.0, float(chain.L1 + chain.L2))
        self._place_of_rounding = self._lever * LEADING * system.rounding
        self._constant = np.zeros(len(watched), dtype=bool)
        self._offsets = {
            place: system.number(offset)
            for place, trigger in enumerate(self._triggers)
            if (offset := _offset(system, mode, trigger)) is not None
        }

    def polynomials(self, block: Block) -> Any:
        """Return the event functions on each step, on [0, 1]: shape (n, m, p + 1)."""
        rows = block.coefficients[:, self._variables]
        order = rows.shape[2]
        if self._has_integrals:
            rates = rows[:, self._integral, 1:] * _counting(order, rows)
            rows[:, self._integral, :-1] = rates
            rows[:, self._integral, -1] = 0
        for place in self._reversed:
            rows[:, place] = -rows[:, place]
        for place, offset in self._offsets.items():
            rows[:, place, 0] = rows[:, place, 0] + offset
        rows *= powers(block.lengths, order)[:, None, :]
        return rows

    def first_event(self, block: Block, at_start: bool) -> tuple[Finding | None, tuple[Doubt, ...]]:
        """Return the first event on a block of steps, and the touches before it.

        `at_start` says that the first step is that of the arc.
        """
        doubts: list[Doubt] = []
        suspects: dict[int, list[tuple[int, Any]]] = {}
        if self._triggers:
            every = self.polynomials(block)
            if at_start:
                self._deflate(every, block)
            positive = self._positive(every) | self._constant
            if not positive.all():
                for place, number in zip(*np.nonzero(~positive), strict=True):
                    suspects.setdefault(int(place), []).append((int(number), every[place, number]))
        # Only on the last step may the clock come to its end.
        last = len(block.lengths) - 1
        for place in sorted({*suspects, last}):
            earliest = self._earliest(block, place, suspects.get(place, ()), doubts)
            at_end = self._clock_root(block, place) if place == last else None
            if at_end is not None and (earliest is None or at_end <= earliest.x):
                return Finding(place, at_end, None), tuple(doubts)
            if earliest is not None:
                return earliest, tuple(doubts)
        return None, tuple(doubts)

    def _positive(self, every: Any) -> Any:
        """Return which event functions are proven positive on each step: shape (n, m)."""
        flat = every.reshape(-1, every.shape[2])
        return are_positive(flat, self._system.rounding).reshape(every.shape[:2])

    def _earliest(
        self, block: Block, place: int, suspects: Any, doubts: list[Doubt]
    ) -> Finding | None:
        """Return the first event on a step, among the event functions that are not certified."""
        earliest: Finding | None = None
        for number, polynomial in suspects:
            trigger = self._triggers[number]
            if polynomial[0] < 0:
                # It falls at once.
                return Finding(place, 0 * block.lengths[place], trigger)
            bound = float(rounding_bounds(polynomial[None], self._system.rounding)[0])
            root = first_fall(polynomial.tolist(), bound)
            if root is None:
                continue
            if root.touches:
                doubt = self._doubt(block, place, trigger, polynomial, root, bound)
                doubts += [doubt] if doubt is not None else []
            elif earliest is None or root.x < earliest.x:
                earliest = Finding(place, root.x, trigger)
        return earliest

    def _deflate(self, every: Any, block: Block) -> None:
        """Divide event functions that start at zero by time, in place.

        One that locks is watched from either side.
        """
        for number, trigger in enumerate(self._triggers):
            if trigger.kind is EventKind.HITS and every[0, number, 0] > self._place_of_rounding:
                continue
            if trigger.kind is EventKind.JAMS and every[0, number, 0] < 0:
                every[:, number] = -every[:, number]
                self._reversed ^= {number}
            polynomial = every[0, number].copy()
            order = self._order(trigger, polynomial, block)
            every[0, number] = 0
            if order is None:
                # A contact that others hold off: its gap stays zero.
                self._constant[number] = True
                continue
            every[0, number, : len(polynomial) - order] = polynomial[order:]
            if order:
                # The terms at the end measure what the series leaves out.
                every[0, number, 0] -= abs(polynomial[-1]) + abs(polynomial[-2])

    def _order(self, trigger: Trigger, polynomial: Any, block: Block) -> int | None:
        """Return how many leading coefficients are zero, None if all are."""
        order = self._known_order(trigger, polynomial, block)
        if order is not None:
            return order
        noise, pace = self._noise(trigger, polynomial, block), 1.0
        if self._compiled.clock is None:
            pace = float(block.lengths[0]) / float(self._system.longest_step)
        if polynomial[0] > noise:
            return 0
        if polynomial[0] > 0 and trigger.kind in (EventKind.HITS, EventKind.LEAVES):
            # Without a tiny gap that grows it is a lower bound.
            return 1 if polynomial[1] > noise * pace else 0
        # A gap has digits of its own, and is zero only where a jump has made it so.
        first = 0.0 if trigger.kind is EventKind.HITS else noise
        own = self._system.rounding if trigger.kind is EventKind.HITS else self._system.resolution
        least = LEADING_SHARE * own * float(np.abs(polynomial).astype(float).sum())
        least += self._speed_of_rounding(trigger, block)
        return _leading_zeros(polynomial, first, noise, pace, least)

    def _known_order(self, trigger: Trigger, polynomial: Any, block: Block) -> int | None:
        """Return the order that the selection of the mode has found, None if it has not.

        Where the integration is not in time, time begins as a power of its variable.
        """
        order = self._orders.get(trigger)
        if order is None:
            return None
        if self._compiled.clock is not None:
            clock = block.coefficients[0, self._compiled.clock]
            order *= next((k for k, c in enumerate(clock) if k and c != 0), len(clock))
        return order if order < len(polynomial) - 1 and polynomial[order] > 0 else None

    def _noise(self, trigger: Trigger, polynomial: Any, block: Block) -> float:
        """Return the size below which an event function at the start of an arc is zero."""
        if trigger.kind in (EventKind.HITS, EventKind.CLEARS):
            return self._place_of_rounding
        size = float(np.abs(polynomial).astype(float).sum())
        if trigger.kind in (EventKind.STOPS, EventKind.TURNS):
            # The speed changes by forces that may nearly cancel.
            rows = block.coefficients[0, 2:4] * powers(block.lengths[:1], len(polynomial))
            changes = float(np.abs(rows).astype(float).sum())
            size = max(size, self._lever * max(changes, 1 / float(self._system.longest_step)))
        elif trigger.kind is EventKind.BREAKS:
            size = max(size, 1.0)
        return LEADING * self._system.resolution * size + self._force_of_rounding(trigger)

    def _speed_of_rounding(self, trigger: Trigger, block: Block) -> float:
        """Return the speed that the rounding of large forces makes in the first step."""
        if trigger.kind not in (EventKind.STOPS, EventKind.TURNS):
            return 0.0
        clock, duration = self._compiled.clock, float(block.lengths[0])
        if clock is not None:
            row = (
                block.coefficients[0, clock]
                * powers(block.lengths[:1], block.coefficients.shape[2])[0]
            )
            duration = abs(float(row[1:].sum()))
        return LEADING * self._system.resolution * self._lever * self._pressing * duration

    def _force_of_rounding(self, trigger: Trigger) -> float:
        """Return the force that the rounding of a place makes in a stiff surface, scaled."""
        element = self._system.elements[trigger.index]
        law = element.compliant
        if trigger.kind not in (EventKind.LEAVES, EventKind.BREAKS) or law is None or law.rooted:
            return 0.0
        depth = CONTACT_GAP * self._system.rounding * max(1.0, abs(float(element.bound)))
        return abs(float(law.force(depth, 0.0, 0.0))) * self._system.force_scale

    def _clock_root(self, block: Block, place: int) -> Any:
        """Return where on a step the clock comes to the end of the arc, or None."""
        if self._compiled.clock is None:
            return None
        row = block.coefficients[place, self._compiled.clock]
        polynomial = -row * powers(block.lengths[place : place + 1], len(row))[0]
        polynomial[0] = polynomial[0] + self._span
        if polynomial.sum() > 0:
            return None
        root = first_fall(polynomial.tolist(), 0.0)
        return 1 if root is None else root.x

    def _doubt(
        self, block: Block, place: int, trigger: Trigger, polynomial: Any, root: Root, bound: float
    ) -> Doubt | None:
        """Return the doubt that a touch leaves, if the motion depends on it."""
        element = self._system.elements[trigger.index]
        if trigger.kind is EventKind.HITS:
            x = float(root.x)
            bend = sum(
                k * (k - 1) * float(c) * x ** (k - 2) for k, c in enumerate(polynomial) if k > 1
            )
            speed = math.sqrt(2 * abs(bend) * bound) / float(block.lengths[place])
        elif element.hysteretic and trigger.kind in (EventKind.BREAKS, EventKind.STOPS):
            speed = math.inf
        else:
            return None
        return Doubt(float(block.starts[place]), trigger, speed)


def _leading_zeros(
    polynomial: Any, first: float, noise: float, pace: float, least: float
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
    """Return the number that a variable is subtracted from to give an event function, or None."""
    if trigger.kind not in (EventKind.CLEARS, EventKind.REACHES):
        return None
    branch = system.elements[trigger.index].branch(mode.dent(trigger.index))
    return branch.residual if trigger.kind is EventKind.CLEARS else branch.reach


def _counting(order: int, like: Any) -> Any:
    return np.arange(1.0, order).astype(like.dtype)


def powers(lengths: Any, count: int) -> Any:
    """Return the powers 0 … count − 1 of each length: shape (n, count)."""
    if lengths.dtype == np.float64:
        return lengths[:, None] ** _exponents(count)
    found = np.empty((len(lengths), count), dtype=lengths.dtype)
    found[:, 0] = 1
    for k in range(1, count):
        found[:, k] = found[:, k - 1] * lengths
    return found


@functools.cache
def _exponents(count: int) -> Any:
    return np.arange(count)
