"""From a URDF file to a tree of links and joints, checked against the URDF standard.

This module does not know of planes or of two links. Elements that simulators of rigid bodies ignore
(geometry, materials, transmissions, plug-ins) are ignored; the numbers of all others are read
strictly, because one that is misread gives a chain that is wrong and looks right. `unread` looks at
names.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections import defaultdict, deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from twolink.errors import UrdfError
from twolink.text import name_of_source, quoted
from twolink.urdf.spatial import Matrix3, Pose, Vector3, rotation_from_rpy, unit
from twolink.urdf.text import check_size

JOINT_TYPES = ("fixed", "revolute", "continuous", "prismatic", "floating", "planar")

# Python's float() also takes "1_000", "nan" and digits of every script. A URDF does not.
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)

_SPACES = re.compile(r"[ \t\r\n]+")

_XACRO = "xacro"
_XACRO_TAG = re.compile(r"</?xacro:")

_OTHER_FORMATS = {
    "sdf": "this is SDF, which ROS's sdformat_urdf turns into a URDF",
    "mujoco": "this is MJCF; give the URDF that it was made from",
    "mujocoinclude": "this is a part of an MJCF",
    "world": "this is a world of Gazebo, without an <sdf> around it",
    "COLLADA": "this is a mesh",
    "html": "this is a web page; download the file itself",
    "scene": "this is no robot",
}

UNLIMITED = "1e9"
"""The effort (N m) and the velocity (rad/s) that a written limit has, which limit nothing."""

Limits = tuple[float, float]
"""The lower and the upper angle of a joint (rad)."""

_X: Vector3 = (1.0, 0.0, 0.0)
"""The axis of a joint that has none; that of a fixed joint has no meaning, and is not read."""

_REPAIRED = " (`twolink urdf repair` declares it)"


@dataclass(frozen=True)
class Inertial:
    """Mass (kg), and inertia (kg m²) about the mass centre, in a frame posed in the link's."""

    mass: float
    inertia: Matrix3
    pose: Pose


@dataclass(frozen=True)
class Link:
    """A link of a robot; a link without inertial is a frame that weighs nothing."""

    name: str
    inertial: Inertial | None


@dataclass(frozen=True)
class Joint:
    """A joint: its child link's frame stands at `pose` in the parent's, and turns about `axis`.

    `axis` is a unit vector, without meaning for a fixed joint. `damping` (N m s/rad), `friction`
    (N m), `limits` (rad), `effort` (N m) and `velocity` (rad/s) are as the file has them; only a
    revolute joint has limits, and only one with <limit> has the latter two.
    """

    name: str
    type: str
    parent: str
    child: str
    pose: Pose
    axis: Vector3
    mimics: bool
    damping: float
    friction: float
    limits: Limits | None
    effort: float | None
    velocity: float | None


@dataclass(frozen=True)
class Tree:
    """The links by name, and the joints ordered so that each comes after the one before it."""

    root: str
    links: dict[str, Link]
    joints: tuple[Joint, ...]


@contextmanager
def naming(source: str) -> Iterator[None]:
    """Put the name of the file, if there is one, before the sentence of a `UrdfError`."""
    name = name_of_source(source)
    try:
        yield
    except UrdfError as error:
        raise UrdfError(f"{name}: {error}" if name else f"{error}") from error.__cause__


def listed(names: Iterable[str]) -> str:
    """Return names in quotes with commas between, at most eight of them."""
    every = list(names)
    rest = [f"{len(every) - 8} more"] if len(every) > 8 else []
    return ", ".join([quoted(name) for name in every[:8]] + rest)


def parse_tree(text: str) -> Tree:
    """Return the tree of links and joints that URDF text describes; lengths in m, angles in rad.

    Raises `UrdfError` for text that is not URDF: malformed or hostile XML, names missing or given
    twice, numbers that are not finite, and links that do not hang together as one tree.
    """
    return tree_of(parse_xml(text))


def tree_of(robot: ET.Element) -> Tree:
    """Return the tree of a <robot> element, as `parse_tree` does."""
    if not robot.get("name"):
        raise UrdfError("<robot> must have a name; got none (`twolink urdf repair` adds one)")
    links = [_read_link(element) for element in _named(robot, "link")]
    joints = [_read_joint(element) for element in _named(robot, "joint")]
    return _grown({link.name: link for link in links}, joints)


class _Builder(ET.TreeBuilder):
    """Builds elements, and stops where a DOCTYPE begins: its entities can expand without end."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise UrdfError("must be XML without a DOCTYPE declaration and its entities; got one")


def parse_xml(text: str, *, comments: bool = False) -> ET.Element:
    """Return the <robot> element of well-formed XML, without xacro in the elements that are read.

    With `comments`, those inside of <robot> are kept. Raises `UrdfError` for anything else, with a
    sentence of its own for other formats.
    """
    check_size(len(text))
    if not text.strip():
        raise UrdfError("must be a URDF with a <robot> element; got an empty file")
    parser = ET.XMLParser(target=_Builder(insert_comments=comments))
    try:
        parser.feed(text)
        robot: ET.Element = parser.close()
    except (ET.ParseError, UnicodeEncodeError) as error:
        if _XACRO_TAG.search(text):
            raise UrdfError(_not_expanded("a tag <xacro:…>")) from error
        raise UrdfError(f"must be well-formed XML; got an error: {error}") from error
    _check_root(robot)
    _check_expanded(robot)
    return robot


def _check_root(robot: ET.Element) -> None:
    root = local(robot.tag)
    if root == "robot":
        return
    other = _OTHER_FORMATS.get(root)
    if other is None:
        raise UrdfError(f"must be a URDF, whose root element is <robot>; got <{_shown(root)}>")
    raise UrdfError(f"must be a URDF, whose root element is <robot>; got <{root}>: {other}")


def _check_expanded(robot: ET.Element) -> None:
    """Refuse xacro, except where a simulator would not look: in plug-ins and names of meshes."""
    for element in robot.iter():
        if _XACRO in str(element.tag):
            raise UrdfError(_not_expanded(f"an element {_shown(local(element.tag))!r} of xacro"))
    parts = [robot, *robot.findall("{*}link"), *robot.findall("{*}joint")]
    for part in parts:
        for element in (part,) if part is robot else part.iter():
            for name, value in element.attrib.items():
                if "${" in value or ("$(" in value and name != "filename"):
                    place = f"{name} of <{_shown(local(element.tag))}>"
                    raise UrdfError(_not_expanded(f"the expression {quoted(value)} as {place}"))


def _not_expanded(found: str) -> str:
    return f"must be plain URDF, as the command xacro writes it; got {found}, xacro not expanded"


def _shown(tag: str) -> str:
    return quoted(tag)[1:-1]


def local(tag: object) -> str:
    """Return a tag without its namespace; Drake's files, for one, put the robot in a namespace."""
    return str(tag).rpartition("}")[2]


def _named(robot: ET.Element, tag: str) -> list[ET.Element]:
    """Return the robot's links or joints, after a check that each has a name of its own."""
    elements = robot.findall(f"{{*}}{tag}")
    seen: set[str] = set()
    for position, element in enumerate(elements, start=1):
        name = element.get("name")
        if not name:
            raise UrdfError(f"{tag} number {position} must have a name of its own; got none")
        if name in seen:
            raise UrdfError(f"names of {tag}s must differ; got two {tag}s named {quoted(name)}")
        seen.add(name)
    return elements


def _read_link(element: ET.Element) -> Link:
    name = element.attrib["name"]
    where = f"link {quoted(name)}"
    inertial = element.find("{*}inertial")
    if inertial is None:
        return Link(name, None)
    mass = _number(inertial.find("{*}mass"), "value", f"{where}: mass")
    if mass < 0:
        raise UrdfError(f"{where}: mass must be zero or positive; got {mass!r} kg")
    moments = inertial.find("{*}inertia")
    xx, xy, xz, yy, yz, zz = (
        _number(moments, name, f"{where}: inertia {name}")
        for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    matrix = (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)
    return Link(name, Inertial(mass, matrix, _read_pose(inertial, f"{where}: inertial")))


def _read_joint(element: ET.Element) -> Joint:
    name = element.attrib["name"]
    where = f"joint {quoted(name)}"
    kind = element.get("type")
    if kind not in JOINT_TYPES:
        raise UrdfError(f"{where}: type must be one of {listed(JOINT_TYPES)}; got {quoted(kind)}")
    limits, effort, velocity = _read_limits(element.find("{*}limit"), kind, where)
    dynamics = element.find("{*}dynamics")
    return Joint(
        name=name,
        type=kind,
        parent=_link_at_end(element, "parent", where),
        child=_link_at_end(element, "child", where),
        pose=_read_pose(element, where),
        axis=_X if kind == "fixed" else _read_axis(element.find("{*}axis"), where),
        mimics=element.find("{*}mimic") is not None,
        damping=_number(dynamics, "damping", f"{where}: damping", default=0.0),
        friction=_number(dynamics, "friction", f"{where}: friction", default=0.0),
        limits=limits,
        effort=effort,
        velocity=velocity,
    )


def _link_at_end(element: ET.Element, end: str, where: str) -> str:
    """Return the name of a joint's parent or child link."""
    link = element.find(f"{{*}}{end}")
    name = None if link is None else link.get("link")
    if not name:
        raise UrdfError(f"{where} must name its {end} link; got none")
    return name


def _read_axis(axis: ET.Element | None, where: str) -> Vector3:
    """Return a joint's axis as a unit vector; without <axis> the standard says x."""
    if axis is None:
        return _X
    direction = _vector(axis, "xyz", f"{where}: axis")
    if not any(direction):
        raise UrdfError(f"{where}: axis must be a direction; got zero")
    return unit(direction)


def _read_limits(
    limit: ET.Element | None, kind: str, where: str
) -> tuple[Limits | None, float | None, float | None]:
    """Return a revolute joint's limits (rad), 0 where one is absent, as the standard has it.

    The effort (N m) and velocity (rad/s) of the <limit> of any joint follow. Refuses limits that
    the standard refuses. Limits that leave no room are refused where they act.
    """
    if limit is None:
        if kind == "revolute":
            raise UrdfError(
                f"{where} is revolute and must have a <limit>; got none (a joint that turns freely"
                " is continuous)"
            )
        return None, None, None
    for name in ("effort", "velocity"):
        if name not in limit.attrib:
            raise UrdfError(
                f"{where}: limit {name} is missing; it must be a finite number"
                " (`twolink urdf repair` adds it)"
            )
    lower, upper, effort, velocity = (
        _number(limit, name, f"{where}: limit {name}", default=0.0)
        for name in ("lower", "upper", "effort", "velocity")
    )
    return (lower, upper) if kind == "revolute" else None, effort, velocity


def _read_pose(element: ET.Element, where: str) -> Pose:
    """Return the <origin> of an element; absent numbers are zero."""
    origin = element.find("{*}origin")
    if origin is None:
        return Pose()
    if "quat_xyzw" in origin.attrib:
        raise UrdfError(f"{where}: origin must have xyz and rpy; got quat_xyzw")
    zero = (0.0, 0.0, 0.0)
    position = _vector(origin, "xyz", f"{where}: origin xyz", default=zero)
    rpy = _vector(origin, "rpy", f"{where}: origin rpy", default=zero)
    return Pose(position, rotation_from_rpy(rpy))


def _number(
    element: ET.Element | None, attribute: str, where: str, default: float | None = None
) -> float:
    """Return one finite number; a missing one is refused unless there is a default."""
    text = None if element is None else element.get(attribute)
    if text is None and default is not None:
        return default
    (number,) = _numbers(text, where, 1, "a finite number")
    return number


def _vector(
    element: ET.Element, attribute: str, where: str, default: Vector3 | None = None
) -> Vector3:
    """Return three finite numbers; missing ones are refused unless there is a default."""
    text = element.get(attribute)
    if text is None and default is not None:
        return default
    x, y, z = _numbers(text, where, 3, "three finite numbers")
    return x, y, z


def _numbers(text: str | None, where: str, count: int, wanted: str) -> list[float]:
    if text is None:
        raise UrdfError(f"{where} is missing; it must be {wanted}")
    # Python's split() also takes spaces of every script, which XML does not.
    words = _SPACES.split(text.strip(" \t\r\n"))
    numbers = [float(word) for word in words if _NUMBER.fullmatch(word)]
    if not len(words) == len(numbers) == count or not all(map(math.isfinite, numbers)):
        raise UrdfError(f"{where} must be {wanted}; got {quoted(text)}")
    return numbers


def _grown(links: dict[str, Link], joints: list[Joint]) -> Tree:
    """Return links and joints as a tree, after a check that they are one."""
    above: dict[str, Joint] = {}
    below: dict[str, list[Joint]] = defaultdict(list)
    for joint in joints:
        for end, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise UrdfError(
                    f"joint {quoted(joint.name)}: {end} link must be one of {listed(links)}; got"
                    f" {quoted(name)}, which is not declared{_REPAIRED if end == 'parent' else ''}"
                )
        if joint.child in above:
            raise UrdfError(
                f"link {quoted(joint.child)} must be the child of one joint; got two,"
                f" {listed([above[joint.child].name, joint.name])}"
            )
        above[joint.child] = joint
        below[joint.parent].append(joint)
    root = _only_root([name for name in links if name not in above], links)
    ordered = tuple(_outward(root, below))
    if len(ordered) < len(joints):
        reached = {joint.name for joint in ordered}
        astray = next(joint.name for joint in joints if joint.name not in reached)
        raise UrdfError(f"links must form a tree; got a closed loop with joint {quoted(astray)}")
    return Tree(root, links, ordered)


def _only_root(roots: list[str], links: dict[str, Link]) -> str:
    if not links:
        raise UrdfError("must be a planar chain of two moving links; got no link")
    if not roots:
        raise UrdfError(f"links must form a tree; got a closed loop of {listed(links)}")
    if len(roots) > 1:
        raise UrdfError(
            f"links must form one tree; got {len(roots)} links that are the child of no joint,"
            f" {listed(roots)}"
        )
    return roots[0]


def _outward(root: str, below: dict[str, list[Joint]]) -> Iterator[Joint]:
    """Yield the joints from the root outward; a loop, so that no chain is too long for it."""
    waiting = deque([root])
    while waiting:
        for joint in below[waiting.popleft()]:
            yield joint
            waiting.append(joint.child)
