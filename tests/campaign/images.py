"""Images of scenes whose motions follow from each other: turned, mirrored, in another order."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.scene import Scene

Vector = tuple[float, float]


def turned(scene: Scene, angle: float) -> Scene:
    """Return a scene turned about A by an angle (rad).

    Joint B and loads of the joints do not know the angle; the friction of an end force acts along a
    fixed line, which does not turn.
    """
    cos, sin = math.cos(angle), math.sin(angle)

    def vector(x: float, y: float) -> Vector:
        return cos * x - sin * y, sin * x + cos * y

    def effect(own: Any) -> Any:
        match own:
            case JointStop(joint="A"):
                low, high = (x if x is None else x + angle for x in (own.lower, own.upper))
                return replace(own, lower=low, upper=high)
            case PdControl():
                return replace(own, target=(own.target[0] + angle, own.target[1]))
            case JointSpring():
                return replace(own, rest=(own.rest[0] + angle, own.rest[1]))
        return _with_vectors(own, vector)

    start = scene.q[0] + angle, scene.q[1] + angle
    return replace(scene, q=start, effects=tuple(map(effect, scene.effects)))


def mirrored(scene: Scene, index: int = 0) -> Scene:
    """Return a scene in the mirror of the x axis; the motion has the opposite angles."""

    def vector(x: float, y: float) -> Vector:
        return x, -y

    def effect(own: Any) -> Any:
        change = _MIRRORED.get(type(own))
        return _with_vectors(own, vector) if change is None else change(own)

    chain = scene.chain
    across = tuple(vector(*place) for place in chain.centre)
    return replace(
        scene,
        chain=chain if across == chain.centre else replace(chain, centre=across),
        q=_opposite(scene.q),
        u=_opposite(scene.u),
        effects=tuple(map(effect, scene.effects)),
    )


def reordered(scene: Scene, index: int) -> Scene:
    """Return a scene whose effects have another order, one for each index."""
    order = np.random.default_rng(index).permutation(len(scene.effects))
    return replace(scene, effects=tuple(scene.effects[place] for place in order))


def _with_vectors(effect: Any, vector: Callable[[float, float], Vector]) -> Any:
    """Return an effect whose places and directions are changed."""
    match effect:
        case Gravity():
            return replace(effect, direction=vector(*effect.direction))
        case Surface() | CompliantSurface():
            return replace(effect, point=vector(*effect.point), normal=vector(*effect.normal))
    return effect


def _opposite(numbers: Any) -> Any:
    """Return numbers of the opposite sign, None as it is."""
    if isinstance(numbers, tuple):
        return tuple(map(_opposite, numbers))
    return None if numbers is None else -numbers


def _with_opposite(*names: str) -> Callable[[Any], Any]:
    """Return the change of an effect that gives some of its fields the opposite sign."""
    return lambda own: replace(own, **{name: _opposite(getattr(own, name)) for name in names})


def _stop(own: JointStop) -> JointStop:
    return replace(own, lower=_opposite(own.upper), upper=_opposite(own.lower))


def _sampled(own: SampledTorque) -> SampledTorque:
    # The interpolation is computed again.
    return SampledTorque(own.times, _opposite(own.A), _opposite(own.B), own.interpolation)


_MIRRORED: Mapping[type, Callable[[Any], Any]] = {
    EndForce: _with_opposite("normal"),
    JointSpring: _with_opposite("rest"),
    JointStop: _stop,
    JointTorque: _with_opposite("torque", "amplitude"),
    PdControl: _with_opposite("target"),
    SampledTorque: _sampled,
}
