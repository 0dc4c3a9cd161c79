"""The event functions of an arc as polynomials of its steps."""

from __future__ import annotations

from typing import Any

from twolink.contact.states import EventKind
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.event_functions import EDGES
from twolink.simulation.hybrid.mode import Mode, Trigger
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.series import powers


class EventPolynomials:
    """The event functions of an arc, computed from the series of its variables."""

    def __init__(self, system: HybridSystem, compiled: CompiledMode, mode: Mode) -> None:
        """Store a mode, and the numbers that its variables are subtracted from."""
        self._compiled = compiled
        # The event functions that are monitored with the opposite sign.
        self._turned: frozenset[int] = frozenset()
        self._offsets: dict[int, Any] = {}
        layout = compiled.layout
        for place in layout.reversed:
            if layout.triggers[place].kind in EDGES:
                offset = _offset(system, mode, layout.triggers[place])
                self._offsets[place] = system.number(offset)

    def on(self, block: Block) -> Any:
        """Return the event functions on each step, on [0, 1]: shape (n, m, p + 1)."""
        coefficients, layout = block.coefficients, self._compiled.layout
        count, _, order = coefficients.shape
        by_power = powers(block.lengths, order)[:, None]
        if layout.is_plain and not self._turned:
            return coefficients[:, layout.variables] * by_power
        places, factors = self._compiled.terms(order, coefficients.dtype)
        rows = coefficients.reshape(count, -1)[:, places] * factors
        for place in self._turned:
            rows[:, place] = -rows[:, place]
        for place, offset in self._offsets.items():
            rows[:, place, 0] = rows[:, place, 0] + offset
        return rows * by_power

    def turn(self, number: int) -> None:
        """Monitor an event function with the opposite sign from now on."""
        self._turned ^= {number}


def _offset(system: HybridSystem, mode: Mode, trigger: Trigger) -> Any:
    """Return the number that a variable is subtracted from to give an event function."""
    branch = system.elements[trigger.index].branch(mode.dent(trigger.index))
    return branch.residual if trigger.kind is EventKind.CLEARS else branch.reach
