"""The planar two-link chain that a URDF describes.

A URDF may stand anywhere, turn about axes of either sign, and be split into many links. Reading
combines rigidly connected links (`lumping`), and finds the plane of motion and both links in it
(`plane`).
"""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike, fspath
from typing import Any

from twolink.coordinates import JointConvention
from twolink.inputs import as_path, as_real, as_tuple, as_word, refuse
from twolink.text import quoted
from twolink.urdf.link_parameters import LinkParameters
from twolink.urdf.lumping import RigidBody, two_bodies
from twolink.urdf.plane import in_the_plane
from twolink.urdf.reading import Limits, naming, parse_xml, tree_of
from twolink.urdf.spatial import STANDARD_GRAVITY, Vector3
from twolink.urdf.text import read_text
from twolink.urdf.unread import check_names, unread


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
    with naming(as_word("source", source)):
        robot = parse_xml(text)
        check_names(robot)
        first, second = two_bodies(tree_of(robot))
        plane = in_the_plane(first, second, tip, gravity)
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
        notes=(*plane.notes, *unread(robot)),
        gravity_note=frame.note,
        left_out=(*_resistance_left_out(first), *_resistance_left_out(second)),
    )


def _gravity(value: Any) -> Vector3:
    wanted = "three finite numbers in m/s²"
    entries = as_tuple("gravity", value, wanted)
    if len(entries) != 3:
        refuse("gravity", value, wanted)
    gx, gy, gz = (as_real(f"gravity[{k}]", entry) for k, entry in enumerate(entries))
    return gx, gy, gz


def _resistance_left_out(body: RigidBody) -> tuple[str, ...]:
    """Return a sentence if a joint has damping or friction, which the chain does not."""
    joint = body.joint
    if joint.damping == 0 and joint.friction == 0:
        return ()
    return (
        f"Joint {quoted(joint.name)} has damping {joint.damping:g} N m s/rad and friction"
        f" {joint.friction:g} N m; the chain leaves both out.",
    )
