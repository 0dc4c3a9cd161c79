"""A description of a planar two-link URDF: how it was understood, and warnings on its numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from os import PathLike

from twolink.inputs import as_path
from twolink.text import as_vector, quoted
from twolink.urdf.link_parameters import LinkParameters
from twolink.urdf.lumping import RigidBody, two_bodies
from twolink.urdf.planar import PlanarUrdf, parse_planar_urdf
from twolink.urdf.plausibility import warnings_of
from twolink.urdf.reading import Limits, Tree, naming, parse_tree
from twolink.urdf.spatial import Vector3, turn
from twolink.urdf.text import read_text


@dataclass(frozen=True)
class Part:
    """A link of the file that moves with a body: its mass (kg), and its origin in the body (m)."""

    link: str
    mass: float
    position: Vector3


@dataclass(frozen=True)
class BodyDescription:
    """One moving link with its joint, and all links that fixed joints hold to it.

    `axis` is the joint's axis in the world with both joint angles zero. `parts` are the links of
    the file that were lumped, the moving one first. `damping` (N m s/rad), `friction` (N m) and
    `limits` (rad) are effects that the file offers.
    """

    joint: str
    type: str
    link: str
    axis: Vector3
    parts: tuple[Part, ...]
    parameters: LinkParameters
    damping: float
    friction: float
    limits: Limits | None


@dataclass(frozen=True)
class UrdfDescription:
    """A planar two-link URDF as it was understood; SI units and radians.

    `origin` is A and `axes` are x, y, z of the derivation's frame, in the root link's frame.
    `gravity` (m/s²) acts along y. `sign` and `offset` tie joint angles θ to absolute angles:
    q1 = s1 θ1 + φ1, q2 = q1 + s2 θ2 + φ2. `tip` is the frame taken as D. `grounded` are the links
    that do not move. `notes` has the assumptions, `warnings` the suspicious numbers.
    """

    path: str
    root: str
    grounded: tuple[str, ...]
    bodies: tuple[BodyDescription, BodyDescription]
    origin: Vector3
    axes: tuple[Vector3, Vector3, Vector3]
    gravity: float
    sign: tuple[int, int]
    offset: tuple[float, float]
    tip: str | None
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def read_description(path: str | PathLike[str], *, tip: str | None = None) -> UrdfDescription:
    """Return the description of a URDF file; raise `UrdfError` as `read_planar_urdf` does."""
    source = str(as_path("path", path))
    with naming(source):
        text = read_text(path)
    return describe(text, source=source, tip=tip)


def describe(text: str, *, source: str = "<string>", tip: str | None = None) -> UrdfDescription:
    """Return the description of URDF text; see `read_description`."""
    read = parse_planar_urdf(text, source=source, tip=tip)
    tree = parse_tree(text)
    first, second = two_bodies(tree)
    moving = {*first.frames, *second.frames}
    turned1 = first.pose.rotation
    turned2 = (first.pose @ second.pose).rotation
    described = (
        _described(first, tree, read, 0, turn(turned1, first.joint.axis)),
        _described(second, tree, read, 1, turn(turned2, second.joint.axis)),
    )
    return UrdfDescription(
        path=source,
        root=tree.root,
        grounded=tuple(name for name in tree.links if name not in moving),
        bodies=described,
        origin=read.origin,
        axes=read.axes,
        gravity=read.gravity,
        sign=read.joints.sign,
        offset=read.joints.offset,
        tip=read.tip,
        notes=read.notes,
        warnings=warnings_of(tree, (first, second), read),
    )


def _described(
    body: RigidBody, tree: Tree, read: PlanarUrdf, index: int, axis: Vector3
) -> BodyDescription:
    parts = []
    for name, pose in body.frames.items():
        inertial = tree.links[name].inertial
        parts.append(Part(name, 0.0 if inertial is None else inertial.mass, pose.position))
    return BodyDescription(
        joint=body.joint.name,
        type=body.joint.type,
        link=body.joint.child,
        axis=axis,
        parts=tuple(parts),
        parameters=read.links[index],
        damping=read.damping[index],
        friction=read.friction[index],
        limits=read.limits[index],
    )


_WIDE, _HIGH = 61, 15


def drawing(described: UrdfDescription) -> str:
    """Return a drawing of the chain in its plane, at joint angles zero: x to the right, y down.

    A, B and D are the joints and the end, 1 and 2 the mass centres; a letter stands where several
    fall together.
    """
    points = _points(described)
    low_x, high_x = (bound(x for x, _ in points.values()) for bound in (min, max))
    low_y, high_y = (bound(y for _, y in points.values()) for bound in (min, max))
    # A character is about twice as high as it is wide.
    scale = max((high_x - low_x) / (_WIDE - 1), (high_y - low_y) / (_HIGH - 1) / 2) or 1.0
    if not math.isfinite(scale):
        return "(too large to be drawn)"

    def cell(point: tuple[float, float]) -> tuple[int, int]:
        return round((point[1] - low_y) / scale / 2), round((point[0] - low_x) / scale)

    rows, columns = cell((high_x, high_y))
    canvas = [[" "] * (columns + 1) for _ in range(rows + 1)]
    for start, end in (("A", "B"), ("B", "D")):
        (x0, y0), (x1, y1) = points[start], points[end]
        for step in range(2 * _WIDE + 1):
            share = step / (2 * _WIDE)
            row, column = cell((x0 + share * (x1 - x0), y0 + share * (y1 - y0)))
            canvas[row][column] = "·"
    for name in ("1", "2", "D", "B", "A"):
        row, column = cell(points[name])
        canvas[row][column] = name
    return "\n".join("".join(row).rstrip() for row in canvas)


def _points(described: UrdfDescription) -> dict[str, tuple[float, float]]:
    """Return A, B, D and the mass centres 1 and 2 in the plane (m)."""
    q1 = described.offset[0]
    q2 = q1 + described.offset[1]
    first, second = (body.parameters for body in described.bodies)

    def place(
        start: tuple[float, float], angle: float, along: float, across: float
    ) -> tuple[float, float]:
        c, s = math.cos(angle), math.sin(angle)
        return start[0] + along * c - across * s, start[1] + along * s + across * c

    origin = (0.0, 0.0)
    elbow = place(origin, q1, first.length, 0.0)
    return {
        "A": origin,
        "B": elbow,
        "D": place(elbow, q2, second.length, 0.0),
        "1": place(origin, q1, *first.centre),
        "2": place(elbow, q2, *second.centre),
    }


def tree_lines(described: UrdfDescription) -> list[str]:
    """Return the file's links, one a line, below the joints that move them."""
    lines = [f"{quoted(described.root)} does not move" + _others(described)]
    for body in described.bodies:
        lines.append(f"joint {quoted(body.joint)}, {body.type}, about {as_vector(body.axis)}")
        for part in body.parts:
            weight = f"{part.mass:g} kg" if part.mass else "no mass"
            lines.append(f"  link {quoted(part.link)}, {weight}, at {as_vector(part.position)} m")
    return lines


def _others(described: UrdfDescription) -> str:
    others = [quoted(name) for name in described.grounded if name != described.root]
    return f", nor {'does' if len(others) == 1 else 'do'} {', '.join(others)}" if others else ""
