"""From a URDF to the planar two-link chain that it describes, and to where that chain stands.

A URDF may stand anywhere, turn about axes of either sign, and be split into many links. The source
has one frame: A the origin, y along gravity, z the axis of rotation, x = y × z. Reading finds that
frame in the file, and then each link's own: `along` towards its end, `across` a quarter turn on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike, fspath
from typing import Any

from twolink.coordinates import JointConvention
from twolink.errors import UrdfError
from twolink.inputs import as_path, as_real, as_tuple, as_word, refuse
from twolink.text import quoted
from twolink.urdf.lumping import Lump, RigidBody, lump, two_bodies
from twolink.urdf.reading import Limits, listed, naming, parse_tree
from twolink.urdf.spatial import (
    STANDARD_GRAVITY,
    ZERO,
    Matrix3,
    Vector3,
    cross,
    dot,
    norm,
    reject,
    scale,
    subtract,
    turn,
    unit,
)
from twolink.urdf.text import read_text

ROUNDING = 1e-12
"""Ratios of lengths up to this are zero, as are angles (rad) that count by their square: float64
leaves as much after some thousand rotations."""

ROUNDED_TURN = 1e-14
"""Angles (rad) up to this are zero where they count by themselves: float64 leaves as much after a
hundred rotations. A right angle typed with 13 digits is off by 1e-13, which acts."""

NEGLECTED = 1e-5
"""The largest tilt (rad) of one axis from the other that is neglected, with a note. A right angle
typed as 1.5708 is off by 3.7e-6 and 3.1416 by 7.3e-6, in files whose authors meant a plane; 1.571
is off by 2e-4. Gravity in the plane is not neglected, however small."""

Point2 = tuple[float, float]
Axes = tuple[Vector3, Vector3, Vector3]
Projection = Callable[[Vector3], Point2]


@dataclass(frozen=True)
class LinkParameters:
    """One link: mass (kg), length (m), mass centre along and across (m), inertia (kg m²).

    The inertia is about the mass centre and the axis of rotation.
    """

    mass: float
    length: float
    centre: tuple[float, float]
    inertia: float


@dataclass(frozen=True)
class PlanarUrdf:
    """A planar two-link chain as a URDF file describes it; SI units and radians.

    `path` and `xml` are the file's name and text, so that an engine can load the very same text.
    `joint_names` are the moving joints in order from the base, `link_names` the links they move.
    `joints` ties joint angles to the derivation's absolute angles. `damping` (N m s/rad),
    `friction` (N m) and `limits` (lower and upper joint angle; none for a joint that turns freely)
    are those of the moving joints in the file; the chain omits them. `origin` is A, and `axes` are
    x, y and z of the derivation's frame, all in the world (the root link's frame); `gravity` is
    the size of its component in the plane (m/s²), along y, and `world_gravity` the whole vector in
    the world. `tip` names the frame taken as D, if the file has one, and `tip_position` is D in the
    frame of the second moving link.
    `notes` has a sentence for each thing that is assumed or neglected; `gravity_note` is the one
    of them on gravity that is not in the plane, or empty. `left_out` has a sentence for each joint
    with damping or friction, which are no part of the chain.
    """

    path: str
    xml: str
    links: tuple[LinkParameters, LinkParameters]
    joint_names: tuple[str, str]
    link_names: tuple[str, str]
    joints: JointConvention
    damping: tuple[float, float]
    friction: tuple[float, float]
    limits: tuple[Limits | None, Limits | None]
    origin: Vector3
    axes: tuple[Vector3, Vector3, Vector3]
    gravity: float
    world_gravity: Vector3
    tip: str | None
    tip_position: Vector3
    notes: tuple[str, ...]
    gravity_note: str
    left_out: tuple[str, ...]


@dataclass(frozen=True)
class _Frame:
    """The source's frame in the world, gravity in its plane (m/s²), and a note on the rest."""

    axes: Axes
    gravity: float
    note: str = ""


@dataclass(frozen=True)
class _Tip:
    """The frame taken as D, its position in the frame of link 2, and notes on the choice."""

    name: str | None
    position: Vector3
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Plane:
    """The chain in its plane: links, joint convention, frame, the end D, and notes."""

    links: tuple[LinkParameters, LinkParameters]
    joints: JointConvention
    frame: _Frame
    end: _Tip
    notes: tuple[str, ...]


def read_planar_urdf(
    path: str | PathLike[str],
    *,
    tip: str | None = None,
    gravity: Vector3 = (0.0, 0.0, -STANDARD_GRAVITY),
) -> PlanarUrdf:
    """Return the planar two-link chain that a URDF file describes.

    `tip` names the link whose frame is D; without it D is the frame "D" fixed to link 2, or else
    the farthest frame fixed to it, or else it is placed at twice the distance of the mass centre.
    `gravity` (m/s²) is in the root link's frame. Its component in the plane of motion acts on the
    chain; the joints bear the rest. Without gravity in the plane, as for a horizontal arm, x is the
    direction of link 1 at joint angle zero.

    Raises `UrdfError`, in one sentence that names the file and the joint or link, for a file that
    cannot be read or is not a planar two-link chain, and `ParameterError` for a gravity that is
    not finite.
    """
    file = as_path("path", path)
    with naming(str(file)):
        text = read_text(file)
    return parse_planar_urdf(text, source=fspath(path), tip=tip, gravity=gravity)


def parse_planar_urdf(
    text: str,
    *,
    source: str = "<string>",
    tip: str | None = None,
    gravity: Vector3 = (0.0, 0.0, -STANDARD_GRAVITY),
) -> PlanarUrdf:
    """Return the planar two-link chain that URDF text describes; see `read_planar_urdf`.

    `source` stands for the file's name in errors and in the result.
    """
    as_word("text", text)
    if tip is not None:
        as_word("tip", tip)
    gravity = _gravity(gravity)
    with naming(source):
        first, second = two_bodies(parse_tree(text))
        plane = _in_the_plane(first, second, tip, gravity)
    frame, end = plane.frame, plane.end
    return PlanarUrdf(
        path=source,
        xml=text,
        links=plane.links,
        joint_names=(first.joint.name, second.joint.name),
        link_names=(first.joint.child, second.joint.child),
        joints=plane.joints,
        damping=(first.joint.damping, second.joint.damping),
        friction=(first.joint.friction, second.joint.friction),
        limits=(first.joint.limits, second.joint.limits),
        origin=first.pose.position,
        axes=frame.axes,
        gravity=frame.gravity,
        world_gravity=gravity,
        tip=end.name,
        tip_position=end.position,
        notes=plane.notes,
        gravity_note=frame.note,
        left_out=(*_resistance_left_out(first), *_resistance_left_out(second)),
    )


def _in_the_plane(first: RigidBody, second: RigidBody, tip: str | None, gravity: Vector3) -> _Plane:
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
    direction1 = _direction(project1(second.pose.position))
    end = _find_tip(second, tip, lumps[1].centre, project2)
    direction2, undirected = _direction_of_link2(second, end.position, project2)
    links = (
        _parameters(lumps[0], second.pose.position, direction1, project1),
        _parameters(lumps[1], end.position, direction2, project2),
    )
    _check_that_it_resists(first, second, links)
    z = frame.axes[2]
    sign = _sign(dot(z, axis1)), _sign(dot(z, axis2))
    offset = _angle((1.0, 0.0), direction1), _angle(direction1, direction2)
    notes = (*tilted, *filter(None, [frame.note]), *end.notes, *undirected)
    return _Plane(links, JointConvention(sign, offset), frame, end, notes)


def _gravity(value: Any) -> Vector3:
    wanted = "three finite numbers in m/s²"
    entries = as_tuple("gravity", value, wanted)
    if len(entries) != 3:
        refuse("gravity", value, wanted)
    gx, gy, gz = (as_real(f"gravity[{k}]", entry) for k, entry in enumerate(entries))
    return gx, gy, gz


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


def _source_frame(axis: Vector3, elbow: Vector3, gravity: Vector3) -> _Frame:
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
        return _Frame((x, unit(cross(axis, x)), axis), 0.0, note)
    axes = _axes_along(unit(in_plane), axis)
    lean = math.atan2(abs(dot(gravity, axis)), norm(in_plane))
    if lean <= ROUNDING:
        return _Frame(axes, size)
    return _Frame(
        axes,
        norm(in_plane),
        f"Gravity makes an angle of {lean:.3g} rad with the plane of motion: its component in the"
        f" plane, {norm(in_plane):.5g} m/s², acts, and the joints bear the rest.",
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


def _find_tip(body: RigidBody, wanted: str | None, centre: Vector3, project: Projection) -> _Tip:
    """Return the frame taken as D: the wanted one, or that named D, or the best guess."""
    frames, link = body.frames, body.joint.child
    if wanted is not None:
        if wanted not in frames:
            raise UrdfError(
                f"tip must be a frame fixed to link {quoted(link)}, one of {listed(frames)}; got"
                f" {quoted(wanted)}"
            )
        return _Tip(wanted, frames[wanted].position)
    fixed = {name: pose.position for name, pose in frames.items() if name != link}
    if "D" in fixed:
        return _Tip("D", fixed["D"])
    farthest = max(fixed, key=lambda name: _distance(fixed[name], project), default=None)
    if farthest is not None and _distance(fixed[farthest], project) > 0:
        note = f"D is taken at frame {quoted(farthest)}, the farthest one fixed to link 2."
        return _Tip(farthest, fixed[farthest], (note,))
    if _distance(centre, project) > 0:
        note = (
            f"No frame is fixed to link {quoted(link)}; D is taken at twice the distance of its"
            " mass centre, as in a uniform bar."
        )
        return _Tip(None, scale(2.0, centre), (note,))
    return _Tip(None, ZERO, (f"No frame marks the end of link {quoted(link)}; D is taken at B.",))


def _direction_of_link2(
    body: RigidBody, tip: Vector3, project: Projection
) -> tuple[Point2, tuple[str, ...]]:
    """Return the unit vector from B to D, or along the link's own frame if D is at B."""
    if _distance(tip, project) > 0:
        return _direction(project(tip)), ()
    x, y = project((1.0, 0.0, 0.0)), project((0.0, 1.0, 0.0))
    # One of the two has at least half of its length squared in the plane.
    name, axis = ("x", x) if math.hypot(*x) > 0.5 else ("y", y)
    link = quoted(body.joint.child)
    return _direction(axis), (
        f"D is at B, so the {name}-axis of link {link} is taken as the direction of link 2.",
    )


def _distance(point: Vector3, project: Projection) -> float:
    """Return how far a point is from its joint's axis (m), and zero for a distance of rounding."""
    distance = math.hypot(*project(point))
    return distance if distance > ROUNDING * norm(point) else 0.0


def _direction(point: Point2) -> Point2:
    distance = math.hypot(*point)
    return point[0] / distance, point[1] / distance


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
        length=_distance(end, project),
        centre=(dx * cx + dy * cy, dx * cy - dy * cx),
        inertia=lumped.inertia,
    )


def _check_that_it_resists(
    first: RigidBody, second: RigidBody, links: tuple[LinkParameters, LinkParameters]
) -> None:
    """Refuse a chain whose mass matrix is singular in some pose."""
    for body, link in zip((first, second), links, strict=True):
        # A link 1 of no inertia is moved by link 2 at the elbow, unless that is a point mass.
        needed = body is second or links[1].inertia == 0
        if needed and link.inertia == 0 and not any(link.centre):
            raise UrdfError(
                f"link {quoted(body.joint.child)} must have an inertia about the axis of joint"
                f" {quoted(body.joint.name)}, or a mass off this axis; got neither"
            )


def _resistance_left_out(body: RigidBody) -> tuple[str, ...]:
    """Return a sentence if a joint has damping or friction, which the chain does not."""
    joint = body.joint
    if joint.damping == 0 and joint.friction == 0:
        return ()
    return (
        f"Joint {quoted(joint.name)} has damping {joint.damping:g} N m s/rad and friction"
        f" {joint.friction:g} N m; the chain leaves both out.",
    )
