"""Event functions that are zero since the start of an arc, until they have grown."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from twolink.contact.states import EventKind
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.polishing import horner
from twolink.simulation.hybrid.state import HybridState


class _Grown(NamedTuple):
    """An event function that is no longer zero at the end of a step, within a `size`.

    `place` is the number of the step in the last block, or −1 before it.
    """

    place: int
    polynomial: list[Any]
    size: float

    def by(self, place: int, x: Any) -> bool:
        """Return whether it has grown above zero by x on a step of the last block."""
        if self.place < place:
            return bool(sum(self.polynomial) > 0)
        return self.place == place and bool(horner(self.polynomial, x) > self.size)


class Zeros:
    """The event functions of an arc that are zero within round-off, by their numbers."""

    def __init__(self, compiled: CompiledMode, state: HybridState | None) -> None:
        """Begin at a state, at which rigid contacts may touch without a force."""
        self._sizes: dict[int, float] = {}
        self._grown: dict[int, _Grown] = {}
        touching = () if state is None else state.touching
        self._gaps = [
            (number, trigger.index)
            for number, trigger in enumerate(compiled.layout.triggers if touching else ())
            if trigger.kind is EventKind.HITS
            and trigger.index in touching
            and state is not None
            and state.compliant[trigger.index] is None
        ]

    def add(self, number: int, size: float) -> None:
        """Add an event function that is zero within a size from the start on."""
        self._sizes[number] = size

    def steps(self, every: Any) -> dict[int, int]:
        """Return on how many steps of the next block each event function is still zero.

        `every` has all event functions, shape (n, m, p + 1). After the first step at whose end one
        is not zero, it is monitored.
        """
        for number, grown in self._grown.items():
            self._grown[number] = grown._replace(place=-1)
        return {number: self._steps_of(number, every[:, number]) for number in tuple(self._sizes)}

    def _steps_of(self, number: int, polynomials: Any) -> int:
        ends = np.abs(polynomials.sum(axis=1).astype(float))
        grown = np.flatnonzero(ends > self._sizes[number])
        if not len(grown):
            return len(ends)
        place = int(grown[0])
        self._grown[number] = _Grown(place, polynomials[place].tolist(), self._sizes.pop(number))
        return place + 1

    def departed(self, place: int, x: Any) -> frozenset[int]:
        """Return the contacts that touched without a force, and have left by x on a step.

        Their gaps were zero at the start of the arc, and have grown by then.
        """
        return frozenset(
            index
            for number, index in self._gaps
            if number not in self._sizes
            and (number not in self._grown or self._grown[number].by(place, x))
        )
