"""From a tree of links to two rigid bodies: links that fixed joints hold together move as one."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from twolink.errors import UrdfError
from twolink.text import quoted
from twolink.urdf.reading import Inertial, Joint, Tree, listed
from twolink.urdf.spatial import (
    Matrix3,
    Pose,
    Vector3,
    add,
    cross,
    dot,
    norm,
    scale,
    subtract,
    transpose,
    turn,
)


@dataclass(frozen=True)
class RigidBody:
    """A link that a joint moves, with everything fixed to it, in the frame of that link.

    `pose` is where this frame stands, at joint angle zero, in the frame of the body before (for
    the first body, of the root link); `frames` are the links, the moving one first.
    """

    joint: Joint
    pose: Pose
    frames: dict[str, Pose]
    inertials: tuple[Inertial, ...]


@dataclass(frozen=True)
class Lump:
    """Mass (kg), mass centre (m), and inertia (kg m²) about the mass centre and the joint axis."""

    mass: float
    centre: Vector3
    inertia: float


def two_bodies(tree: Tree) -> tuple[RigidBody, RigidBody]:
    """Return the two bodies that the joints of a serial chain move, in order from the base.

    Raises `UrdfError` unless exactly two joints move, both turn freely, and one carries the other.
    """
    moving = _moving_joints(tree)
    poses: list[Pose] = []
    # The number of joints that move a link, and its pose in the frame of the last of these.
    stands: dict[str, tuple[int, Pose]] = {tree.root: (0, Pose())}
    for joint in tree.joints:
        count, parent = stands[joint.parent]
        pose = parent @ joint.pose
        if joint.type == "fixed":
            stands[joint.child] = count, pose
            continue
        if count < len(poses):
            raise UrdfError(
                "moving joints must form one chain, in which one joint carries the other; got two"
                f" branches, moved by {listed(joint.name for joint in moving)}"
            )
        poses.append(pose)
        stands[joint.child] = len(poses), Pose()
    first, second = (
        _body(tree, joint, poses[index], _frames_of(index + 1, stands))
        for index, joint in enumerate(moving)
    )
    return first, second


def lump(body: RigidBody) -> Lump:
    """Return the body's links as one (parallel-axis theorem).

    Raises `UrdfError` for a body without mass, or whose inertia is negative or beyond float64.
    """
    axis = body.joint.axis
    mass, centre = _mass_and_centre(body)
    inertia = 0.0
    for part in body.inertials:
        distance = norm(cross(axis, subtract(part.pose.position, centre)))
        inertia += moment_about(axis, part) + part.mass * distance * distance
    if inertia < 0:
        raise UrdfError(
            f"link {quoted(body.joint.child)}: inertia about its joint's axis must be zero or"
            f" positive; got {inertia!r} kg m²"
        )
    _check_finite(body, mass, *centre, inertia)
    return Lump(mass, centre, inertia)


def lump_in_space(body: RigidBody) -> tuple[float, Vector3, Matrix3]:
    """Return mass (kg), mass centre (m) and inertia about it (kg m²), in the body's frame.

    Raises `UrdfError` for a body without mass, or whose inertia is beyond float64.
    """
    mass, centre = _mass_and_centre(body)
    rows = [[0.0] * 3 for _ in range(3)]
    for part in body.inertials:
        turned = _turned(part.inertia, part.pose.rotation)
        off = subtract(part.pose.position, centre)
        for i in range(3):
            for j in range(3):
                steiner = (dot(off, off) if i == j else 0.0) - off[i] * off[j]
                rows[i][j] += turned[i][j] + part.mass * steiner
    x, y, z = ((row[0], row[1], row[2]) for row in rows)
    _check_finite(body, mass, *centre, *x, *y, *z)
    return mass, centre, (x, y, z)


def _mass_and_centre(body: RigidBody) -> tuple[float, Vector3]:
    """Return a body's mass (kg) and mass centre (m), or raise `UrdfError` without mass."""
    mass = sum(part.mass for part in body.inertials)
    if mass == 0:
        raise UrdfError(
            f"link {quoted(body.joint.child)} moves: its mass, with links fixed to it, must be"
            " positive; got zero"
        )
    centre: Vector3 = (0.0, 0.0, 0.0)
    for part in body.inertials:
        # The share of a single link is exactly 1, so lumping it changes no bit.
        centre = add(centre, scale(part.mass / mass, part.pose.position))
    return mass, centre


def _check_finite(body: RigidBody, *numbers: float) -> None:
    """Raise `UrdfError` for a number of a body that has left float64."""
    if not all(map(math.isfinite, numbers)):
        raise UrdfError(
            f"link {quoted(body.joint.child)}: mass and inertia must be float64 numbers; got a"
            " larger one"
        )


def _turned(inertia: Matrix3, rotation: Matrix3) -> Matrix3:
    """Return R I Rᵀ."""
    # A row of I Rᵀ is a row of I, turned; so is a column of R (I Rᵀ).
    x, y, z = (turn(rotation, row) for row in inertia)
    a, b, c = (turn(rotation, column) for column in transpose((x, y, z)))
    return transpose((a, b, c))


def _moving_joints(tree: Tree) -> list[Joint]:
    """Return the two joints that move, after a check that they are hinges."""
    moving = [joint for joint in tree.joints if joint.type != "fixed"]
    for joint in moving:
        if joint.type not in ("revolute", "continuous"):
            raise UrdfError(
                f"joint {quoted(joint.name)} must be revolute, continuous or fixed; got"
                f" {joint.type}"
            )
        if joint.mimics:
            raise UrdfError(
                f"joint {quoted(joint.name)} must move on its own; got a joint that mimics another"
            )
    if len(moving) != 2:
        which = f", {listed(joint.name for joint in moving)}" if moving else ""
        raise UrdfError(f"exactly two joints must move; got {len(moving)}{which}")
    return moving


def _frames_of(count: int, stands: dict[str, tuple[int, Pose]]) -> dict[str, Pose]:
    return {name: pose for name, (moved_by, pose) in stands.items() if moved_by == count}


def _body(tree: Tree, joint: Joint, pose: Pose, frames: dict[str, Pose]) -> RigidBody:
    inertials = tuple(
        replace(inertial, pose=frame @ inertial.pose)
        for name, frame in frames.items()
        if (inertial := tree.links[name].inertial) is not None
    )
    return RigidBody(joint, pose, frames, inertials)


def moment_about(axis: Vector3, part: Inertial) -> float:
    """Return the inertia about an axis through the mass centre (kg m²)."""
    direction = turn(transpose(part.pose.rotation), axis)
    return dot(direction, turn(part.inertia, direction))
