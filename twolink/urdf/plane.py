"""The plane of motion of two bodies: its frame, and both links and their joints in it.

The derivation has one frame: A the origin, y along gravity, z the axis of rotation, x = y × z. That
frame is found first, and then the frame of each link: `along` towards its end, `across` a quarter
turn on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from twolink.coordinates import JointConvention
from twolink.errors import UrdfError
from twolink.text import quoted
from twolink.urdf.link_parameters import LinkParameters, link_without_inertia
from twolink.urdf.lumping import Lump, RigidBody, lump
from twolink.urdf.reading import listed
from twolink.urdf.spatial import (
    ZERO,
    Matrix3,
    Vector3,
    cross,
    dot,
    norm,
    reject,
    subtract,
    turn,
    unit,
)
from twolink.urdf.tip import (
    ROUNDING,
    Point2,
    Projection,
    Tip,
    direction,
    direction_of_link2,
    distance,
    find_tip,
)

ROUNDED_TURN = 1e-14
"""Angles (rad) up to this are zero where they count by themselves: float64 leaves as much after a
hundred rotations. A right angle typed with 13 digits is off by 1e-13, which acts."""

NEGLECTED = 1e-5
"""The largest tilt (rad) of one axis from the other that is neglected, with a note. A right angle
typed as 1.5708 is off by 3.7e-6 and 3.1416 by 7.3e-6, in files whose authors meant a plane; 1.571
is off by 2e-4. Gravity in the plane is not neglected, however small."""

Axes = tuple[Vector3, Vector3, Vector3]


@dataclass(frozen=True)
class Frame:
    """The source's frame in the world, gravity in its plane (m/s²), and a note on the rest."""

    axes: Axes
    gravity: float
    note: str = ""


@dataclass(frozen=True)
class Plane:
    """The chain in its plane: links, joint convention, frame, the end D, and notes."""

    links: tuple[LinkParameters, LinkParameters]
    joints: JointConvention
    frame: Frame
    end: Tip
    notes: tuple[str, ...]


def in_the_plane(first: RigidBody, second: RigidBody, tip: str | None, gravity: Vector3) -> Plane:
    """Return two bodies in the plane in which they move, or raise `UrdfError`."""
    lumps = lump(first), lump(second)
    _check_reach(first, lumps[0], second.pose.position)
    _check_reach(second, lumps[1], first.pose.position)
    # Poses in the world, both joints at zero. Turning a joint tilts nothing.
    turned1 = first.pose.rotation
    turned2 = (first.pose @ second.pose).rotation
    axis1, axis2 = turn(turned1, first.joint.axis), turn(turned2, second.joint.axis)
    tilted = _check_parallel(first, second, (axis1, axis2), norm(gravity))
    elbow = _check_elbow(first, second, turn(turned1, second.pose.position), axis1)
    frame = _source_frame(axis1, elbow, gravity)
    project1, project2 = _projection(frame.axes, turned1), _projection(frame.axes, turned2)
    direction1 = direction(project1(second.pose.position))
    end = find_tip(second, tip, lumps[1].centre, project2)
    direction2, undirected = direction_of_link2(second, end.position, project2)
    links = (
        _parameters(lumps[0], second.pose.position, direction1, project1),
        _parameters(lumps[1], end.position, direction2, project2),
    )
    _check_that_it_resists(first, second, links)
    z = frame.axes[2]
    sign = _sign(dot(z, axis1)), _sign(dot(z, axis2))
    offset = _angle((1.0, 0.0), direction1), _angle(direction1, direction2)
    notes = (*tilted, *filter(None, [frame.note]), *end.notes, *undirected)
    return Plane(links, JointConvention(sign, offset), frame, end, notes)


def _check_reach(body: RigidBody, lumped: Lump, joint: Vector3) -> None:
    """Refuse places whose distance overflows, although each coordinate in the file is finite."""
    places = (lumped.centre, joint, *(pose.position for pose in body.frames.values()))
    # Twice, because D may be placed at twice the distance of the mass centre.
    if not all(math.isfinite(2 * norm(place)) for place in places):
        link = quoted(body.joint.child)
        raise UrdfError(f"link {link}: distances must be float64 numbers; got a larger one")


def _check_parallel(
    first: RigidBody, second: RigidBody, axes: tuple[Vector3, Vector3], gravity: float
) -> tuple[str, ...]:
    """Refuse axes that are not parallel; return a sentence if their tilt is neglected.

    `gravity` is its size (m/s²), a share of which the tilt turns about the second axis.
    """
    axis1, axis2 = axes
    tilt = math.atan2(norm(cross(axis1, axis2)), abs(dot(axis1, axis2)))
    names = listed((first.joint.name, second.joint.name))
    if tilt > NEGLECTED:
        raise UrdfError(
            f"the axes of joints {names} must be parallel, to {NEGLECTED:g} rad; got an angle of"
            f" {tilt:.3g} rad between them"
        )
    if tilt > ROUNDED_TURN:
        share = f", with up to {tilt * gravity:.2g} m/s² of gravity" if gravity else ""
        return (
            f"The axes of joints {names} make an angle of {tilt:.2g} rad, which the planar chain"
            f" neglects{share}.",
        )
    return ()


def _check_elbow(first: RigidBody, second: RigidBody, elbow: Vector3, axis: Vector3) -> Vector3:
    """Return the elbow's offset normal to the axis, which must not be zero."""
    offset = reject(elbow, axis)
    if norm(offset) <= ROUNDING * norm(elbow):
        raise UrdfError(
            f"the axes of joints {listed((first.joint.name, second.joint.name))} must be apart; got"
            " two joints that turn about the same line"
        )
    return offset


def _source_frame(axis: Vector3, elbow: Vector3, gravity: Vector3) -> Frame:
    """Return the derivation's frame, from the first joint's axis and gravity."""
    size = norm(gravity)
    in_plane = reject(gravity, axis)
    if norm(in_plane) <= ROUNDED_TURN * size:
        x = unit(elbow)
        note = (
            "Gravity is normal to the plane of motion: it does no work, and the joints bear it."
            if size
            else ""
        )
        return Frame((x, unit(cross(axis, x)), axis), 0.0, note)
    axes = _axes_along(unit(in_plane), axis)
    if _lean(gravity, axis) <= ROUNDING:
        return Frame(axes, size)
    return Frame(axes, norm(in_plane), note_on_gravity(gravity, axis, norm(in_plane)))


def _lean(gravity: Vector3, axis: Vector3) -> float:
    """Return the angle (rad) of gravity to the plane that is normal to an axis."""
    return math.atan2(abs(dot(gravity, axis)), norm(reject(gravity, axis)))


def note_on_gravity(gravity: Vector3, axis: Vector3, component: float) -> str:
    """Return the sentence on gravity oblique to a plane, of which a component (m/s²) acts."""
    lean = _lean(gravity, axis)
    return (
        f"Gravity makes an angle of {lean:.3g} rad with the plane of motion: its component in the"
        f" plane, {component:.5g} m/s², acts, and the joints bear the rest."
    )


def _axes_along(y: Vector3, axis: Vector3) -> Axes:
    """Return x, y, z with y as given, and with z along the axis or against it."""
    x = unit(cross(y, axis))
    # Of the two ways to look at the plane, the one in which x points along a positive axis of the
    # world. Components that differ by rounding alone count as equal; the first one decides.
    if max(x, key=lambda component: round(abs(component), 9)) < 0:
        return subtract(ZERO, x), y, subtract(ZERO, axis)
    return x, y, axis


def _projection(axes: Axes, rotation: Matrix3) -> Projection:
    """Return the map from a vector in a link's frame to its x and y (m), at joint angles zero."""

    def project(vector: Vector3) -> Point2:
        turned = turn(rotation, vector)
        # Adding 0.0 turns −0.0 into 0.0: a direction is π from x, never −π.
        return dot(axes[0], turned) + 0.0, dot(axes[1], turned) + 0.0

    return project


def _angle(start: Point2, end: Point2) -> float:
    """Return the angle between two directions (rad), positive from x towards y, in (−π, π]."""
    sine = start[0] * end[1] - start[1] * end[0]
    return math.atan2(sine + 0.0, start[0] * end[0] + start[1] * end[1])


def _sign(number: float) -> int:
    return 1 if number > 0 else -1


def _parameters(
    lumped: Lump, end: Vector3, direction: Point2, project: Projection
) -> LinkParameters:
    """Return a link's parameters in its own planar frame, which points along a direction."""
    (dx, dy), (cx, cy) = direction, project(lumped.centre)
    return LinkParameters(
        mass=lumped.mass,
        length=distance(end, project),
        centre=(dx * cx + dy * cy, dx * cy - dy * cx),
        inertia=lumped.inertia,
    )


def _check_that_it_resists(
    first: RigidBody, second: RigidBody, links: tuple[LinkParameters, LinkParameters]
) -> None:
    """Refuse a chain whose mass matrix is singular in some pose."""
    link = link_without_inertia(links)
    if link is not None:
        joint = (first, second)[link - 1].joint
        raise UrdfError(
            f"link {quoted(joint.child)} must have an inertia about the axis of joint"
            f" {quoted(joint.name)}, or a mass off this axis; got neither"
        )
