"""Approximate a scene's friction, stops and surfaces by an engine's own laws.

External engines do not have this library's laws of friction and impact. An engine with similar laws
can run a scene with those, and reports the changes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from twolink.chain import Point
from twolink.engines.joint_model import JointModel, Numbers, effect_name, joint_model
from twolink.errors import EngineError
from twolink.scene import Scene

_SPLIT_OFF = ("joint_friction", "joint_stop", "surface")


@dataclass(frozen=True)
class Stop:
    """Bounds (rad, possibly infinite) of joint 0 (A) or 1 (B), and the restitution of both."""

    joint: int
    lower: float
    upper: float
    restitution: float


@dataclass(frozen=True)
class Plane:
    """A half-plane: a point (m), the outward unit normal, and the link points that it limits."""

    point: Numbers
    normal: Numbers
    on: tuple[str, ...]
    restitution: float
    friction: float


@dataclass(frozen=True)
class ApproximateModel:
    """A smooth joint model with joint friction (kinetic, N m), stops and planes."""

    smooth: JointModel
    friction: Numbers = (0.0, 0.0)
    stops: tuple[Stop, ...] = ()
    planes: tuple[Plane, ...] = ()


def smooth_part(scene: Scene) -> Scene:
    """Return a scene without its friction, stops and rigid surfaces."""
    kept = tuple(effect for effect in scene.effects if effect_name(effect) not in _SPLIT_OFF)
    return replace(scene, effects=kept)


def approximate_model(scene: Scene) -> ApproximateModel:
    """Return a scene in parts. Raises `EngineError` for an effect of any other kind."""
    model = ApproximateModel(joint_model(smooth_part(scene)))
    for effect in scene.effects:
        model = _with(model, effect_name(effect), effect)
    return model


def changed(scene: Scene, words: Mapping[str, str]) -> tuple[str, ...]:
    """Return the changes that an engine makes to a scene, by the names of effects."""
    names = dict.fromkeys(effect_name(effect) for effect in scene.effects)
    changes = [f"{name}: {words[name]}" for name in names if name in words]
    for effect in scene.effects:
        static = getattr(effect, "static", None)
        kinetic = getattr(effect, "kinetic", getattr(effect, "friction", None))
        if effect_name(effect) in _SPLIT_OFF and static not in (None, kinetic):
            changes.append(f"{effect_name(effect)}: kinetic friction also acts at rest")
    return tuple(changes)


def in_link(chain: Any, name: str) -> tuple[int, tuple[float, float, float]]:
    """Return the link (0 or 1) of a named point and its position in the URDF link's frame."""
    point: Point = getattr(chain, name)
    return point.link - 1, (float(point.along), 0.0, -float(point.across))


def _with(model: ApproximateModel, name: str, effect: Any) -> ApproximateModel:
    if name == "joint_friction":
        first, second = model.friction
        k1, k2 = effect.kinetic
        return replace(model, friction=(first + k1, second + k2))
    if name == "joint_stop":
        lower = -math.inf if effect.lower is None else effect.lower
        upper = math.inf if effect.upper is None else effect.upper
        joint = "AB".index(effect.joint)
        if any(stop.joint == joint for stop in model.stops):
            raise EngineError(f"joint {effect.joint} must have one stop for an engine; got two")
        stop = Stop(joint, lower, upper, effect.restitution)
        return replace(model, stops=(*model.stops, stop))
    if name == "surface":
        size = math.hypot(*effect.normal)
        normal = effect.normal[0] / size, effect.normal[1] / size
        plane = Plane(effect.point, normal, effect.on, effect.restitution, effect.friction)
        return replace(model, planes=(*model.planes, plane))
    return model
