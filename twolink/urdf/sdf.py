"""From a URDF of a planar two-link chain to SDF, as Gazebo, Drake and DART read it.

Links that fixed joints hold together are one link of SDF, with their inertia in space lumped; their
frames remain. SDF has no links without mass, and the first joint's parent is the world.
"""

from __future__ import annotations

import math
from xml.sax.saxutils import quoteattr

from twolink.urdf.lumping import RigidBody, lump_in_space, two_bodies
from twolink.urdf.planar import parse_planar_urdf
from twolink.urdf.reading import Joint, naming, parse_tree, parse_xml
from twolink.urdf.spatial import (
    Matrix3,
    Pose,
    Vector3,
    add,
    cross,
    dot,
    scale,
)


def sdf_of(text: str, *, source: str = "<string>") -> str:
    """Return the SDF of URDF text that describes a planar two-link chain.

    The names, masses, inertias in space, poses, axes, damping, friction and limits of what moves
    are kept. Geometry is left out, and so are limits the wrong way round and a robot's name that
    SDF reserves; `twolink.urdf.losses` lists what is not kept. Raises `UrdfError` for a URDF that
    is not such a chain, or whose inertia in space is beyond float64.
    """
    read = parse_planar_urdf(text, source=source)
    with naming(source):
        first, second = two_bodies(parse_tree(text))
        links = [
            _link(first, f"<pose>{_pose(first.pose)}</pose>"),
            _link(
                second,
                f"<pose relative_to={quoteattr(first.joint.child)}>{_pose(second.pose)}</pose>",
            ),
        ]
    parts = [
        *links,
        _joint(first, "world"),
        _joint(second, first.joint.child),
        *_frames(first),
        *_frames(second),
    ]
    name = parse_xml(text).attrib["name"]
    if name == "world" or "::" in name or (name.startswith("__") and name.endswith("__")):
        name = "_".join(read.joint_names)
    head = ['<?xml version="1.0"?>', '<sdf version="1.9">', f"<model name={quoteattr(name)}>"]
    return "\n".join([*head, *parts, "</model>", "</sdf>", ""])


def _link(body: RigidBody, pose: str) -> str:
    mass, centre, inertia = lump_in_space(body)
    moments = "".join(
        f"<{name}>{inertia[i][j]!r}</{name}>"
        for name, i, j in (
            ("ixx", 0, 0),
            ("ixy", 0, 1),
            ("ixz", 0, 2),
            ("iyy", 1, 1),
            ("iyz", 1, 2),
            ("izz", 2, 2),
        )
    )
    return (
        f"  <link name={quoteattr(body.joint.child)}>\n    {pose}\n"
        f"    <inertial><pose>{_numbers(centre)} 0 0 0</pose><mass>{mass!r}</mass>"
        f"<inertia>{moments}</inertia></inertial>\n  </link>"
    )


def _joint(body: RigidBody, parent: str) -> str:
    joint = body.joint
    near, turned = _frame_of(joint.axis)
    return (
        f"  <joint name={quoteattr(joint.name)} type={quoteattr(joint.type)}>\n"
        f"    <pose>{_pose(Pose(rotation=turned))}</pose>\n"
        f"    <parent>{_escaped(parent)}</parent><child>{_escaped(joint.child)}</child>\n"
        f"    <axis><xyz>{_numbers(near)}</xyz><limit>{_bounds(joint)}</limit><dynamics>"
        f"<damping>{joint.damping!r}</damping><friction>{joint.friction!r}</friction>"
        "</dynamics></axis>\n  </joint>"
    )


def _frame_of(axis: Vector3) -> tuple[Vector3, Matrix3]:
    """Return the link's axis that is nearest to a joint's, and the least rotation to the joint's.

    The joint's frame is turned by it, so that the joint turns about an axis of its frame: Drake
    takes any other within 1.5e-8 rad of an axis of the frame for this one.
    """
    largest = max(range(3), key=lambda i: abs(axis[i]))
    x, y, z = (math.copysign(float(i == largest), axis[i]) for i in range(3))
    near = (x, y, z)
    c, v = dot(near, axis), cross(near, axis)
    rows = [scale(v[i] / (1 + c), v) for i in range(3)]
    crossed = ((c, -v[2], v[1]), (v[2], c, -v[0]), (-v[1], v[0], c))
    first, second, third = (add(row, more) for row, more in zip(rows, crossed, strict=True))
    return near, (first, second, third)


def _bounds(joint: Joint) -> str:
    """Return the limits, without those the wrong way round, which SDF refuses."""
    lower, upper = joint.limits or (None, None)
    if lower is not None and upper is not None and lower > upper:
        lower = upper = None
    given = (
        ("lower", lower),
        ("upper", upper),
        ("effort", joint.effort),
        ("velocity", joint.velocity),
    )
    return "".join(f"<{name}>{value!r}</{name}>" for name, value in given if value is not None)


def _frames(body: RigidBody) -> list[str]:
    """Return the links that were lumped, as frames."""
    attached = quoteattr(body.joint.child)
    return [
        f"  <frame name={quoteattr(name)} attached_to={attached}><pose>{_pose(pose)}</pose></frame>"
        for name, pose in body.frames.items()
        if name != body.joint.child
    ]


def _escaped(name: str) -> str:
    return name.replace("&", "&amp;").replace("<", "&lt;")


def _pose(pose: Pose) -> str:
    return f"{_numbers(pose.position)} {_numbers(_rpy(pose.rotation))}"


def _rpy(rotation: Matrix3) -> Vector3:
    """Return roll, pitch and yaw (rad) of a rotation, which give it back at any pitch.

    Near a pitch of π/2, roll and yaw turn about one line, and the roll is an angle of two
    roundings. The yaw is that of the rotation without this roll.
    """
    (_, r01, r02), (_, r11, r12), (r20, r21, r22) = rotation
    roll = math.atan2(r21, r22)
    s, c = math.sin(roll), math.cos(roll)
    # The y-axis of Rz(yaw) Ry(pitch) is horizontal, and has the yaw alone.
    yaw = math.atan2(s * r02 - c * r01, c * r11 - s * r12)
    return roll, math.atan2(-r20, math.hypot(r21, r22)), yaw


def _numbers(vector: Vector3) -> str:
    return " ".join(repr(number + 0.0) for number in vector)
