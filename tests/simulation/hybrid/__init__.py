"""Tests of the hybrid simulator: a module for each of its own, and the systems that they share."""

import math
from dataclasses import replace

import numpy as np

from twolink.chain import Chain
from twolink.contact.states import ContactState
from twolink.effects import contact_elements
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.formulations import FORMULATIONS
from twolink.integration.precisions import PRECISIONS
from twolink.scene import Scene
from twolink.simulation.hybrid.mode import Mode
from twolink.simulation.hybrid.start import start_state
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem

BARS = Chain.uniform_bars()
"""Two uniform bars of 1 kg and 1 m: M11 = 4/3, M22 = 1/3 and M12 = cos(q2 − q1)/2."""

BALANCED = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (2.0, 0.5))
"""Both mass centres on the joints: each link turns on its own, and M = diag(3, 1/2)."""


STOP = JointStop("A", lower=0.0, restitution=0.5)
ONTO = JointTorque((-6.0, 0.0))
"""Link 1 turns to the stop with −2 rad/s²."""


BOUNCES = Scene(BALANCED, (1.0, 0.0), (0.0, 0.0), 2.5, (ONTO, STOP))
"""Link 1 is at its stop after 1 s, and again at 2 s: from there for 1/2 s."""

BOUNCE_TIMES = np.linspace(0, 2.5, 26)


def tampered(run, t, variable, by):
    """Return a run whose step at a time has one value wrong."""
    coefficients = run.polynomials.coefficients.copy()
    step = int(np.searchsorted(run.polynomials.starts, t, side="right")) - 1
    coefficients[step, variable, 0] += by
    return replace(run, polynomials=replace(run.polynomials, coefficients=coefficients))


def system_of(
    *effects,
    chain: Chain = BARS,
    precision: str = "double",
    formulation: str = "lagrange",
    longest_step: float = 0.5,
    elements=None,
) -> HybridSystem:
    """Return the system of a chain under effects; `elements` stand for those of the effects."""
    number = PRECISIONS[precision].number
    own = chain.convert(number)
    found = contact_elements(effects, own) if elements is None else tuple(elements)
    return HybridSystem(
        chain, own, FORMULATIONS[formulation].equations, effects, found, precision, None, number,
        PRECISIONS[precision].rounding, longest_step,
    )  # fmt: skip


def state_of(system: HybridSystem, q, u=(0.0, 0.0)) -> HybridState:
    """Return the state of a system at the start of a run."""
    scene = Scene(system.scene_chain, tuple(q), tuple(u), 1.0, system.effects)
    return start_state(system, scene)


def mode_of(system: HybridSystem, *states: ContactState, dents=()) -> Mode:
    """Return the mode in which the elements of a system have these states."""
    return Mode(system.names, tuple(states), tuple(dents))


def stopped_chain(*more, restitution=0.5, **options) -> HybridSystem:
    """Return the system of a chain that turns to a stop."""
    stop = JointStop("A", lower=0.0, restitution=restitution)
    return system_of(ONTO, stop, *more, chain=BALANCED, **options)


def hitting(system: HybridSystem, speed: float, index: int = 0) -> HybridState:
    """Return the state in which link 1 arrives at its stop, moving at a speed."""
    state = state_of(system, (1.0, 0.0))
    gaps = tuple(0.0 if i == index else gap for i, gap in enumerate(state.gaps))
    return state._replace(t=2.0, q=(0.0, 0.0), u=(speed, 0.0), gaps=gaps)


def sliding_painleve(restitution=0.5):
    """Return the shipped scene's system, whose slide locks under its weight, and its state."""
    q = (1.1, 1.3)
    floor = Surface(
        (0.0, math.sin(1.1) + math.sin(1.3)), (0.0, -1.0), friction=2.0, restitution=restitution
    )
    system = system_of(Gravity(9.81), floor)
    u = np.linalg.solve([-np.cos(q), -np.sin(q)], [0.0, 0.2])
    for direction in (1, -1):
        speeds = tuple(map(float, direction * u))
        yield (
            system,
            state_of(system, q)._replace(u=speeds, touching=frozenset({0}), sliding=(direction,)),
        )


__all__ = [
    "BALANCED", "BARS", "ONTO", "STOP", "hitting", "mode_of", "sliding_painleve", "state_of",
    "stopped_chain", "system_of",
]  # fmt: skip
