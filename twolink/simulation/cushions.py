"""What the cushions of a motion have been through: how deep they are pressed, what they remember.

A rooted cushion has the root of its depth as a variable of the integration, a damped one that was
left has how far it is still sunk in, and one that yields has its dent.
"""

from __future__ import annotations

import math
from typing import Any

from twolink.arithmetic import sqrt
from twolink.contact.elements import CompliantContact, ContactElement, DryFriction
from twolink.contact.force_laws import Hysteresis, Phase, PlasticState


class Cushions:
    """The state of all cushions, by their numbers among the elements of a motion."""

    def __init__(self, elements: tuple[ContactElement, ...], kind: Any) -> None:
        """Let all be whole and at rest; `kind` makes numbers."""
        self._elements, self._kind = elements, kind
        self.roots: dict[int, Any] = {}
        self.sunk = {
            index: kind(0)
            for index, element in enumerate(elements)
            if isinstance(element, CompliantContact) and element.law.relaxation is not None
        }
        dents = tuple(
            PlasticState(Phase.WHOLE)
            if isinstance(element, CompliantContact) and element.memory
            else None
            for element in elements
        )
        self.dents: tuple[PlasticState | None, ...] = dents if any(dents) else ()

    def surface(self, index: int) -> Any:
        """Return the coordinate (m) of a cushion's surface, or of an obstacle, as it is now."""
        element = self._elements[index]
        assert not isinstance(element, DryFriction)
        dent = self.dents[index] if self.dents else None
        return element.bound - self._residual(dent) - self.sunk.get(index, 0)

    def press(self, index: int, least: float = 0.0) -> None:
        """Begin to press a cushion: at no depth, or at the `least` root of one (m^½)."""
        if self._law(index).rooted:
            self.roots[index] = self._kind(least)
        if index in self.sunk:
            self.sunk[index] = self._kind(0)
        if self._yields(index):
            memory, dent = self._remembered(index)
            self._remember(index, memory.pressed(dent))

    def leave(self, index: int, depth: Any) -> None:
        """End to press a cushion, from which the point comes off at a depth (m)."""
        self.roots.pop(index, None)
        if index in self.sunk:
            self.sunk[index] = depth
        if self._yields(index):
            memory, dent = self._remembered(index)
            if dent.phase is Phase.PRESSED_AGAIN:
                self._remember(index, memory.turned(dent, depth))

    def spring_back(self, resolution: float) -> float:
        """Let surfaces be back that are so but for rounding; return how long (s) others will take.

        It is infinity where none springs back. A surface that springs back fast needs steps that
        are as short, and would need them for ever.
        """
        soonest = math.inf
        for index, depth in self.sunk.items():
            if depth == 0:
                continue
            cushion = self._elements[index]
            assert isinstance(cushion, CompliantContact)
            rounding = resolution * max(1.0, abs(float(cushion.bound)))
            if abs(depth) <= rounding:
                self.sunk[index] = self._kind(0)
            else:
                times = math.log(2 * abs(float(depth)) / rounding)
                soonest = min(soonest, times / self._law(index).relaxation)
        return soonest

    def reach(self, index: int) -> None:
        """Go on with the next branch of a cushion's law."""
        memory, dent = self._remembered(index)
        self._change(index, dent, memory.reached(dent))

    def turn(self, index: int) -> None:
        """Go on with the branch of a cushion's law that holds from where the point has turned."""
        memory, dent = self._remembered(index)
        depth = self.roots[index] ** 2 + self._residual(dent)
        self._change(index, dent, memory.turned(dent, depth))

    def clear(self, index: int) -> None:
        """Forget a dent that is left behind."""
        self._remember(index, PlasticState(Phase.WHOLE))

    def _change(self, index: int, before: PlasticState, after: PlasticState) -> None:
        """Take up a branch at the same depth; the dent may be another."""
        sinks = self._residual(before) - self._residual(after)
        if sinks != 0:
            self.roots[index] = sqrt(self.roots[index] ** 2 + sinks)
        self._remember(index, after)

    def _remember(self, index: int, dent: PlasticState) -> None:
        dents = list(self.dents)
        dents[index] = dent
        self.dents = tuple(dents)

    def _yields(self, index: int) -> bool:
        """Return whether a cushion remembers what has been."""
        return bool(self.dents) and self.dents[index] is not None

    def _remembered(self, index: int) -> tuple[Hysteresis, PlasticState]:
        """Return how a cushion that yields remembers, and what."""
        cushion, dent = self._elements[index], self.dents[index]
        assert isinstance(cushion, CompliantContact)
        assert cushion.memory is not None
        assert dent is not None
        return cushion.memory, dent

    def _law(self, index: int) -> Any:
        cushion = self._elements[index]
        assert isinstance(cushion, CompliantContact)
        return cushion.law

    @staticmethod
    def _residual(dent: PlasticState | None) -> Any:
        return dent.residual if dent is not None else 0
