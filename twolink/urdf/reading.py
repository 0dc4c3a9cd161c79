"""From a URDF file to a tree of links and joints, checked against the URDF standard.

Nothing here knows of planes or of two links. What a simulator would ignore (geometry, materials,
transmissions, plug-ins) is ignored; what it would need is read strictly, because a number that is
misread gives a chain that is wrong and looks right.
"""

from __future__ import annotations

import math
import re
import reprlib
import xml.etree.ElementTree as ET
from collections import defaultdict, deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from twolink.errors import UrdfError
from twolink.urdf.spatial import Matrix3, Pose, Vector3, rotation_from_rpy, unit

LARGEST_FILE = 16 * 2**20
"""Bytes of the largest file read; a URDF carries no meshes, so more than this is a mistake."""

# Characters of a path, of which the last name has 255 at most.
_LONGEST_NAME = 400

JOINT_TYPES = ("fixed", "revolute", "continuous", "prismatic", "floating", "planar")

# Python's float() also takes "1_000", "nan" and digits of every script. A URDF does not.
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)

_XACRO = "xacro"

Limits = tuple[float, float]
"""The lower and the upper angle of a joint (rad)."""

_short = reprlib.Repr()
_short.maxstring = 60


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

    `axis` is a unit vector. `damping` (N m s/rad), `friction` (N m) and `limits` (rad) are as the
    file has them; only a revolute joint has limits.
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


@dataclass(frozen=True)
class Tree:
    """The links by name, and the joints ordered so that each comes after the one before it."""

    root: str
    links: dict[str, Link]
    joints: tuple[Joint, ...]


@contextmanager
def naming(source: str) -> Iterator[None]:
    """Put the name of the file before the sentence of any `UrdfError` raised inside."""
    # What no file system would hold for a name is not repeated.
    name = source if len(source) <= _LONGEST_NAME else quoted(source)
    try:
        yield
    except UrdfError as error:
        raise UrdfError(f"{name}: {error}") from error.__cause__


def quoted(text: object) -> str:
    """Return text from a file in quotes, on one line, shortened if it is long."""
    return _short.repr(text)


def listed(names: Iterable[str]) -> str:
    """Return names in quotes with commas between, at most eight of them."""
    every = list(names)
    rest = [f"{len(every) - 8} more"] if len(every) > 8 else []
    return ", ".join([quoted(name) for name in every[:8]] + rest)


def read_text(path: str | PathLike[str]) -> str:
    """Return the text of a file.

    Raises `UrdfError` for anything but a readable UTF-8 file of at most 16 MB.
    """
    file = Path(path)
    try:
        if file.is_dir():
            raise UrdfError("is a folder; allowed is a URDF file")
        if not file.is_file():
            raise UrdfError("there is no file of this name; allowed is the path of a URDF file")
        with file.open("rb") as stream:
            # One byte more than is allowed tells that there are too many.
            content = stream.read(LARGEST_FILE + 1)
    except OSError as error:
        raise UrdfError(f"cannot be read ({error.strerror}); allowed is a readable file") from error
    _check_size(len(content))
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UrdfError(f"byte {error.start} is not UTF-8; allowed is UTF-8 text") from error


def parse_tree(text: str) -> Tree:
    """Return the tree of links and joints that URDF text describes; lengths in m, angles in rad.

    Raises `UrdfError` for text that is not URDF: malformed or hostile XML, names missing or given
    twice, numbers that are not finite, and links that do not hang together as one tree.
    """
    _check_size(len(text))
    robot = _parse_xml(text)
    links = [_read_link(element) for element in _named(robot, "link")]
    joints = [_read_joint(element) for element in _named(robot, "joint")]
    return _grown({link.name: link for link in links}, joints)


def _check_size(size: int) -> None:
    if size > LARGEST_FILE:
        raise UrdfError(f"is larger than {LARGEST_FILE // 2**20} MB; allowed is a smaller file")


class _Builder(ET.TreeBuilder):
    """Builds elements, and stops where a DOCTYPE begins: its entities can expand without end."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise UrdfError("it has a DOCTYPE declaration; allowed is plain XML without entities")


def _parse_xml(text: str) -> ET.Element:
    """Return the <robot> element of well-formed XML."""
    if not text.strip():
        raise UrdfError("is empty; allowed is a URDF with a <robot> element")
    parser = ET.XMLParser(target=_Builder())
    try:
        parser.feed(text)
        robot: ET.Element = parser.close()
    except (ET.ParseError, UnicodeEncodeError) as error:
        raise UrdfError(f"is not well-formed XML ({error}); allowed is a URDF") from error
    if _local(robot.tag) != "robot":
        raise UrdfError(f"its root element is {quoted(robot.tag)}; allowed is <robot>")
    for element in robot.iter():
        unexpanded = _XACRO in str(element.tag) or any("${" in v for v in element.attrib.values())
        if unexpanded:
            raise UrdfError(
                f"it holds xacro that is not expanded, in {quoted(element.tag)}; allowed is plain"
                " URDF, as the command xacro writes it"
            )
    if not robot.get("name"):
        raise UrdfError("its <robot> has no name; allowed is any name")
    return robot


def _local(tag: object) -> str:
    """Return a tag without its namespace; Drake's files, for one, put the robot in a namespace."""
    return str(tag).rpartition("}")[2]


def _named(robot: ET.Element, tag: str) -> list[ET.Element]:
    """Return the robot's links or joints, after a check that each has a name of its own."""
    elements = robot.findall(f"{{*}}{tag}")
    seen: set[str] = set()
    for position, element in enumerate(elements, start=1):
        name = element.get("name")
        if not name:
            raise UrdfError(f"{tag} number {position} has no name; allowed is any name of its own")
        if name in seen:
            raise UrdfError(f"two {tag}s are named {quoted(name)}; allowed is one {tag} to a name")
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
        raise UrdfError(f"{where}: mass is {mass!r} kg; allowed is zero or a positive number")
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
        raise UrdfError(f"{where}: type is {quoted(kind)}; allowed is one of {listed(JOINT_TYPES)}")
    limits = _read_limits(element.find("{*}limit"), kind, where)
    dynamics = element.find("{*}dynamics")
    return Joint(
        name=name,
        type=kind,
        parent=_link_at_end(element, "parent", where),
        child=_link_at_end(element, "child", where),
        pose=_read_pose(element, where),
        axis=_read_axis(element.find("{*}axis"), where),
        mimics=element.find("{*}mimic") is not None,
        damping=_number(dynamics, "damping", f"{where}: damping", default=0.0),
        friction=_number(dynamics, "friction", f"{where}: friction", default=0.0),
        limits=limits,
    )


def _link_at_end(element: ET.Element, end: str, where: str) -> str:
    """Return the name of a joint's parent or child link."""
    link = element.find(f"{{*}}{end}")
    name = None if link is None else link.get("link")
    if not name:
        raise UrdfError(f"{where} has no {end} link; allowed is the name of a link")
    return name


def _read_axis(axis: ET.Element | None, where: str) -> Vector3:
    """Return a joint's axis as a unit vector; without <axis> the standard says x."""
    if axis is None:
        return (1.0, 0.0, 0.0)
    direction = _vector(axis, "xyz", f"{where}: axis")
    if not any(direction):
        raise UrdfError(f"{where}: axis is zero; allowed is any other direction")
    return unit(direction)


def _read_limits(limit: ET.Element | None, kind: str, where: str) -> Limits | None:
    """Return a revolute joint's limits (rad), 0 where one is absent, as the standard has it.

    Refuses limits that the standard refuses; whether they leave room is asked by who uses them.
    """
    if limit is None:
        if kind == "revolute":
            raise UrdfError(
                f"{where} is revolute and has no <limit>; allowed is a <limit>, or type continuous"
            )
        return None
    for name in ("effort", "velocity"):
        _number(limit, name, f"{where}: limit {name}")
    lower, upper = (
        _number(limit, name, f"{where}: limit {name}", default=0.0) for name in ("lower", "upper")
    )
    return (lower, upper) if kind == "revolute" else None


def _read_pose(element: ET.Element, where: str) -> Pose:
    """Return the <origin> of an element; what it does not give is zero."""
    origin = element.find("{*}origin")
    if origin is None:
        return Pose()
    if "quat_xyzw" in origin.attrib:
        raise UrdfError(f"{where}: origin has quat_xyzw; allowed is xyz and rpy")
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


def _numbers(text: str | None, where: str, count: int, allowed: str) -> list[float]:
    if text is None:
        raise UrdfError(f"{where} is missing; allowed is {allowed}")
    words = text.split()
    numbers = [float(word) for word in words if _NUMBER.fullmatch(word)]
    if not len(words) == len(numbers) == count or not all(map(math.isfinite, numbers)):
        raise UrdfError(f"{where} is {quoted(text)}; allowed is {allowed}")
    return numbers


def _grown(links: dict[str, Link], joints: list[Joint]) -> Tree:
    """Return links and joints as a tree, after a check that they are one."""
    above: dict[str, Joint] = {}
    below: dict[str, list[Joint]] = defaultdict(list)
    for joint in joints:
        for end, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise UrdfError(
                    f"joint {quoted(joint.name)}: {end} link {quoted(name)} does not exist;"
                    f" allowed is one of {listed(links)}"
                )
        if joint.child in above:
            raise UrdfError(
                f"link {quoted(joint.child)} is the child of two joints,"
                f" {listed([above[joint.child].name, joint.name])}; allowed is one"
            )
        above[joint.child] = joint
        below[joint.parent].append(joint)
    root = _only_root([name for name in links if name not in above], links)
    ordered = tuple(_outward(root, below))
    if len(ordered) < len(joints):
        reached = {joint.name for joint in ordered}
        astray = next(joint.name for joint in joints if joint.name not in reached)
        raise UrdfError(
            f"joint {quoted(astray)} is part of a closed loop; allowed is a tree of links"
        )
    return Tree(root, links, ordered)


def _only_root(roots: list[str], links: dict[str, Link]) -> str:
    if not links:
        raise UrdfError("it has no link; allowed is a planar chain of two moving links")
    if not roots:
        raise UrdfError(f"its links form a closed loop, {listed(links)}; allowed is a tree")
    if len(roots) > 1:
        raise UrdfError(
            f"{len(roots)} links hang on no joint, {listed(roots)}; allowed is one root link"
        )
    return roots[0]


def _outward(root: str, below: dict[str, list[Joint]]) -> Iterator[Joint]:
    """Yield the joints from the root outward; a loop, so that no chain is too long for it."""
    waiting = deque([root])
    while waiting:
        for joint in below[waiting.popleft()]:
            yield joint
            waiting.append(joint.child)
