"""Kinds of modes, which share compiled code, and the runs that they are compiled for."""

from __future__ import annotations

from typing import Any, NamedTuple

from twolink.effects import is_built_in
from twolink.integration.precisions import PrecisionName
from twolink.names import FormulationName
from twolink.simulation.hybrid.mode import Mode
from twolink.values import Content


class Kind(NamedTuple):
    """Modes that share compiled code: a chain, effects and a mode without their parameters.

    Zeros replace the numbers of effects and of the mode that are parameters of the code.
    `recovering` are the surfaces that are not in contact and have not recovered. Optimised code
    compiles five to twenty times longer, and takes a third to a half of the time per step.
    """

    chain: Content
    effects: Content
    mode: Mode
    recovering: tuple[int, ...]
    optimised: bool

    @property
    def is_shared(self) -> bool:
        """Whether later runs find the compiled code, and any thread may compile it.

        Effects of the user are evaluated in the thread of the run alone: it may hold their locks.
        """
        effects: tuple[Any, ...] = self.effects.objects
        return self.chain.is_value and self.effects.is_value and all(map(is_built_in, effects))


class Target(NamedTuple):
    """The formulation, the precision and the order that modes are compiled for."""

    formulation: FormulationName
    precision: PrecisionName
    order: int | None
