"""Effects on a chain, one in each file, and their base classes.

An effect that a scene omits is not imported, evaluated or compiled. `twolink.effects.effect`
has the base classes for effects of your own.
"""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from twolink.effects.effect import (
    ConservativeEffect,
    ContactEffect,
    Effect,
    ParametricEffect,
    PiecewiseEffect,
    RotorEffect,
    contact_elements,
    discontinuities,
    pieces_at,
    potential_energy,
    smooth_loads,
    with_rotors,
)
from twolink.text import distinct_names

if TYPE_CHECKING:
    from twolink.effects.compliant_surface import CompliantSurface
    from twolink.effects.end_drag import EndDrag
    from twolink.effects.end_force import EndForce
    from twolink.effects.gravity import Gravity
    from twolink.effects.joint_damping import JointDamping
    from twolink.effects.joint_friction import JointFriction
    from twolink.effects.joint_spring import JointSpring
    from twolink.effects.joint_stop import JointStop
    from twolink.effects.joint_torque import JointTorque
    from twolink.effects.motor_inertia import MotorInertia
    from twolink.effects.pd_control import PdControl
    from twolink.effects.sampled_torque import SampledTorque
    from twolink.effects.surface import Surface

__all__ = [
    "EFFECTS",
    "CompliantSurface",
    "ConservativeEffect",
    "ContactEffect",
    "Effect",
    "EndDrag",
    "EndForce",
    "Gravity",
    "JointDamping",
    "JointFriction",
    "JointSpring",
    "JointStop",
    "JointTorque",
    "MotorInertia",
    "ParametricEffect",
    "PdControl",
    "PiecewiseEffect",
    "RotorEffect",
    "SampledTorque",
    "Surface",
    "contact_elements",
    "discontinuities",
    "effect_class",
    "is_built_in",
    "names_of",
    "pieces_at",
    "potential_energy",
    "smooth_loads",
    "with_rotors",
]


# Name in a scene file, and module and name of its class; modules are imported on demand.
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


def __getattr__(name: str) -> Any:
    """Return the class of an effect, imported on first access."""
    for home, class_name in EFFECTS.values():
        if class_name == name:
            return getattr(importlib.import_module(home), name)
    raise AttributeError(f"module 'twolink.effects' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the public names, including those not imported yet."""
    return sorted({*globals(), *__all__})


def is_registered(effect: Any) -> bool:
    """Return whether an object is an effect of this library, which cannot change."""
    return (type(effect).__module__, type(effect).__name__) in _HOMES


def is_built_in(effect: Any) -> bool:
    """Return whether the formulas of an effect, or of a piece of one, are of this library."""
    return type(effect).__module__ in _MODULES


_HOMES = frozenset(EFFECTS.values())
_MODULES = frozenset(home for home, _ in EFFECTS.values())


def effect_class(name: str) -> Any:
    """Return the class of a named effect."""
    home, class_name = EFFECTS[name]
    return getattr(importlib.import_module(home), class_name)


def names_of(effects: Iterable[Effect]) -> list[str]:
    """Return a name for each effect: that of its class, with its label or number if need be."""
    every = list(effects)
    classes = [type(effect).__name__ for effect in every]
    count = Counter(classes)
    names = (
        f"{name} {effect.label}".strip() if count[name] > 1 else name
        for name, effect in zip(classes, every, strict=True)
    )
    return distinct_names(names, "{} {}")
