"""Elements and attributes of a URDF that are misspelt, given twice, or not read.

Each is refused or named in a note. A misspelt origin otherwise gives a chain that is wrong and
looks right, and of two inertias of a link not every program takes the same.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from typing import NamedTuple

from twolink.errors import UrdfError
from twolink.text import quoted
from twolink.urdf.reading import local


class _Kind(NamedTuple):
    """The names in a kind of element: the children and the attributes that are read.

    Of each of these children there is one at most, unless they `repeat`. `others` are the children
    that do not change the motion.
    """

    children: tuple[str, ...] = ()
    attributes: tuple[str, ...] = ()
    others: tuple[str, ...] = ()
    repeat: bool = False


_KINDS = {
    "robot": _Kind(
        ("link", "joint"),
        ("name", "version"),
        others=(
            "material", "transmission", "gazebo", "sensor", "ros2_control", "mujoco", "group",
            "group_state", "end_effector", "disable_collisions", "collision_filter_group",
            "self_collision_filter",
        ),
        repeat=True,
    ),
    "link": _Kind(
        ("inertial",),
        ("name", "type"),
        others=(
            "visual", "collision", "sensor", "contact", "self_collision_checking", "material",
            "audio_source",
        ),
    ),
    "inertial": _Kind(("origin", "mass", "inertia")),
    "joint": _Kind(
        ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
        ("name", "type"),
        others=("safety_controller", "calibration", "hardwareInterface", "acceleration"),
    ),
    "origin": _Kind(attributes=("xyz", "rpy", "quat_xyzw")),
    "mass": _Kind(attributes=("value",)),
    "inertia": _Kind(attributes=("ixx", "ixy", "ixz", "iyy", "iyz", "izz")),
    "parent": _Kind(attributes=("link",)),
    "child": _Kind(attributes=("link",)),
    "axis": _Kind(attributes=("xyz",)),
    "limit": _Kind(attributes=("lower", "upper", "effort", "velocity", "acceleration", "jerk")),
    "dynamics": _Kind(attributes=("damping", "friction")),
    "mimic": _Kind(attributes=("joint", "multiplier", "offset")),
}  # fmt: skip

# The values with which elements of extensions leave the motion as it is, by extension and element.
_WITHOUT_EFFECT = {
    "gazebo": {
        "springStiffness": ("0", "0.0"),
        "gravity": ("true", "1"),
        "turnGravityOff": ("false", "0"),
    },
    "transmission": {"rotor_inertia": ("0", "0.0")},
}

_MOST_NAMES = 8

# The likeness of two names, of at most 1, from which one is taken for a misspelling of the other.
_ALIKE = 0.82


@dataclass(frozen=True)
class _Place:
    """An element that is read, its kind, and the link or the joint that it belongs to."""

    element: ET.Element
    kind: _Kind
    owner: str

    @property
    def where(self) -> str:
        """The place in a sentence."""
        tag = local(self.element.tag)
        return self.owner if tag in ("link", "joint", "robot") else f"<{tag}> of {self.owner}"

    def unread_children(self) -> Iterator[ET.Element]:
        """Yield the elements in it that have no meaning here."""
        known = (*self.kind.children, *self.kind.others)
        yield from (each for each in _elements(self.element) if local(each.tag) not in known)

    def unread_attributes(self) -> Iterator[str]:
        """Yield the attributes that are not read."""
        yield from (name for name in self.element.attrib if local(name) not in self.kind.attributes)


def check_names(robot: ET.Element) -> None:
    """Raise `UrdfError` if an element or an attribute is given twice, or seems to be misspelt."""
    for place in _places(robot):
        tags = [local(each.tag) for each in _elements(place.element)]
        for tag in () if place.kind.repeat else place.kind.children:
            if tags.count(tag) > 1:
                raise UrdfError(f"{place.where} must have one <{tag}>; got {tags.count(tag)}")
        for each in place.unread_children():
            meant = _meant(each.tag, place.kind.children)
            # An element of a namespace is that of an extension.
            if meant and _space(each.tag) == _space(place.element.tag):
                raise UrdfError(f"{place.where} must have <{meant}>; got <{_shown(each.tag)}>")
        for name in place.unread_attributes():
            meant = _meant(name, place.kind.attributes)
            if meant:
                raise UrdfError(f"{place.where} must have {meant}; got {quoted(name)}")


def unread(robot: ET.Element) -> tuple[str, ...]:
    """Return a sentence on the elements and attributes that are not read, if there are any.

    Those that do not change the motion are left out.
    """
    found: dict[str, None] = {}
    for place in _places(robot):
        for each in place.unread_children():
            found[f"<{_shown(each.tag)}> of {place.where}"] = None
        for name in place.unread_attributes():
            found[f"{_shown(name)} of {place.where}"] = None
    for tag, without_effect in _WITHOUT_EFFECT.items():
        for each in (inner for outer in robot.iterfind(f"{{*}}{tag}") for inner in outer.iter()):
            value = (each.get("value") or each.text or "").strip()
            if value not in without_effect.get(local(each.tag), (value,)):
                found[f"<{_shown(each.tag)}> of <{tag}>"] = None
    if not found:
        return ()
    rest = [f"{len(found) - _MOST_NAMES} more"] if len(found) > _MOST_NAMES else []
    names = ", ".join([*list(found)[:_MOST_NAMES], *rest])
    return (f"The file has properties that are not read, and do not act: {names}.",)


def _places(robot: ET.Element) -> Iterator[_Place]:
    """Yield the elements that are read."""
    yield _Place(robot, _KINDS["robot"], "<robot>")
    for part in _elements(robot):
        if local(part.tag) in ("link", "joint"):
            owner = f"{local(part.tag)} {quoted(part.get('name'))}"
            yield from _within(part, owner)


def _within(element: ET.Element, owner: str) -> Iterator[_Place]:
    kind = _KINDS[local(element.tag)]
    yield _Place(element, kind, owner)
    for child in _elements(element):
        if local(child.tag) in kind.children:
            yield from _within(child, owner)


def _elements(parent: ET.Element) -> Iterator[ET.Element]:
    """Yield the elements in another one, without comments."""
    yield from (each for each in parent if isinstance(each.tag, str))


def _meant(name: str, known: tuple[str, ...]) -> str:
    """Return the known name of which one seems to be a misspelling, or an empty string."""
    found = get_close_matches(local(name).lower(), known, 1, _ALIKE)
    return found[0] if found else ""


def _space(tag: str) -> str:
    return tag.rpartition("}")[0]


def _shown(name: str) -> str:
    return quoted(local(name))[1:-1]
