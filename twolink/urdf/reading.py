"""A URDF file as a tree of links and joints: read, and checked as a file.

Nothing here knows of planes or chains. Only what moves and what has mass is read; shapes,
materials and the like are left to those who draw. Libraries that read URDF accept truncated
files, cycles, zero axes and negative masses; here each of them is refused, in one sentence.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from twolink.errors import UrdfError
from twolink.urdf.spatial import Array, Pose, norm, rotation_of

LARGEST_FILE = 16_000_000
MOVING = ("revolute", "continuous")
NOT_PLANAR = ("prismatic", "floating", "planar")


@dataclass(frozen=True)
class Inertial:
    """A mass (kg), the pose of its centre in the link, and its inertia about it (kg m²)."""

    mass: float
    pose: Pose
    inertia: Array


@dataclass(frozen=True)
class Link:
    """A link, with its inertial if it has mass."""

    name: str
    inertial: Inertial | None


@dataclass(frozen=True)
class Joint:
    """A joint: its type, the links it joins, its pose in the parent, its unit axis."""

    name: str
    kind: str
    parent: str
    child: str
    pose: Pose
    axis: Array

    @property
    def moves(self) -> bool:
        """Whether the joint turns."""
        return self.kind in MOVING


@dataclass(frozen=True)
class Tree:
    """Links and joints that hang together: `joints` come in order from the root."""

    source: str
    root: str
    links: dict[str, Link]
    joints: tuple[Joint, ...]


def read_text(path: str | PathLike[str]) -> str:
    """Return a URDF file's text. Raises `UrdfError` for what cannot be one."""
    file = Path(path)
    if not file.exists():
        raise UrdfError(f"{file}: there is no such file; allowed is the path of a URDF file")
    if not file.is_file():
        raise UrdfError(f"{file}: this is not a file; allowed is the path of a URDF file")
    try:
        with file.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
        text = content.decode("utf-8-sig")
    except OSError as error:
        raise UrdfError(f"{file}: it cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise UrdfError(
            f"{file}: byte {error.start} is not UTF-8; allowed is URDF in UTF-8"
        ) from error
    if len(content) > LARGEST_FILE:
        raise UrdfError(f"{file}: the file is larger than the {LARGEST_FILE} bytes allowed")
    return text


def parse_tree(text: str, source: str) -> Tree:
    """Return the tree that a URDF text describes. Raises `UrdfError` naming the culprit."""
    robot = _robot(text, source)
    links: dict[str, Link] = {}
    for element in robot.findall("link"):
        link = _link(element, source)
        if link.name in links:
            raise UrdfError(f"{source}: link '{link.name}' is there twice; names must differ")
        links[link.name] = link
    joints: dict[str, Joint] = {}
    for element in robot.findall("joint"):
        joint = _joint(element, source)
        if joint.name in joints:
            raise UrdfError(f"{source}: joint '{joint.name}' is there twice; names must differ")
        joints[joint.name] = joint
    root, ordered = _hang_together(links, list(joints.values()), source)
    return Tree(source, root, links, ordered)


def _robot(text: str, source: str) -> ElementTree.Element:
    """Return the <robot> element of a text that is harmless, well-formed URDF."""
    if not text.strip():
        raise UrdfError(f"{source}: the file is empty; allowed is a URDF file")
    if re.search(r"<!(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise UrdfError(f"{source}: it declares a document type or entities; plain XML is allowed")
    if "${" in text:
        raise UrdfError(f"{source}: it has xacro's '${{…}}' in it; run xacro on it first")
    try:
        robot = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise UrdfError(f"{source}: this is not well-formed XML: {error}") from error
    if robot.tag != "robot":
        raise UrdfError(f"{source}: its root is <{robot.tag}>; allowed is <robot>")
    return robot


def _link(element: ElementTree.Element, source: str) -> Link:
    name = _name(element, source)
    where = f"{source}: link '{name}'"
    inertial = element.find("inertial")
    if inertial is None:
        return Link(name, None)
    mass = _number(_child(inertial, "mass", where), "value", f"{where}: mass")
    if mass < 0:
        raise UrdfError(f"{where}: mass is {mass!r}; allowed is zero or a positive number of kg")
    entries = _child(inertial, "inertia", where)
    xx, xy, xz, yy, yz, zz = (
        _number(entries, f"i{axes}", f"{where}: inertia")
        for axes in ("xx", "xy", "xz", "yy", "yz", "zz")
    )
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if mass == 0:
        if inertia.any():
            raise UrdfError(f"{where}: it has inertia and no mass; allowed is both, or neither")
        return Link(name, None)
    return Link(name, Inertial(mass, _origin(inertial, f"{where}: inertial"), inertia))


def _joint(element: ElementTree.Element, source: str) -> Joint:
    name = _name(element, source)
    where = f"{source}: joint '{name}'"
    kind = element.get("type", "")
    if kind in NOT_PLANAR:
        raise UrdfError(f"{where}: it is {kind}; allowed are revolute, continuous and fixed")
    if kind not in (*MOVING, "fixed"):
        raise UrdfError(f"{where}: its type is '{kind}'; allowed are revolute, continuous, fixed")
    if kind != "fixed" and element.find("mimic") is not None:
        raise UrdfError(f"{where}: it mimics another joint; allowed are joints that move freely")
    if kind == "revolute":
        limit = element.find("limit")
        if limit is None:
            raise UrdfError(
                f"{where}: it is revolute without <limit>; allowed without is continuous"
            )
        for attribute in ("effort", "velocity"):
            _number(limit, attribute, f"{where}: limit")
    axis_element = element.find("axis")
    axis = np.array([1.0, 0.0, 0.0])
    if axis_element is not None and kind != "fixed":
        axis = _numbers(axis_element, "xyz", f"{where}: axis")
        length = norm(axis)
        if length == 0:
            raise UrdfError(f"{where}: its axis is 0 0 0; allowed is any direction")
        axis = axis / length
    return Joint(
        name=name,
        kind=kind,
        parent=_link_name(element, "parent", where),
        child=_link_name(element, "child", where),
        pose=_origin(element, where),
        axis=axis,
    )


def _hang_together(
    links: dict[str, Link], joints: list[Joint], source: str
) -> tuple[str, tuple[Joint, ...]]:
    """Return the root and the joints in order from it, or say why they are no tree."""
    if not links:
        raise UrdfError(f"{source}: it has no links; allowed is a planar two-link chain")
    carrier: dict[str, str] = {}
    carried: dict[str, list[Joint]] = {name: [] for name in links}
    for joint in joints:
        for name in (joint.parent, joint.child):
            if name not in links:
                raise UrdfError(f"{source}: joint '{joint.name}' names link '{name}', not there")
        if joint.child in carrier:
            raise UrdfError(
                f"{source}: link '{joint.child}' hangs on joints '{carrier[joint.child]}' and "
                f"'{joint.name}'; allowed is one"
            )
        carrier[joint.child] = joint.name
        carried[joint.parent].append(joint)
    roots = [name for name in links if name not in carrier]
    if len(roots) > 1:
        raise UrdfError(
            f"{source}: links '{roots[0]}' and '{roots[1]}' are both roots; one is allowed"
        )
    if not roots:
        raise UrdfError(f"{source}: its joints run in a circle; allowed is a tree with one root")
    ordered: list[Joint] = []
    waiting = [roots[0]]
    while waiting:
        hanging = carried[waiting.pop()]
        ordered += hanging
        waiting += [joint.child for joint in hanging]
    if len(ordered) < len(joints):
        lost = next(joint for joint in joints if joint not in ordered)
        raise UrdfError(f"{source}: joint '{lost.name}' is in a circle; allowed is a tree")
    return roots[0], tuple(ordered)


def _origin(element: ElementTree.Element, where: str) -> Pose:
    """Return the pose in an element's <origin>, the identity where it says nothing."""
    origin = element.find("origin")
    if origin is None:
        return Pose(np.eye(3), np.zeros(3))
    xyz = _numbers(origin, "xyz", f"{where}: origin", default="0 0 0")
    rpy = _numbers(origin, "rpy", f"{where}: origin", default="0 0 0")
    return Pose(rotation_of(rpy), xyz)


def _name(element: ElementTree.Element, source: str) -> str:
    name = element.get("name", "")
    if not name:
        raise UrdfError(f"{source}: a <{element.tag}> has no name; each must have one")
    return name


def _link_name(element: ElementTree.Element, tag: str, where: str) -> str:
    name = _child(element, tag, where).get("link", "")
    if not name:
        raise UrdfError(f"{where}: its <{tag}> names no link; each joint joins two")
    return name


def _child(element: ElementTree.Element, tag: str, where: str) -> ElementTree.Element:
    child = element.find(tag)
    if child is None:
        raise UrdfError(f"{where}: <{tag}> is missing from its <{element.tag}>")
    return child


def _number(element: ElementTree.Element, attribute: str, where: str) -> float:
    text = element.get(attribute)
    values = list(_finite((text or "").split()))
    if len(values) != 1:
        raise UrdfError(f"{where}: {attribute} is {_quoted(text)}; allowed is a finite number")
    return values[0]


def _numbers(
    element: ElementTree.Element, attribute: str, where: str, default: str | None = None
) -> Array:
    text = element.get(attribute, default)
    values = list(_finite((text or "").split()))
    if len(values) != 3:
        raise UrdfError(f"{where}: {attribute} is {_quoted(text)}; allowed are 3 finite numbers")
    return np.array(values)


def _finite(words: list[str]) -> Iterator[float]:
    """Yield words as numbers, up to the first that is not a finite one."""
    for word in words:
        try:
            value = float(word)
        except ValueError:
            return
        # float() reads 1_000 and ١; C++ readers of URDF do not.
        if not (math.isfinite(value) and word.isascii() and "_" not in word):
            return
        yield value


def _quoted(text: str | None) -> str:
    """Return what stood there, shortened to a readable length."""
    if text is None:
        return "missing"
    return f"'{text}'" if len(text) <= 40 else f"'{text[:40]}…'"
