"""Effects: what may act on a chain, one effect a file; scene parameters in, loads out.

An effect is a small frozen object. Its `loads(chain, q, u, t)` says where on the chain which force
or torque acts in that state; `potential_energy(chain, q)` is there when it has one. An effect
that is not wanted is left out: there is no switch, and nothing to switch off.
"""

from __future__ import annotations

import importlib
from typing import Any, Protocol

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
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
    "joint_damping": ("twolink.effects.joint_damping", "JointDamping"),
    "joint_friction": ("twolink.effects.joint_friction", "JointFriction"),
    "joint_spring": ("twolink.effects.joint_spring", "JointSpring"),
    "pd_control": ("twolink.effects.pd_control", "PdControl"),
    "end_drag": ("twolink.effects.end_drag", "EndDrag"),
}


def effect_class(name: str) -> Any:
    """Return the class of a named effect."""
    home, class_name = EFFECTS[name]
    return getattr(importlib.import_module(home), class_name)
