"""The zeros of event functions at the start of an arc, where round-off hides coefficients."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from twolink.contact.states import ContactState, EventKind
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.complementarity import Orders
from twolink.simulation.hybrid.dynamics import push_of
from twolink.simulation.hybrid.mode import Mode, Trigger
from twolink.simulation.hybrid.noise import Zero, size_of
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import LEADING, LEADING_SHARE
from twolink.simulation.series import powers_of

# Event functions that are places, speeds and forces.
_HITS = EventKind.HITS
_PLACES = frozenset((_HITS, EventKind.CLEARS))
_SPEEDS = frozenset((EventKind.STOPS, EventKind.TURNS))
_FORCES = frozenset((EventKind.LEAVES, EventKind.BREAKS))


class StartOfArc:
    """The powers of time with which event functions start, and the sizes below which they are zero.

    At the start of an arc, round-off decides which coefficients of an event function are zero.
    """

    def __init__(
        self,
        system: HybridSystem,
        compiled: CompiledMode,
        mode: Mode,
        orders: Orders,
        state: HybridState | None,
    ) -> None:
        """Store the arguments of `Certificate`."""
        self._state = state
        self._system, self._scales, self._compiled = system, system.scales, compiled
        self._mode, self._orders = mode, orders
        self._known_change: float | None = None

    def order(self, trigger: Trigger, polynomial: list[Any], block: Block) -> int | None:
        """Return how many leading coefficients are zero, None if all are.

        A force that seems to fall is zero if it is so by the selection, whose round-off is that of
        all forces.
        """
        order = self._order(trigger, polynomial, block)
        falls = order is not None and polynomial[order] < 0
        return None if falls and self._zero_of_selection(trigger) else order

    def _zero_of_selection(self, trigger: Trigger) -> float:
        """Return the scaled force that counts as zero by the selection, 0 if it is not zero."""
        known = self._orders.get(trigger)
        if not isinstance(known, Zero) or math.isinf(known.size):
            return 0.0
        return known.size * self._scales.force(trigger.index)

    def _order(self, trigger: Trigger, polynomial: list[Any], block: Block) -> int | None:
        if self._orders or self._compiled.clock is not None:
            order = self._known_order(trigger, polynomial, block)
            if order is not None:
                return order
        pace = 1.0
        if self._compiled.clock is None:
            pace = float(block.lengths[0]) / self._system.longest_step
        if trigger.kind is _HITS:
            return self._order_of_gap(trigger, polynomial, pace)
        is_speed = trigger.kind in _SPEEDS
        noise = self._noise(trigger, polynomial, block)
        if polynomial[0] > (self._speed_noise(trigger, noise) if is_speed else noise):
            return 0
        if polynomial[0] > 0 and trigger.kind is EventKind.LEAVES:
            return _order_of_small(polynomial, noise * pace)
        least = LEADING_SHARE * self._scales.resolution * _size(polynomial)
        if is_speed:
            least += self._speed_of_rounding(block, trigger.index)
        elif trigger.kind is EventKind.REACHES:
            least += self._root_of_rounding(trigger, block)
        order = _leading_zeros(polynomial, noise, noise, pace, least)
        # However slow it is, a slide that slows down takes its time to come to rest.
        slows = is_speed and order and polynomial[order] < 0 < polynomial[0]
        return 0 if slows else order

    def _order_of_gap(self, trigger: Trigger, polynomial: list[Any], pace: float) -> int | None:
        """Return how many leading coefficients of a gap are zero, None if all are.

        A gap is a variable of its own, and is zero only after a jump has set it to zero. Its first
        derivative is the speed of the state, which is known relative to u, however slow that is.
        """
        noise = self._scales.places_of_rounding[trigger.index]
        if polynomial[0] > noise:
            return 0
        if polynomial[0] > 0:
            return _order_of_small(polynomial, noise * pace)
        least = LEADING_SHARE * self._system.rounding * _size(polynomial)
        order = _leading_zeros(polynomial, 0.0, noise, pace, least)
        if order != 1 and polynomial[0] == 0 < polynomial[1] and self._opens(trigger):
            return 1
        return order

    def _known_order(self, trigger: Trigger, polynomial: list[Any], block: Block) -> int | None:
        """Return the order determined by the mode selection or by a speed, or None.

        If the independent variable is not time, time starts as a power of that variable, and the
        first coefficients may all be below the round-off of a place.
        """
        order, clock = self._orders.get(trigger), self._compiled.clock
        if order is None and clock is not None and polynomial[0] == 0 and self._opens(trigger):
            order = 1
        if order is None or isinstance(order, Zero):
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
        return bool(speed > self._speed_of_state(state, index))

    def _speed_of_state(self, state: HybridState, index: int) -> float:
        """Return the error that the speed of an element has through that of u."""
        return LEADING * self._scales.resolution * self._scales.sizes[index] * size_of(state.u)

    def _noise(self, trigger: Trigger, polynomial: list[Any], block: Block) -> float:
        """Return the size below which an event function at the start of an arc is zero."""
        if trigger.kind in _PLACES:
            return self._scales.places_of_rounding[trigger.index]
        size = _size(polynomial)
        if trigger.kind in _SPEEDS:
            size = max(size, self._change(block, trigger.index))
        elif trigger.kind is EventKind.BREAKS:
            size = max(size, 1.0)
        elif trigger.kind is EventKind.REACHES:
            # A root subtracted from its largest value.
            size = max(size, self._root(trigger))
        noise = LEADING * self._scales.resolution * size
        if trigger.kind in _FORCES:
            noise += self._scales.forces_of_rounding[trigger.index]
        return noise

    def _change(self, block: Block, index: int) -> float:
        """Return the sum of the sizes of all changes of an element's speed in the first step.

        A change of a speed is due to forces that may nearly cancel.
        """
        if self._known_change is None:
            order = block.coefficients.shape[2]
            rows = block.coefficients[0, 2:4] * powers_of(block.lengths[:1], order)
            changes = float(np.abs(rows).astype(float).sum())
            least = 1 / float(self._system.longest_step)
            self._known_change = max(changes, least)
        return self._scales.sizes[index] * self._known_change

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
        row = size_of(self._system.pose(self._state.q).row(along))
        row /= self._scales.sizes[trigger.index]
        return min(noise, self._speed_of_state(self._state, trigger.index) + row * noise)

    def _speed_of_rounding(self, block: Block, index: int) -> float:
        """Return the speed that round-off of large forces causes in the first step."""
        pressing, duration = self._pressing(), self._duration(block)
        return LEADING * self._scales.resolution * self._scales.sizes[index] * pressing * duration

    def _root_of_rounding(self, trigger: Trigger, block: Block) -> float:
        """Return the change of √depth in the first step by the round-off of the speed.

        Where compression turns into restitution, the speed is zero within round-off.
        """
        root = self._root(trigger)
        if self._state is None or root == 0:
            return 0.0
        changed = LEADING * self._scales.resolution * self._change(block, trigger.index)
        speed = max(changed, self._speed_of_state(self._state, trigger.index))
        return speed * self._duration(block) / (2 * root)

    def _root(self, trigger: Trigger) -> float:
        """Return √depth (m^½) of a compliant surface at the start."""
        own = None if self._state is None else self._state.compliant[trigger.index]
        return 0.0 if own is None or own.sqrt_depth is None else abs(float(own.sqrt_depth))

    def _duration(self, block: Block) -> float:
        """Return the time (s) that the first step takes."""
        clock = self._compiled.clock
        if clock is None:
            return float(block.lengths[0])
        order = block.coefficients.shape[2]
        row = block.coefficients[0, clock] * powers_of(block.lengths[:1], order)
        return abs(float(row[1:].sum()))

    def _pressing(self) -> float:
        """Return the sum of the accelerations (rad/s²) that single compliant surfaces give."""
        state, found = self._state, 0.0
        if state is None or not any(state.compliant):
            return found
        pose = self._system.pose(state.q)
        for index, own in enumerate(state.compliant):
            element = self._system.elements[index]
            is_open = self._mode.states[index] is ContactState.OPEN
            if own is None or element.normal is None or is_open:
                continue
            push = push_of(pose, element, self._mode.dent(index), state.u, own.sqrt_depth)
            given = pose.impulse_response(pose.row(element.normal))
            found += abs(float(push)) * max(abs(float(x)) for x in given)
        return found

    def zero_size(self, trigger: Trigger, polynomial: list[Any], block: Block) -> float:
        """Return the size up to which an event function that starts as zero stays zero."""
        state, index = self._state, trigger.index
        if trigger.kind is _HITS and state is not None and index in state.touching:
            # A contact that carries no force. Its derivatives are round-off, which may grow, and
            # its place is given in float64. A point in a compliant surface does not hit it.
            size = self._scales.sizes[index] * LEADING * PRECISIONS["double"].rounding
            return size if state.compliant[index] is None else math.inf
        return max(self._noise(trigger, polynomial, block), self._zero_of_selection(trigger))


def _order_of_small(polynomial: list[Any], noise: float) -> int:
    """Return 1 for a function that begins within round-off of zero and grows, else 0.

    This is a lower bound, as it omits the contribution of a tiny growing gap.
    """
    return 1 if polynomial[1] > noise else 0


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
