"""Effects: what may act on a chain, one effect a file; scene parameters in, loads out.

An effect is a small frozen object. Its `loads(chain, q, u, t)` says where on the chain which force
or torque acts in that state; `potential_energy(chain, q)` is there when it has one. An effect
that is not wanted is left out: there is no switch, and nothing to switch off.

An effect that is not smooth also has `nonsmooth(chain)`, the dry friction and the obstacles that a
simulation makes modes of, and may have `smooth_loads`, what remains of its loads beside them. One
that adds to what moves has `equipped(chain)`, the chain with its rotors. One that is smooth piece
by piece has `breaks`, the times between them, and `during(t)`, the smooth effect from t on.
"""

from __future__ import annotations

import importlib
from typing import Any, Protocol

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.contact.elements import ContactElement
from twolink.loads import Loads


class Effect(Protocol):
    """Anything that yields loads in a state; numbers may be of any kind."""

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return what acts at angles q (rad), speeds u (rad/s) and time t (s)."""


# The name in a scene file, and the home of its class. A home is imported when a scene names it.
EFFECTS = {
    "gravity": ("twolink.effects.gravity", "Gravity"),
    "end_force": ("twolink.effects.end_force", "EndForce"),
    "joint_torque": ("twolink.effects.joint_torque", "JointTorque"),
    "sampled_torque": ("twolink.effects.sampled_torque", "SampledTorque"),
    "joint_damping": ("twolink.effects.joint_damping", "JointDamping"),
    "joint_friction": ("twolink.effects.joint_friction", "JointFriction"),
    "motor_inertia": ("twolink.effects.motor_inertia", "MotorInertia"),
    "joint_stop": ("twolink.effects.joint_stop", "JointStop"),
    "surface": ("twolink.effects.surface", "Surface"),
    "compliant_surface": ("twolink.effects.compliant_surface", "CompliantSurface"),
    "joint_spring": ("twolink.effects.joint_spring", "JointSpring"),
    "pd_control": ("twolink.effects.pd_control", "PdControl"),
    "end_drag": ("twolink.effects.end_drag", "EndDrag"),
}


def effect_class(name: str) -> Any:
    """Return the class of a named effect."""
    home, class_name = EFFECTS[name]
    return getattr(importlib.import_module(home), class_name)


def nonsmooth(effects: tuple[Effect, ...], chain: Chain) -> tuple[ContactElement, ...]:
    """Return the dry friction and the obstacles of all effects, in their order."""
    return tuple(
        element
        for effect in effects
        if hasattr(effect, "nonsmooth")
        for element in effect.nonsmooth(chain)
    )


def breaks(effects: tuple[Effect, ...]) -> tuple[float, ...]:
    """Return the rising times (s) at which any of the effects is not smooth."""
    return tuple(sorted({t for effect in effects for t in getattr(effect, "breaks", ())}))


def effects_during(effects: tuple[Effect, ...], t: float) -> tuple[Effect, ...]:
    """Return the effects that act from a time (s) on, until the next break."""
    return tuple(effect.during(t) if hasattr(effect, "during") else effect for effect in effects)


def smooth_loads(
    effects: tuple[Effect, ...], chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0
) -> Loads:
    """Return the loads of all effects, but for those of dry friction and obstacles."""
    return tuple(load for effect in effects for load in _smooth_loads_of(effect)(chain, q, u, t))


def _smooth_loads_of(effect: Any) -> Any:
    if hasattr(effect, "smooth_loads"):
        return effect.smooth_loads
    return (lambda *_: ()) if hasattr(effect, "nonsmooth") else effect.loads
