"""The energy of a scene in which nothing drives: kinetic, potential, and stored in cushions."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.campaign.seen import CUSHION, Seen
from twolink import kinematics, lagrange
from twolink.effects import ConservativeEffect

# Effects that cannot supply energy: each has a potential, dissipates energy, or does no work.
_PASSIVE = (
    "Gravity",
    "JointDamping",
    "JointFriction",
    "MotorInertia",
    "JointStop",
    "Surface",
    "CompliantSurface",
    "JointSpring",
    "EndDrag",
    "EndForce",
    "PdControl",
)


def is_passive(seen: Seen) -> bool:
    """Return whether no effect drives, and no law of restitution may create energy."""
    for effect in seen.scene.effects:
        name = type(effect).__name__
        if name not in _PASSIVE or (name == "EndForce" and effect.sliding is not None):
            return False
        if name == "PdControl" and min(*effect.proportional, *effect.derivative) < 0:
            return False
    return not any(element.gains for element in seen.elements)


def may_store_unseen(seen: Seen) -> bool:
    """Return whether a surface yields, whose stored energy is not counted while it is pressed."""
    return any(element.yields for element in seen.elements)


def energy(seen: Seen) -> tuple[Any, Any]:
    """Return T + V (J) at the times seen, and the size of its parts."""
    pair, speeds = (seen.q[0], seen.q[1]), (seen.u[0], seen.u[1])
    parts = [np.asarray(lagrange.kinetic_energy(seen.chain, pair, speeds))]
    for effect in seen.scene.effects:
        parts.append(_potential(effect, seen.chain, pair) + 0 * seen.t)
    for i, element in seen.of_kind(CUSHION):
        if element.stored is not None:
            depth = np.where(seen.states(i) == "OPEN", seen.sunk(i), -seen.gap(element))
            parts.append(element.stored(depth, 0.0))
    return sum(parts), sum(np.abs(part).max() for part in parts)


def _potential(effect: Any, chain: Any, q: Any) -> Any:
    """Return the potential energy (J) of an effect: of constant forces and of control, too."""
    name = type(effect).__name__
    if name == "EndForce":
        return -effect.normal * kinematics.position(chain, q, chain.D)[1]
    if name == "PdControl":
        (p1, p2), (x1, x2) = effect.proportional, effect.target
        return (p1 * (x1 - q[0]) ** 2 + p2 * (x2 - (q[1] - q[0])) ** 2) / 2
    return effect.potential_energy(chain, q) if isinstance(effect, ConservativeEffect) else 0.0
