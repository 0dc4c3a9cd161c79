"""Approximate friction, stops and rigid surfaces with MuJoCo's soft constraints.

A constraint is a spring and a damper in acceleration, −k x − b dx/dt, without tension. A contact
lasts ten steps or a few times that, the shortest that steps can resolve, and the damping sets the
restitution (T. Schwager and T. Pöschel, Granular Matter 9, 2007, on the end of such a contact).
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from twolink.engines.approximation import ApproximateModel, in_link
from twolink.errors import EngineError

CHANGES = {
    "joint_friction": "MuJoCo's frictionloss, which creeps instead of sticking",
    "joint_stop": "MuJoCo's joint limits, springs with dampers for the restitution",
    "surface": "MuJoCo's contacts, springs with dampers for the restitution, and soft friction",
}

# The radius (m) of the balls that represent contact points: friction acts so far from the points.
_BALL = 1e-6
_STEPS_OF_TOUCH = 10
# At least a fortieth of the speed rebounds: more damping would need longer contacts.
_MOST_DAMPED = 3.0
# Dry friction is a damper up to its limit: its shortest time constant, in steps. MuJoCo's default
# of 0.02 s would leave friction smooth at any step.
_STEPS_OF_SLIP = 2
# An impedance near 1: a constraint yields little under load.
_IMPEDANCE = (0.9999, 0.9999, 0.001, 0.5, 2.0)


def built(mujoco: Any, model: ApproximateModel) -> Any:
    """Return MuJoCo's model with balls on the links, planes, joint limits and friction."""
    try:
        spec = mujoco.MjSpec.from_string(model.smooth.chain.to_urdf())
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = 0
        for index, plane in enumerate(model.planes):
            _add_plane(mujoco, spec, model, index)
            for name in plane.on:
                _add_ball(mujoco, spec, model, name, index)
        robot = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise EngineError(f"MuJoCo rejects the scene: {error}") from error
    robot.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    for stop in model.stops:
        robot.jnt_limited[stop.joint] = True
        ends = (max(stop.lower, -1e9), min(stop.upper, 1e9))
        robot.jnt_range[stop.joint] = ends
        robot.jnt_solimp[stop.joint] = _IMPEDANCE
    robot.dof_frictionloss[:] = model.friction
    robot.dof_solimp[:] = _IMPEDANCE
    return robot


def tune(robot: Any, model: ApproximateModel, step: float) -> None:
    """Set constraints to the largest stiffness that a step (s) can resolve."""
    robot.dof_solref[:] = _STEPS_OF_SLIP * step, 1.0
    for stop in model.stops:
        robot.jnt_solref[stop.joint] = _reference(stop.restitution, step)
    for index, plane in enumerate(model.planes):
        robot.geom(_plane_name(index)).solref[:] = _reference(plane.restitution, step)


def _reference(restitution: float, step: float) -> tuple[float, float]:
    """Return −k (1/s²) and −b (1/s), in MuJoCo's convention."""
    ratio = _damping_ratio(restitution)
    # For stability a damper must not remove more than half of the speed in a step.
    frequency = min(math.pi / _STEPS_OF_TOUCH, 0.5 / (2 * ratio + 1e-300)) / step
    return -(frequency**2), -2 * ratio * frequency


@functools.lru_cache(maxsize=64)
def _damping_ratio(restitution: float) -> float:
    """Return the damping ratio for a given restitution, by bisection."""
    low, high = 0.0, _MOST_DAMPED
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if _rebound(middle) > restitution else (low, middle)
    return (low + high) / 2


def _rebound(ratio: float) -> float:
    """Return the restitution of a spring and damper in contact until their force is zero."""
    root = math.sqrt(abs(1 - ratio * ratio))
    if ratio < 1:
        return math.exp(-ratio / root * math.atan2(2 * ratio * root, 2 * ratio * ratio - 1))
    return math.exp(-ratio / root * math.log((ratio + root) / (ratio - root))) if root else 0.0


def _plane_name(index: int) -> str:
    return f"surface {index}"


def _add_plane(mujoco: Any, spec: Any, model: ApproximateModel, index: int) -> None:
    """Add a plane, offset by a ball's radius, so that it limits the balls' centres."""
    plane = model.planes[index]
    (x, y), (nx, ny) = plane.point, plane.normal
    up = np.array([nx, 0.0, -ny])
    quaternion = np.zeros(4)
    mujoco.mju_quatZ2Vec(quaternion, up)
    spec.worldbody.add_geom(
        name=_plane_name(index),
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.0, 0.0, 1.0],
        pos=np.array([x, 0.0, -y]) - _BALL * up,
        quat=quaternion,
        friction=[plane.friction, 0.0, 0.0],
        condim=3 if plane.friction else 1,
        solimp=_IMPEDANCE,
        priority=1,
        contype=1 << index,
        conaffinity=0,
    )


def _add_ball(mujoco: Any, spec: Any, model: ApproximateModel, name: str, index: int) -> None:
    """Add a massless ball to a link, which collides with one plane only."""
    link, place = in_link(model.smooth.chain, name)
    spec.body(f"link{link + 1}").add_geom(
        name=f"{name} on {_plane_name(index)}",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[_BALL, 0.0, 0.0],
        pos=place,
        mass=0.0,
        condim=1,
        contype=0,
        conaffinity=1 << index,
    )
