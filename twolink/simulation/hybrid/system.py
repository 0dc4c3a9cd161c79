"""The hybrid system: a chain, its effects and their elements, in numbers of one precision."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

from twolink.chain import Chain
from twolink.contact.elements import ContactElement
from twolink.effects import Effect, nonsmooth
from twolink.errors import SimulationError
from twolink.simulation.hybrid.tolerances import TRUNCATION
from twolink.simulation.smooth.taylor import step_tolerance


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

    @property
    def resolution(self) -> float:
        """The relative accuracy of a state at an event: of rounding, or of a truncated series."""
        return max(self.rounding, TRUNCATION * step_tolerance(self.precision, self.order))

    @property
    def least_root(self) -> Any:
        """The root of the depth (m^½) at which a press without speed begins: zero would stay so."""
        return self.number(self.rounding**0.5)

    @property
    def force_scale(self) -> float:
        """The factor that brings forces to the order of 1, as the other variables are."""
        chain, step = self.scene_chain, float(self.longest_step)
        lever = float(chain.L1 + chain.L2)
        inertia = float(chain.I_C1 + chain.I_C2 + (chain.m1 + chain.m2) * lever * lever)
        return step * step * max(lever, 1.0) / inertia

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
