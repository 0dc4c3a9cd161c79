"""Repair of URDF files that engines refuse, without a change of their mechanics.

Each step is a function from the <robot> element, which it edits, to a sentence for each change.
The result is read strictly, and its mechanics (masses, inertias, poses, axes, damping and friction
of every link and joint) are compared with those of the original.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from os import PathLike
from xml.parsers import expat

from twolink.errors import UrdfError
from twolink.inputs import as_path, as_word
from twolink.text import quoted
from twolink.urdf.inertia import principal_moments, violates_triangle
from twolink.urdf.lumping import RigidBody, moment_about, two_bodies
from twolink.urdf.mechanics import difference, mechanics_of, same_motion
from twolink.urdf.planar import PlanarUrdf, parse_planar_urdf
from twolink.urdf.prefixes import prefixes_in, use_prefixes
from twolink.urdf.reading import (
    UNLIMITED,
    Inertial,
    Tree,
    local,
    naming,
    parse_tree,
    parse_xml,
)
from twolink.urdf.text import decoded_leniently, read_bytes
from twolink.urdf.unread import check_names

_MOVING = ("revolute", "continuous")

# The least moment of inertia (kg m²) that MuJoCo accepts of a link that moves.
_LEAST_MOMENT = 1e-15

_DECLARATION = '<?xml version="1.0" encoding="utf-8"?>\n'
# The space after its name tells it from instructions such as <?xml-model …?>.
_DECLARED = re.compile(r"\A\s*<\?xml\s.*?\?>\s*", re.DOTALL)


@dataclass(frozen=True)
class Repair:
    """The text of a repaired URDF, a sentence for each change, and notes on remaining faults.

    Without changes, the text is the original one.
    """

    text: str
    changes: tuple[str, ...]
    notes: tuple[str, ...]


def repair_file(path: str | PathLike[str]) -> Repair:
    """Return the repair of a URDF file; raise `UrdfError` with the reason if there is none."""
    source = str(as_path("path", path))
    with naming(source):
        text, changes = decoded_leniently(read_bytes(path))
        return _repaired(text, changes)


def repair_urdf(text: str, *, source: str = "<string>") -> Repair:
    """Return the repair of URDF text.

    Raises `UrdfError`, in one sentence with the reason, for text that is not a planar two-link
    chain even when repaired.
    """
    as_word("text", text)
    with naming(as_word("source", source)):
        return _repaired(text, ())


def _repaired(text: str, changes: tuple[str, ...]) -> Repair:
    robot = parse_xml(text, comments=True)
    check_names(robot)
    before = mechanics_of(robot)
    made = [*changes, *_whitespace(text)]
    for step in _STEPS:
        made += step(robot)
    # Read strictly, for the reasons that no step can remove.
    read = parse_planar_urdf(ET.tostring(robot, encoding="unicode"), source="")
    isotropic = _possible_inertias(robot)
    made += isotropic.values()
    if made:
        use_prefixes(robot, prefixes_in(text))
        made += _unused_namespaces(text, robot)
        text = _written(text, robot)
    _prove(before, read, text, frozenset(isotropic))
    return Repair(text, tuple(made), tuple(_remaining(parse_tree(text))))


def _prove(
    before: dict[str, object], read: PlanarUrdf, text: str, isotropic: frozenset[str]
) -> None:
    """Raise `UrdfError` if the mechanics of the text differ from those before the repair."""
    differs = difference(before, mechanics_of(parse_xml(text)), isotropic)
    if not differs and not same_motion(read, parse_planar_urdf(text, source="")):
        differs = "the planar chain"
    if differs:
        raise UrdfError(f"must keep its mechanics when it is repaired; got a change of {differs}")


def _written(original: str, robot: ET.Element) -> str:
    """Return the file's text: all that stood around <robot>, and the element as it is now."""
    content = original.encode("utf-8")
    start, end = _root_in(content)
    prolog, epilog = content[:start].decode("utf-8"), content[end:].decode("utf-8").strip()
    prolog = _DECLARATION + _DECLARED.sub("", prolog)
    element = ET.tostring(robot, encoding="unicode").rstrip()
    return f"{prolog}{element}\n{epilog}\n" if epilog else f"{prolog}{element}\n"


def _root_in(content: bytes) -> tuple[int, int]:
    """Return the indices of the bytes at which the root element begins, and after which it ends."""
    places: list[int] = []
    depth = 0
    parser = expat.ParserCreate("utf-8")

    def started(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        if depth == 0:
            places.append(parser.CurrentByteIndex)
        depth += 1

    def ended(name: str) -> None:
        nonlocal depth
        depth -= 1
        if depth == 0:
            places.append(content.index(b">", parser.CurrentByteIndex) + 1)

    parser.StartElementHandler, parser.EndElementHandler = started, ended
    parser.Parse(content, True)
    start, end = places
    return start, end


def _links(robot: ET.Element) -> list[ET.Element]:
    return robot.findall("{*}link")


def _joints(robot: ET.Element) -> list[ET.Element]:
    return robot.findall("{*}joint")


def _end(joint: ET.Element, end: str) -> str:
    element = joint.find(f"{{*}}{end}")
    return "" if element is None else element.get("link", "")


def _named(joint: ET.Element) -> str:
    return quoted(joint.get("name", ""))


def _drop(parent: ET.Element, child: ET.Element) -> None:
    """Remove an element, and keep the layout around it."""
    index = list(parent).index(child)
    if index == len(parent) - 1 and index > 0:
        parent[index - 1].tail = child.tail
    parent.remove(child)


def _append(parent: ET.Element, tag: str, attributes: dict[str, str], indent: str) -> ET.Element:
    """Append an element on a line of its own."""
    element = ET.SubElement(parent, tag, attributes)
    element.tail = indent[:-2] if len(indent) > 2 else "\n"
    if len(parent) > 1:
        parent[-2].tail = indent
    else:
        parent.text = indent
    return element


_BROKEN_VECTOR = re.compile(r"""\b(?:xyz|rpy|size|rgba|scale)\s*=\s*(["'])[^"'<]*?[\t\r\n]""")


def _whitespace(text: str) -> Iterator[str]:
    """Yield a change if vectors have tabs or line breaks, which are spaces in the written text."""
    if _BROKEN_VECTOR.search(text):
        yield "wrote tabs and line breaks inside of vectors as spaces, as Pinocchio refuses them"


def _plain_tags(robot: ET.Element) -> Iterator[str]:
    """Take the robot's elements out of their XML namespace, which no engine reads."""
    space = str(robot.tag).rpartition("}")[0]
    if not space:
        return
    for element in robot.iter():
        if isinstance(element.tag, str) and element.tag.startswith(space + "}"):
            element.tag = local(element.tag)
    for name in [name for name in robot.attrib if "}" in name]:
        del robot.attrib[name]
    yield f"took the elements out of the XML namespace {quoted(space[1:])}"


def _unused_namespaces(text: str, robot: ET.Element) -> Iterator[str]:
    """Yield a change for declarations of XML namespaces that the written text no longer has."""
    written = ET.tostring(robot, encoding="unicode")
    found = dict.fromkeys(re.findall(r"\sxmlns:([\w.-]+)\s*=", text))
    gone = [prefix for prefix in found if f"xmlns:{prefix}=" not in written]
    if gone:
        yield f"removed declarations of XML namespaces: {', '.join(map(quoted, gone))}"


def _robot_name(robot: ET.Element) -> Iterator[str]:
    if not robot.get("name"):
        robot.set("name", "robot")
        yield "named the robot 'robot'"


def _joint_names(robot: ET.Element) -> Iterator[str]:
    """Name joints that have no name, or that of a joint before them."""
    taken = {joint.get("name") for joint in _joints(robot)}
    seen: set[str] = set()
    for position, joint in enumerate(_joints(robot), start=1):
        name = joint.get("name", "")
        if name and name not in seen:
            seen.add(name)
            continue
        base = name or f"joint_{position}"
        free = (f"{base}_{number}" for number in range(2, len(taken) + 3))
        new = base if base not in taken else next(each for each in free if each not in taken)
        joint.set("name", new)
        taken.add(new)
        seen.add(new)
        was = f"the second joint {quoted(name)}" if name else f"joint number {position}"
        yield f"named {was} {quoted(new)}"


def _undeclared_links(robot: ET.Element) -> Iterator[str]:
    """Declare parents of joints, and children of fixed joints, as frames without mass."""
    declared = {link.get("name") for link in _links(robot)}
    for joint in _joints(robot):
        fixed = joint.get("type") == "fixed"
        for end in ("parent", "child") if fixed else ("parent",):
            name = _end(joint, end)
            if name and name not in declared:
                declared.add(name)
                link = ET.Element("link", {"name": name})
                _weigh_nothing(link)
                link.tail = robot.text or "\n  "
                robot.insert(0, link)
                yield f"declared link {quoted(name)}, the {end} of joint {_named(joint)}"


_NOT_OF_FIXED = ("axis", "limit", "dynamics", "mimic", "safety_controller", "calibration")


def _fixed_joints(robot: ET.Element) -> Iterator[str]:
    """Remove from fixed joints all that only joints that move have."""
    for joint in _joints(robot):
        if joint.get("type") != "fixed":
            continue
        for tag in _NOT_OF_FIXED:
            for element in joint.findall(f"{{*}}{tag}"):
                _drop(joint, element)
                yield f"removed <{tag}> of fixed joint {_named(joint)}"


def _limits(robot: ET.Element) -> Iterator[str]:
    """Complete limits, and make joints continuous that have none."""
    for joint in _joints(robot):
        if joint.get("type") not in _MOVING:
            continue
        limit = joint.find("{*}limit")
        if limit is None:
            if joint.get("type") == "revolute":
                joint.set("type", "continuous")
                yield f"made joint {_named(joint)} continuous, as it is revolute without <limit>"
            continue
        for name in ("effort", "velocity"):
            if name not in limit.attrib:
                limit.set(name, UNLIMITED)
                yield f"set {name} of <limit> of joint {_named(joint)} to {UNLIMITED}, unlimited"


def _incomplete_elements(robot: ET.Element) -> Iterator[str]:
    """Remove elements of joints that lack their required attributes and so have no meaning."""
    required = {
        "dynamics": ("damping", "friction"),
        "safety_controller": ("k_velocity",),
        "calibration": ("rising", "falling", "reference_position"),
    }
    for joint in _joints(robot):
        for tag, names in required.items():
            for element in joint.findall(f"{{*}}{tag}"):
                if not any(name in element.attrib for name in names):
                    _drop(joint, element)
                    yield f"removed <{tag}> of joint {_named(joint)}, which has no {names[0]}"


def _materials(robot: ET.Element) -> Iterator[str]:
    """Name materials of visuals, which Pinocchio requires."""
    number = 0
    for link in _links(robot):
        for material in link.findall("{*}visual/{*}material"):
            if "name" not in material.attrib:
                number += 1
                material.set("name", f"material_{number}")
                yield f"named a material of link {quoted(link.get('name'))} 'material_{number}'"


_ZERO_INERTIA = {name: "0" for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}


def _inertias(robot: ET.Element) -> Iterator[str]:
    """Give frames an inertial of zero, as PyBullet takes 1 kg without, and complete products."""
    for link in _links(robot):
        where = f"link {quoted(link.get('name'))}"
        inertial = link.find("{*}inertial")
        if inertial is None:
            _weigh_nothing(link)
            yield f"gave {where} an inertial of zero mass"
            continue
        inertia = inertial.find("{*}inertia")
        if inertia is None and _is_zero(inertial.find("{*}mass")):
            _append(inertial, "inertia", dict(_ZERO_INERTIA), "\n      ").tail = "\n    "
            yield f"gave {where}, which has no mass, an inertia of zero"
        elif inertia is not None and all(name in inertia.attrib for name in ("ixx", "iyy", "izz")):
            missing = [name for name in ("ixy", "ixz", "iyz") if name not in inertia.attrib]
            for name in missing:
                inertia.set(name, "0")
            if missing:
                yield f"set {', '.join(missing)} of {where} to 0, where absent"


def _weigh_nothing(link: ET.Element) -> None:
    """Append an inertial of zero mass to a link."""
    inertial = _append(link, "inertial", {}, "\n    ")
    _append(inertial, "mass", {"value": "0"}, "\n      ")
    _append(inertial, "inertia", dict(_ZERO_INERTIA), "\n      ").tail = "\n    "
    inertial.tail = "\n  "


def _is_zero(mass: ET.Element | None) -> bool:
    try:
        return mass is not None and float(mass.get("value", "1")) == 0
    except ValueError:
        return False


_STEPS: tuple[Callable[[ET.Element], Iterator[str]], ...] = (
    _plain_tags,
    _robot_name,
    _joint_names,
    _undeclared_links,
    _fixed_joints,
    _limits,
    _incomplete_elements,
    _materials,
    _inertias,
)


def _possible_inertias(robot: ET.Element) -> dict[str, str]:
    """Make inertias isotropic that no rigid body has; return a sentence for each such link.

    The moment about the joint's axis, on which alone the motion in the plane depends, is kept.
    """
    tree = parse_tree(ET.tostring(robot, encoding="unicode"))
    made = {}
    for body in two_bodies(tree):
        for name, inertial in _parts(body, tree):
            moment = moment_about(body.joint.axis, inertial)
            if not _is_impossible(inertial) or moment <= _LEAST_MOMENT:
                continue
            element = next(link for link in _links(robot) if link.get("name") == name)
            matrix = element.find("{*}inertial/{*}inertia")
            assert matrix is not None
            matrix.attrib.update(_ZERO_INERTIA | dict.fromkeys(("ixx", "iyy", "izz"), repr(moment)))
            made[name] = (
                f"made the inertia of link {quoted(name)} that of a ball, {moment:.6g} kg m², as"
                " no rigid body has the moments it had; the one about the joint's axis is kept"
            )
    return made


def _parts(body: RigidBody, tree: Tree) -> Iterator[tuple[str, Inertial]]:
    """Yield the links of a body that have mass, with their inertias in the body's frame."""
    for name, frame in body.frames.items():
        inertial = tree.links[name].inertial
        if inertial is not None and inertial.mass > 0:
            yield name, Inertial(inertial.mass, inertial.inertia, frame @ inertial.pose)


def _is_impossible(inertial: Inertial) -> bool:
    moments = principal_moments(inertial.inertia)
    return moments[0] < _LEAST_MOMENT or violates_triangle(moments)


def _remaining(tree: Tree) -> Iterator[str]:
    """Yield a note for each link that engines in space refuse, and that no repair can change."""
    for body in two_bodies(tree):
        for name, inertial in _parts(body, tree):
            if _is_impossible(inertial):
                yield (
                    f"Link {quoted(name)} has no inertia about the joint's axis; MuJoCo and Drake"
                    " refuse such a point mass, and a repair would change the motion."
                )
