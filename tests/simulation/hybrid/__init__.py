"""Tests of the hybrid simulator: a module for each of its own, and the systems that they share."""

from twolink.chain import Chain
from twolink.contact.states import ContactState
from twolink.effects import nonsmooth
from twolink.scene import Scene
from twolink.simulation.hybrid.formulations import FORMULATIONS
from twolink.simulation.hybrid.mode import Mode
from twolink.simulation.hybrid.start import start_state
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.smooth.taylor import number_type, rounding

BARS = Chain.uniform_bars()
"""Two uniform bars of 1 kg and 1 m: M11 = 4/3, M22 = 1/3 and M12 = cos(q2 − q1)/2."""

BALANCED = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (2.0, 0.5))
"""Both mass centres on the joints: each link turns on its own, and M = diag(3, 1/2)."""


def system_of(
    *effects,
    chain: Chain = BARS,
    precision: str = "double",
    formulation: str = "lagrange",
    longest_step: float = 0.5,
    elements=None,
) -> HybridSystem:
    """Return the system of a chain under effects; `elements` stand for those of the effects."""
    number = number_type(precision)
    own = chain.convert(number)
    found = nonsmooth(effects, own) if elements is None else tuple(elements)
    return HybridSystem(
        chain, own, FORMULATIONS[formulation], effects, found, precision, None, number,
        rounding(precision), longest_step,
    )  # fmt: skip


def state_of(system: HybridSystem, q, u=(0.0, 0.0)) -> HybridState:
    """Return the state of a system at the start of a run."""
    scene = Scene(system.scene_chain, tuple(q), tuple(u), 1.0, system.effects)
    return start_state(system, scene)


def mode_of(system: HybridSystem, *states: ContactState, dents=()) -> Mode:
    """Return the mode in which the elements of a system have these states."""
    return Mode(system.names, tuple(states), tuple(dents))


__all__ = ["BALANCED", "BARS", "mode_of", "state_of", "system_of"]
