"""Event functions that are zero since the start of an arc, until they have grown."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from twolink.contact.states import EventKind
from twolink.simulation.hybrid.bernstein import bernstein_matrix
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.polishing import horner
from twolink.simulation.hybrid.roots import first_fall
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


class Fallen(NamedTuple):
    """The event function of this number is below zero by its size at x on a step of a block."""

    place: int
    x: Any
    number: int


class Zeros:
    """The event functions of an arc that are zero within round-off, by their numbers.

    `fallen` is the first place on the last block at which one of them is no longer zero, as it
    falls: an event.
    """

    def __init__(self, compiled: CompiledMode, state: HybridState | None) -> None:
        """Begin at a state, at which rigid contacts may touch without a force."""
        self.fallen: Fallen | None = None
        self._number = compiled.number
        self._sizes: dict[int, float] = {}
        self._grown: dict[int, _Grown] = {}
        self._lowest: dict[int, float] = {}
        # Bounds from below on each step of the last block.
        self._bounds: dict[int, Any] = {}
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
        self._lowest, self._bounds, self.fallen = self.lowest(len(every)), {}, None
        return {number: self._steps_of(number, every[:, number]) for number in tuple(self._sizes)}

    def _steps_of(self, number: int, polynomials: Any) -> int:
        size = self._sizes[number]
        in_floats = polynomials.astype(float)
        bounds = in_floats.dot(bernstein_matrix(in_floats.shape[1])).min(axis=1)
        grown = np.flatnonzero(np.abs(in_floats.sum(axis=1)) > size)
        count = int(grown[0]) + 1 if len(grown) else len(bounds)
        self._bounds[number] = np.maximum(bounds[:count], -size)
        for place in np.flatnonzero(bounds[:count] < -size).tolist():
            x = self._fall(polynomials[place].tolist(), size)
            if x is not None:
                self._add_fall(Fallen(place, x, number))
                return count
        if len(grown):
            polynomial = polynomials[count - 1].tolist()
            self._grown[number] = _Grown(count - 1, polynomial, self._sizes.pop(number))
        return count

    def _fall(self, polynomial: list[Any], size: float) -> Any:
        """Return where on a step a polynomial falls below its size, None if it does not."""
        above = [polynomial[0] + self._number(size), *polynomial[1:]]
        return first_fall(above, 0.0).fall if above[0] > 0 else 0 * polynomial[0]

    def _add_fall(self, found: Fallen) -> None:
        if self.fallen is None or found < self.fallen:
            self.fallen = found

    def lowest(self, count: int) -> dict[int, float]:
        """Return bounds from below on the event functions while they were zero, by their numbers.

        They hold so far, up to this number of steps of the last block.
        """
        found = dict(self._lowest)
        for number, bounds in self._bounds.items():
            found[number] = min([found.get(number, 0.0), *bounds[:count].tolist()])
        return found

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
