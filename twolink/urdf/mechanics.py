"""The mechanics that a URDF states, number by number, to compare two files."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from typing import Any

from twolink.urdf.planar import PlanarUrdf

_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_ROUNDING = 1e-14

Numbers = tuple[Any, ...]


def mechanics_of(robot: ET.Element) -> dict[str, object]:
    """Return the masses, inertias, poses, axes, damping and friction in a <robot>.

    Links are under their names, and joints under "joint" and their position in the file, since a
    joint's name has no mechanics. Absent numbers are those of the standard; frames without mass are
    left out, as are axes and resistances of fixed joints. Text that is no number is kept as text.
    """
    found: dict[str, object] = {}
    for link in robot.findall("{*}link"):
        numbers = _of_link(link)
        if numbers[0] != 0 or any(number != 0 for number in numbers[1]):
            found[f"link {link.get('name')!r}"] = numbers
    for position, joint in enumerate(robot.findall("{*}joint"), start=1):
        found[f"joint number {position}"] = _of_joint(joint)
    return found


def _of_link(link: ET.Element) -> Numbers:
    inertial = link.find("{*}inertial")
    if inertial is None:
        return 0.0, (0.0,) * 6, _pose(link.find("{*}inertial/{*}origin"))
    inertia = inertial.find("{*}inertia")
    return (
        _number(inertial.find("{*}mass"), "value"),
        tuple(_number(inertia, name) for name in _INERTIA),
        _pose(inertial.find("{*}origin")),
    )


def _of_joint(joint: ET.Element) -> Numbers:
    kind = joint.get("type")
    kind = "hinge" if kind in ("revolute", "continuous") else kind
    ends = tuple(
        None if (end := joint.find(f"{{*}}{name}")) is None else end.get("link")
        for name in ("parent", "child")
    )
    placed = kind, ends, _pose(joint.find("{*}origin"))
    if kind == "fixed":
        return placed
    axis, dynamics = joint.find("{*}axis"), joint.find("{*}dynamics")
    mimics = joint.find("{*}mimic") is not None
    direction = (1.0, 0.0, 0.0) if axis is None else _numbers(axis.get("xyz"))
    resistance = _number(dynamics, "damping"), _number(dynamics, "friction")
    return (*placed, direction, resistance, mimics)


def _pose(origin: ET.Element | None) -> Numbers:
    if origin is None:
        return _numbers(None) + _numbers(None)
    return _numbers(origin.get("xyz")) + _numbers(origin.get("rpy"))


def _number(element: ET.Element | None, attribute: str) -> float | str:
    text = None if element is None else element.get(attribute)
    return 0.0 if text is None else _read(text)


def _numbers(text: str | None) -> Numbers:
    return (0.0, 0.0, 0.0) if text is None else tuple(_read(word) for word in text.split())


def _read(word: str) -> float | str:
    try:
        return float(word)
    except ValueError:
        return word


def difference(
    before: dict[str, object], after: dict[str, object], isotropic: frozenset[str]
) -> str:
    """Return the link or joint in which two mechanics differ, or an empty string.

    Of the links named in `isotropic` the inertia may differ; mass and pose may not.
    """
    free = {f"link {name!r}" for name in isotropic}
    for name in {**before, **after}:
        one, two = before.get(name), after.get(name)
        if name in free and isinstance(one, tuple) and isinstance(two, tuple):
            one, two = (one[0], one[2]), (two[0], two[2])
        if one != two:
            return name
    return ""


def same_motion(one: PlanarUrdf, two: PlanarUrdf) -> bool:
    """Return whether two planar readings have the same parameters, to 14 digits."""
    pairs = [(a, b, 1.0) for a, b in zip(one.joints.offset, two.joints.offset, strict=True)]
    for first, second in zip(one.links, two.links, strict=True):
        reach = math.hypot(first.length, *first.centre)
        pairs += [
            (first.mass, second.mass, 0.0),
            (first.length, second.length, 0.0),
            (first.centre[0], second.centre[0], reach),
            (first.centre[1], second.centre[1], reach),
            (first.inertia, second.inertia, 0.0),
        ]
    return one.joints.sign == two.joints.sign and all(
        math.isclose(a, b, rel_tol=_ROUNDING, abs_tol=_ROUNDING * size) for a, b, size in pairs
    )
