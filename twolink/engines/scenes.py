"""Scenes as parameters of the protocol, and parameters as scenes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, cast

from twolink.chain import Chain
from twolink.coordinates import JointConvention
from twolink.effects import (
    Gravity,
    JointDamping,
    JointFriction,
    JointSpring,
    JointStop,
    Surface,
)
from twolink.engines.messages import Effect, HalfPlane, Parameters, StoppedJoint
from twolink.errors import EngineError
from twolink.scene import Scene

_JOINTS = JointConvention()
_NOTHING = (0.0, 0.0)
_LAW = "stronge"
_NAMES: tuple[Literal["A"], Literal["B"]] = ("A", "B")


def chain_of(given: Parameters) -> Chain:
    """Return the chain of parameters. Raises `ParameterError`."""
    return Chain(given.mass, given.length, given.centre, given.inertia)


def scene_of(given: Parameters, angles: Any, speeds: Any, duration: float) -> Scene:
    """Return a motion of parameters as a scene.

    Angles (rad) and speeds (rad/s) are those of the joints. Raises `ParameterError`.
    """
    return Scene(
        chain=chain_of(given),
        q=_JOINTS.absolute_angles(angles),
        u=_JOINTS.absolute_speeds(speeds),
        duration=duration,
        effects=tuple(_effects(given)),
    )


def _effects(given: Parameters) -> Iterator[Any]:
    yield Gravity(given.gravity)
    if any(given.damping):
        yield JointDamping(given.damping)
    if any(given.friction):
        yield JointFriction(given.friction, given.static_friction)
    if given.stiffness is not None:
        yield JointSpring(given.stiffness, given.rest or _NOTHING)
    for stop in given.stops or ():
        yield JointStop(_NAMES[stop.joint - 1], stop.lower, stop.upper, stop.restitution)
    for index, plane in enumerate(given.surfaces or ()):
        yield Surface(
            plane.point,
            plane.normal,
            on=plane.on,
            restitution=plane.restitution,
            friction=plane.friction,
            static=plane.static,
            name=f"surface {index + 1}",
        )


def parameters_of(scene: Scene) -> tuple[Parameters, tuple[Effect, ...]]:
    """Return the parameters of a scene, and the effects that an engine must have.

    Raises `EngineError` for effects that the protocol does not have: others, several in the place
    of one, gravity across y, and surfaces with another law of restitution or on mass centres.
    """
    fields: dict[str, Any] = {"gravity": 0.0}
    effects: dict[Effect, None] = {}
    _check_single(scene)
    for effect in scene.effects:
        if isinstance(effect, Gravity):
            fields["gravity"] = _down(effect)
            continue
        name, found = _fields(effect)
        effects[name] = None
        for key, value in found.items():
            fields[key] = (*fields.get(key, ()), *value)
    chain = scene.chain
    given = Parameters(
        mass=chain.mass,
        length=chain.length,
        centre=chain.centre,
        inertia=chain.inertia,
        **fields,
    )
    return given, tuple(effects)


def _check_single(scene: Scene) -> None:
    """Raise `EngineError` for several effects of a kind of which the protocol has one."""
    for kind in (Gravity, JointDamping, JointFriction, JointSpring):
        count = sum(isinstance(effect, kind) for effect in scene.effects)
        if count > 1:
            raise EngineError(f"the protocol has one {kind.__name__}; got {count}")


def _down(gravity: Gravity) -> Any:
    """Return g along y (m/s²). Raises `EngineError` for gravity in another direction."""
    x, y = gravity.direction
    if x:
        raise EngineError(f"the protocol has gravity along y alone; got the direction {x:g}, {y:g}")
    return gravity.acceleration[1]


def joint_state(scene: Scene) -> tuple[Any, Any]:
    """Return the joint angles (rad) and speeds (rad/s) at the start of a scene, as floats."""
    angles, speeds = _JOINTS.joint_angles(scene.q), _JOINTS.joint_speeds(scene.u)
    return (float(angles[0]), float(angles[1])), (float(speeds[0]), float(speeds[1]))


def _fields(effect: Any) -> tuple[Effect, dict[str, Any]]:
    """Return an effect's name in the protocol, and its parameters."""
    if isinstance(effect, JointDamping):
        return "joint_damping", {"damping": effect.coefficient}
    if isinstance(effect, JointFriction):
        static = {} if effect.static is None else {"static_friction": effect.static}
        return "joint_friction", {"friction": effect.kinetic, **static}
    if isinstance(effect, JointSpring):
        return "joint_spring", {"stiffness": effect.stiffness, "rest": effect.rest}
    if isinstance(effect, JointStop):
        stop = StoppedJoint(
            joint=cast("Literal[1, 2]", _NAMES.index(effect.joint) + 1),
            lower=effect.lower,
            upper=effect.upper,
            restitution=effect.restitution,
        )
        return "joint_stop", {"stops": (stop,)}
    if isinstance(effect, Surface):
        _check_surface(effect)
        plane = HalfPlane(
            point=effect.point,
            normal=effect.normal,
            on=cast("tuple[Literal['B', 'D'], ...]", effect.on),
            restitution=effect.restitution,
            friction=effect.friction,
            static=effect.static,
        )
        return "surface", {"surfaces": (plane,)}
    raise EngineError(f"the protocol has no {type(effect).__name__}")


def _check_surface(surface: Surface) -> None:
    """Raise `EngineError` for what the messages of a surface do not say."""
    others = [point for point in surface.on if point not in ("B", "D")]
    if others:
        raise EngineError(f"the protocol has surfaces on B and D alone; got {', '.join(others)}")
    # Without friction all laws agree.
    if surface.friction and surface.law != _LAW:
        raise EngineError(
            f"the protocol has rough surfaces with the law {_LAW} alone; got {surface.law}"
        )
