"""The hybrid system: a chain, its effects and their elements, in numbers of one precision."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

from twolink.chain import Chain
from twolink.contact.elements import ContactElement
from twolink.effects import Effect, nonsmooth
from twolink.errors import SimulationError


@dataclass(frozen=True)
class HybridSystem:
    """All that stays the same between two discontinuities of the effects.

    `chain` has numbers of the type `number`, of the named `precision` whose relative spacing is
    `rounding`; `scene_chain` is the same in float64. `longest_step` is in s.
    """

    scene_chain: Chain
    chain: Chain
    formulation: ModuleType
    effects: tuple[Effect, ...]
    elements: tuple[ContactElement, ...]
    precision: str
    order: int | None
    number: Any
    rounding: float
    longest_step: float

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the elements."""
        return tuple(element.name for element in self.elements)

    def check(self) -> None:
        """Raise `SimulationError` if two frictions act along one coordinate."""
        rubbing = [e.tangent for e in self.elements if e.normal is None]
        for element in self.elements:
            if element.normal is None and rubbing.count(element.tangent) > 1:
                raise SimulationError(
                    f"{element.name} has dry friction twice; the scene must have one for each"
                )

    def with_effects(self, effects: tuple[Effect, ...]) -> HybridSystem:
        """Return the system under other effects that have the same elements."""
        return replace(self, effects=effects, elements=nonsmooth(effects, self.chain))
