"""Scenes that state a motion in other words: longer ones, later starts, obstacles out of reach,
surfaces given by other numbers, and contacts that are there twice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from numpy.random import Generator

from twolink.contact.impact_laws import LAWS
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.end_force import EndForce
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.scene import Scene

Restatement = Callable[[Any, Generator], tuple[Scene, float] | None]
"""Takes a trajectory and random numbers; returns another scene, and the time of the trajectory (s)
at which it starts, or None where there is no such scene."""

# Distance of an obstacle out of reach, in lengths of the stretched chain.
_FAR = 3.0


def longer(trajectory: Any, rng: Generator) -> tuple[Scene, float]:
    """Return a scene of a longer or a shorter motion."""
    scene = trajectory.scene
    return replace(scene, duration=scene.duration * float(rng.choice((0.3, 0.77, 1.3)))), 0.0


def restarted(trajectory: Any, rng: Generator) -> tuple[Scene, float] | None:
    """Return a scene that starts from the state at some time, sometimes just after an impact.

    There is none for torques that are sampled, and for surfaces that have a dent to keep.
    """
    scene = trajectory.scene
    for effect in scene.effects:
        is_soft = isinstance(effect, CompliantSurface) and effect.law != "hertz"
        if is_soft or isinstance(effect, SampledTorque):
            return None
    start = float(rng.uniform(0.05, 0.8)) * scene.duration
    if len(trajectory.impacts) and rng.random() < 0.3:
        struck = trajectory.impacts[int(rng.integers(len(trajectory.impacts)))].time
        start = float(struck + rng.choice((1e-12, 1e-9, 1e-6, 1e-3)))
    if not 0 < start < 0.95 * scene.duration:
        return None
    q, u = (tuple(map(float, values[:, 0])) for values in trajectory.at([start]))
    effects = tuple(_later(effect, start) for effect in scene.effects)
    return replace(scene, q=q, u=u, duration=scene.duration - start, effects=effects), start


def _later(effect: Any, start: float) -> Any:
    if not isinstance(effect, JointTorque):
        return effect
    pairs = zip(effect.phase, effect.frequency, strict=True)
    return replace(effect, phase=tuple(phase + rate * start for phase, rate in pairs))


def with_far_obstacles(trajectory: Any, rng: Generator) -> tuple[Scene, float]:
    """Return a scene with a rough surface, and stops, that nothing reaches."""
    scene, effects = trajectory.scene, list(trajectory.scene.effects)
    away = _FAR * (scene.chain.L1 + scene.chain.L2)
    more: list[Any] = [
        Surface((0.0, away), (0.0, -1.0), ("B", "C1", "C2", "D"), 0.5, friction=0.4, name="far")
    ]
    if not any(isinstance(effect, JointStop) for effect in effects):
        more.append(JointStop("B", lower=-1000.0, upper=1000.0, restitution=0.3))
    for effect in more:
        effects.insert(int(rng.integers(len(effects) + 1)), effect)
    return replace(scene, effects=tuple(effects)), 0.0


def restated(trajectory: Any, rng: Generator) -> tuple[Scene, float] | None:
    """Return a scene of the same effects, written in another way."""
    scene = trajectory.scene
    with_spring = not any(isinstance(e, JointSpring | JointDamping) for e in scene.effects)
    effects = [
        each for effect in scene.effects for each in _restated(effect, rng, with_spring=with_spring)
    ]
    found = replace(scene, effects=tuple(effects))
    return None if found == scene else (found, 0.0)


def _restated(effect: Any, rng: Generator, *, with_spring: bool) -> list[Any]:
    match effect:
        case Surface() | CompliantSurface():
            return _by_points(effect, rng)
        case JointFriction(static=None):
            return [replace(effect, static=effect.kinetic)]
        case EndForce(static=None, sliding=None):
            return [replace(effect, static=effect.friction)]
        case PdControl() if with_spring:
            spring = JointSpring(stiffness=effect.proportional, rest=effect.target)
            return [spring, JointDamping(coefficient=effect.derivative)]
    return [effect]


def _by_points(surface: Any, rng: Generator) -> list[Any]:
    """Return a surface for each point, with a longer normal, and another law where none counts."""
    x, y = surface.normal
    changes: dict[str, Any] = {"normal": (4 * x, 4 * y)}
    if surface.static is None:
        changes["static"] = surface.friction
    if isinstance(surface, Surface) and not (surface.friction or surface.static):
        # The laws of restitution are one law without friction.
        changes["law"] = str(rng.choice(list(LAWS)))
    return [
        replace(surface, on=(point,), name=f"{surface.name} {point}", **changes)
        for point in surface.on
    ]


def doubled(trajectory: Any, rng: Generator) -> tuple[Scene, float] | None:
    """Return a scene in which each rigid surface is there twice."""
    effects: list[Any] = []
    for effect in trajectory.scene.effects:
        effects.append(effect)
        if isinstance(effect, Surface):
            effects.append(replace(effect, name=f"{effect.name} again"))
    found = replace(trajectory.scene, effects=tuple(effects))
    return None if found == trajectory.scene else (found, 0.0)


RESTATEMENTS: dict[str, Restatement] = {
    "longer": longer,
    "restarted": restarted,
    "far obstacles": with_far_obstacles,
    "restated": restated,
    "doubled": doubled,
}
