"""A URDF's tree as a planar two-link chain, standing somewhere in the world.

The two moving joints define everything: their common axis is z, gravity's direction in the plane
across it is y, and x = y × z. Whatever hangs rigidly on a moving link is lumped into it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from os import PathLike

import numpy as np

from twolink.coordinates import JointConvention
from twolink.errors import UrdfError
from twolink.urdf.reading import Joint, Tree, parse_tree, read_text
from twolink.urdf.spatial import IDENTITY, Array, Pose, Vector3, across, as_tuple, norm

# Angles between directions (rad). A right angle written as 1.5708 is off by 3.7e-6, and that is
# how many files have it: up to `_TYPED` a tilt is taken for one, and told; rounding is below
# `_ROUNDED` and not worth a word.
_TYPED = 1e-5
_ROUNDED = 1e-9

DOWN: Vector3 = (0.0, 0.0, -9.81)


@dataclass(frozen=True)
class LinkParameters:
    """One link: mass (kg), length (m), centre along and across (m), central inertia (kg m²)."""

    mass: float
    length: float
    centre: tuple[float, float]
    inertia: float


@dataclass(frozen=True)
class PlanarUrdf:
    """A planar two-link chain as a URDF draws it, and how its joint angles are counted.

    `path` and `xml` are the file and its text. `joints` maps the URDF's angles of `joint_names` to
    the absolute angles of the source. `origin` is A and `axes` are x, y, z of the source's frame,
    in the world (m). `gravity` (m/s²) acts along y. `tip` is the link taken as D, if there is one,
    and `tip_position` is D in the frame of the second moving link (m). `assumptions` has a
    sentence for everything that the file does not say.
    """

    path: str
    xml: str
    links: tuple[LinkParameters, LinkParameters]
    joint_names: tuple[str, str]
    link_names: tuple[str, str]
    joints: JointConvention
    origin: Vector3
    axes: tuple[Vector3, Vector3, Vector3]
    gravity: float
    tip: str | None
    tip_position: Vector3
    assumptions: tuple[str, ...]


def read_planar_urdf(
    path: str | PathLike[str],
    *,
    tip: str | None = None,
    gravity: Vector3 = DOWN,
    oblique_gravity: bool = False,
) -> PlanarUrdf:
    """Return the planar two-link chain in a URDF file.

    `tip` names the link to take as D; `gravity` (m/s²) is a vector in the world; with
    `oblique_gravity` the plane of motion need not be vertical, and gravity's part in it acts.
    Raises `UrdfError`, naming the joint or link and why, for anything else.
    """
    return parse_planar_urdf(
        read_text(path),
        source=str(path),
        tip=tip,
        gravity=gravity,
        oblique_gravity=oblique_gravity,
    )


def parse_planar_urdf(
    text: str,
    *,
    source: str = "<string>",
    tip: str | None = None,
    gravity: Vector3 = DOWN,
    oblique_gravity: bool = False,
) -> PlanarUrdf:
    """Return the planar two-link chain in a URDF text; see `read_planar_urdf`."""
    tree = parse_tree(text, source)
    joints = _moving_joints(tree)
    bodies = _bodies(tree, joints)
    assumptions: list[str] = []
    axis1, axis2, turn2 = _axes_in_link_1(source, joints, bodies, assumptions)
    first = bodies[1].pose
    frame = _frame(source, first.rotation @ axis1, gravity, oblique_gravity, assumptions)

    elbow = across(bodies[2].pose.translation, axis1)
    length1 = norm(elbow)
    if length1 == 0:
        raise UrdfError(
            f"{source}: joints '{joints[0].name}' and '{joints[1].name}' turn about one line; "
            "allowed is a first link with a length"
        )
    along1 = elbow / length1
    if frame is None:
        # No gravity in the plane: x is where link 1 points at rest.
        frame = _frame_along(first.rotation @ axis1, first.rotation @ along1)
    x, y, z = frame
    sign1 = 1 if (first.rotation @ axis1) @ z > 0 else -1
    sign2 = sign1 * turn2
    z_in_link1, z_in_link2 = sign1 * axis1, sign2 * axis2

    end, tip_position = _tip(tree, bodies[2], axis2, tip, assumptions)
    reach = across(tip_position, axis2)
    length2 = norm(reach)
    along2 = reach / length2 if length2 > 0 else _any_across(axis2)

    pointing1 = first.rotation @ along1
    pointing2 = bodies[2].pose.rotation @ along2
    across1 = np.cross(z_in_link1, along1)
    offset = (
        math.atan2(pointing1 @ y, pointing1 @ x),
        math.atan2(pointing2 @ across1, pointing2 @ along1),
    )
    gravity_vector = np.array(gravity, dtype=float)
    return PlanarUrdf(
        path=source,
        xml=text,
        links=(
            _link_parameters(source, bodies[1], z_in_link1, length1, along1),
            _link_parameters(source, bodies[2], z_in_link2, length2, along2),
        ),
        joint_names=(joints[0].name, joints[1].name),
        link_names=(joints[0].child, joints[1].child),
        joints=JointConvention((sign1, sign2), (offset[0] + 0.0, offset[1] + 0.0)),
        origin=as_tuple(first.translation),
        axes=(as_tuple(x), as_tuple(y), as_tuple(z)),
        gravity=norm(across(gravity_vector, z)) if _acts(gravity_vector, z) else 0.0,
        tip=end,
        tip_position=as_tuple(tip_position),
        assumptions=tuple(assumptions),
    )


@dataclass(frozen=True)
class _Body:
    """What moves as one: a moving link (or the ground) and everything fixed to it.

    `pose` is where its moving joint stands in the body before it, with the joint at zero; `frames`
    are the poses of its links in the frame of `name`.
    """

    name: str
    pose: Pose
    frames: dict[str, Pose]
    tree: Tree


def _moving_joints(tree: Tree) -> tuple[Joint, Joint]:
    """Return the two moving joints, in order from the base."""
    moving = [joint for joint in tree.joints if joint.moves]
    if len(moving) != 2:
        names = ", ".join(f"'{joint.name}'" for joint in moving[:6]) or "none"
        raise UrdfError(
            f"{tree.source}: it has {len(moving)} moving joints ({names}); allowed are two"
        )
    first, second = moving
    return first, second


def _bodies(tree: Tree, joints: tuple[Joint, Joint]) -> tuple[_Body, _Body, _Body]:
    """Return the ground and the two moving bodies."""
    bodies = [_Body(tree.root, IDENTITY, {tree.root: IDENTITY}, tree)]
    body_of = {tree.root: 0}
    for joint in tree.joints:
        parent = body_of[joint.parent]
        pose = bodies[parent].frames[joint.parent] @ joint.pose
        if joint.moves:
            if parent != len(bodies) - 1:
                raise UrdfError(
                    f"{tree.source}: joints '{joints[0].name}' and '{joints[1].name}' move two "
                    f"branches of '{bodies[parent].name}'; allowed is one chain"
                )
            bodies.append(_Body(joint.child, pose, {joint.child: IDENTITY}, tree))
            body_of[joint.child] = len(bodies) - 1
        else:
            bodies[parent].frames[joint.child] = pose
            body_of[joint.child] = parent
    ground, first, second = bodies
    return ground, first, second


def _axes_in_link_1(
    source: str,
    joints: tuple[Joint, Joint],
    bodies: tuple[_Body, _Body, _Body],
    assumptions: list[str],
) -> tuple[Array, Array, int]:
    """Return each axis in its own link, and whether the second turns like the first (±1)."""
    axis1, axis2 = joints[0].axis, joints[1].axis
    second = bodies[2].pose.rotation @ axis2
    tilt = math.atan2(norm(np.cross(axis1, second)), abs(float(axis1 @ second)))
    if tilt > _TYPED:
        raise UrdfError(
            f"{source}: the axes of joints '{joints[0].name}' and '{joints[1].name}' are "
            f"{math.degrees(tilt):.6g} degrees apart; allowed are parallel axes"
        )
    if tilt > _ROUNDED:
        assumptions.append(
            f"the axes of joints '{joints[0].name}' and '{joints[1].name}' are parallel, though "
            f"the file has them {tilt:.1e} rad apart."
        )
    return axis1, axis2, 1 if axis1 @ second > 0 else -1


def _acts(gravity: Array, axis: Array) -> bool:
    """Return whether gravity has a part across an axis, beyond rounding."""
    return norm(across(gravity, axis)) > _TYPED * norm(gravity)


def _frame(
    source: str, axis: Array, gravity: Vector3, oblique: bool, assumptions: list[str]
) -> tuple[Array, Array, Array] | None:
    """Return x, y, z of the source's frame in the world; None where no gravity tells y."""
    vector = np.array(gravity, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise UrdfError(f"{source}: gravity is {gravity!r}; allowed are 3 finite numbers (m/s²)")
    size = norm(vector)
    if size == 0:
        return None
    tilt = math.asin(min(1.0, abs(float(vector @ axis)) / size))
    if tilt > _TYPED and not oblique:
        how = (
            "normal" if tilt > math.pi / 2 - _TYPED else f"{math.degrees(tilt):.6g} degrees oblique"
        )
        raise UrdfError(
            f"{source}: gravity is {how} to the plane of motion; allowed is gravity in the plane, "
            "unless oblique gravity is asked for"
        )
    if tilt > _ROUNDED:
        assumptions.append(
            f"only gravity's part in the plane acts, which is {norm(across(vector, axis)):.9g} of "
            f"{size:.9g} m/s²."
        )
    if not _acts(vector, axis):
        return None
    y = across(vector, axis)
    y = y / norm(y)
    x = np.cross(y, axis)
    # The picture is seen from where x points the way the world's axes do.
    return _facing(x, y, axis)


def _facing(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """Return a frame with y as given, and x not against the world's axis that it is nearest to."""
    against = x[int(np.argmax(np.abs(x)))] < 0
    return (-x, y, -z) if against else (x, y, z)


def _frame_along(axis: Array, x: Array) -> tuple[Array, Array, Array]:
    """Return the frame with z along an axis and the given x across it."""
    return x, np.cross(axis, x), axis


def _any_across(axis: Array) -> Array:
    """Return the link's own x-axis across its joint, or its y-axis where x is the joint's."""
    for candidate in np.eye(3)[:2]:
        part = across(candidate, axis)
        if norm(part) > 0.5:
            break
    return np.asarray(part / norm(part))


def _tip(
    tree: Tree, body: _Body, axis: Array, wanted: str | None, assumptions: list[str]
) -> tuple[str | None, Array]:
    """Return the link taken as D, if there is one, and D in the frame of link 2."""
    others = {name: pose.translation for name, pose in body.frames.items() if name != body.name}
    if wanted is not None:
        if wanted not in others:
            allowed = ", ".join(f"'{name}'" for name in list(others)[:8]) or "none"
            raise UrdfError(
                f"{tree.source}: '{wanted}' is no link fixed to '{body.name}'; allowed as the tip "
                f"are: {allowed}"
            )
        return wanted, others[wanted]
    if "D" in others:
        return "D", others["D"]
    farthest = max(others, key=lambda name: norm(across(others[name], axis)), default=None)
    if farthest is not None and norm(across(others[farthest], axis)) > 0:
        assumptions.append(
            f"the end point D is the origin of link '{farthest}', the farthest that is fixed to "
            f"'{body.name}'."
        )
        return farthest, others[farthest]
    centre = across(_lumped(body)[1], axis)
    if norm(centre) > 0:
        assumptions.append(
            f"the end point D lies twice as far from joint B as the mass centre of '{body.name}', "
            "as in a uniform bar, since no link is fixed there."
        )
    else:
        assumptions.append(
            f"the end point D is at joint B: nothing tells the end of '{body.name}'."
        )
    return None, 2 * centre


def _lumped(body: _Body) -> tuple[float, Array]:
    """Return the mass of a body (kg), and its mass centre in its frame (m)."""
    placed = [
        (inertial.mass, pose.at(inertial.pose.translation))
        for name, pose in body.frames.items()
        if (inertial := body.tree.links[name].inertial) is not None
    ]
    if not placed:
        raise UrdfError(
            f"{body.tree.source}: link '{body.name}' moves and has no mass, nor has anything fixed "
            "to it; allowed is a positive mass"
        )
    if len(placed) == 1:
        return placed[0]
    mass = math.fsum(m for m, _ in placed)
    centre = sum((m / mass * c for m, c in placed), np.zeros(3))
    return mass, np.asarray(centre)


def _link_parameters(
    source: str, body: _Body, z: Array, length: float, along: Array
) -> LinkParameters:
    """Return a body's parameters in its plane; inertias add by the parallel-axis theorem."""
    mass, centre = _lumped(body)
    inertia = 0.0
    for name, pose in body.frames.items():
        inertial = body.tree.links[name].inertial
        if inertial is not None:
            placed = pose @ inertial.pose
            axis = placed.rotation.T @ z
            distance = norm(across(placed.translation - centre, z))
            inertia += float(axis @ inertial.inertia @ axis) + inertial.mass * distance**2
    offset = norm(across(centre, z))
    if not inertia >= 0:
        raise UrdfError(
            f"{source}: link '{body.name}' has inertia {inertia!r} kg m² about its joint's "
            "direction; allowed is zero or a positive number"
        )
    if inertia + mass * offset**2 == 0:
        raise UrdfError(
            f"{source}: link '{body.name}' has all its mass on its joint's axis, and no inertia; "
            "allowed is a link that resists turning"
        )
    sideways = np.cross(z, along)
    coordinates = (float(centre @ along) + 0.0, float(centre @ sideways) + 0.0)
    return LinkParameters(mass, length, coordinates, inertia)
