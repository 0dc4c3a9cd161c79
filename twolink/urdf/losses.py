"""The losses of a conversion: properties of a URDF that the file made from it does not have.

Both files are read for properties that a comparison of motions does not show: names, frames, limits
and geometry.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from twolink.text import quoted
from twolink.urdf.reading import UNLIMITED, listed, local, parse_tree, parse_xml

_DIGITS = 1e-5
"""The relative difference of two numbers that are equal: MuJoCo's writer keeps six digits."""

_UNITS = {
    "limits": "rad",
    "effort limit": "N m",
    "velocity limit": "rad/s",
    "damping": "N m s/rad",
    "friction": "N m",
}

# The elements in which the other fields of `Holdings` are, or that are checked by the motion.
_READ = {
    "robot": ("link", "joint", "material"),
    "link": ("inertial", "visual", "collision"),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
}

Numbers = tuple[float, ...]
Properties = dict[str, Numbers]


@dataclass(frozen=True)
class Holdings:
    """The properties of a file: its name, and those of its frames (links among them) and joints.

    `moving` has the properties of the joints that move, by their names in `_UNITS`; one that the
    file lacks has no numbers. `visual` and `collision` are numbers of shapes, `others` the tags of
    further elements.
    """

    name: str | None
    frames: tuple[str, ...]
    joints: tuple[str, ...]
    moving: dict[str, Properties]
    visual: int
    collision: int
    others: tuple[str, ...] = ()


def losses(text: str, converted: str, to: str) -> tuple[str, ...]:
    """Return a sentence for each thing in URDF text that the text made from it does not have.

    `to` is the format, "mjcf" or "sdf".
    """
    before, after = _of_urdf(text), _READERS[to](ET.fromstring(converted))
    return tuple(f"{lost} not in the {to.upper()}." for lost in _lost(before, after))


def _lost(before: Holdings, after: Holdings) -> Iterator[str]:
    """Yield each loss as a subject with its verb."""
    if before.name != after.name:
        yield f"The name {quoted(before.name)} of the robot is"
    yield from _gone("Link", before.frames, after.frames)
    fixed = (name for name in before.joints if name not in before.moving)
    yield from _gone("Fixed joint", fixed, after.joints)
    for joint, properties in before.moving.items():
        for what, numbers in properties.items():
            if not _equal(numbers, after.moving[joint][what]):
                values = " to ".join(f"{number:g}" for number in numbers)
                verb = "is" if len(numbers) == 1 else "are"
                yield f"The {what} of joint {quoted(joint)}, {values} {_UNITS[what]}, {verb}"
    for what, count in (
        ("visual", before.visual - after.visual),
        ("collision", before.collision - after.collision),
    ):
        if count > 0:
            yield f"{count} {what} {'shape is' if count == 1 else 'shapes are'}"
    yield from _gone("Element", before.others, after.others)


def _gone(what: str, before: Iterable[str], after: Iterable[str]) -> Iterator[str]:
    """Yield the names that are not there afterwards, if there are any."""
    gone = [name for name in before if name not in after]
    if gone:
        yield f"{what} {listed(gone)} is" if len(gone) == 1 else f"{what}s {listed(gone)} are"


def _equal(before: Numbers, after: Numbers) -> bool:
    """Return whether numbers are kept; where there were none, any are."""
    pairs = zip(before, after, strict=False)
    kept = len(before) == len(after) and all(math.isclose(a, b, rel_tol=_DIGITS) for a, b in pairs)
    return kept or not before


def _of_urdf(text: str) -> Holdings:
    robot, tree = parse_xml(text), parse_tree(text)
    moving = {
        joint.name: _properties(
            joint.limits, joint.effort, joint.velocity, joint.damping, joint.friction
        )
        for joint in tree.joints
        if joint.type != "fixed"
    }
    return Holdings(
        name=robot.get("name"),
        frames=tuple(tree.links),
        joints=tuple(joint.name for joint in tree.joints),
        moving=moving,
        visual=len(robot.findall("{*}link/{*}visual")),
        collision=len(robot.findall("{*}link/{*}collision")),
        others=tuple(dict.fromkeys(_others(robot))),
    )


def _others(robot: ET.Element) -> Iterator[str]:
    """Yield the tags of elements that are neither compared here nor by the motion."""
    for part in (robot, *robot.findall("{*}link"), *robot.findall("{*}joint")):
        known = _READ[local(part.tag)]
        yield from (tag for each in part if (tag := local(each.tag)) not in known)


def _properties(
    limits: Numbers | None,
    effort: float | None,
    velocity: float | None,
    damping: float,
    friction: float,
) -> Properties:
    """Return the properties of a joint, without those that have no effect."""
    unlimited = float(UNLIMITED)
    return {
        "limits": limits or (),
        "effort limit": () if effort is None or effort >= unlimited else (effort,),
        "velocity limit": () if velocity is None or velocity >= unlimited else (velocity,),
        "damping": (damping,) if damping else (),
        "friction": (friction,) if friction else (),
    }


def _of_mjcf(model: ET.Element) -> Holdings:
    """Return what MJCF has that MuJoCo's writer made of a URDF: its angles are in rad."""
    # <equality> has elements <joint> of its own, without a name.
    joints = {each.attrib["name"]: each for each in model.iterfind("worldbody//joint")}
    shapes = [geom.get("contype") == "0" for geom in model.iter("geom")]
    return Holdings(
        name=model.get("model"),
        frames=tuple(each.get("name", "") for tag in ("body", "site") for each in model.iter(tag)),
        joints=tuple(joints),
        moving={name: _of_mjcf_joint(joint) for name, joint in joints.items()},
        visual=shapes.count(True),
        collision=shapes.count(False),
        # MuJoCo's own extension of URDF, which its reader has applied.
        others=("mujoco",),
    )


def _of_mjcf_joint(joint: ET.Element) -> Properties:
    limits = () if joint.get("limited") == "false" else _numbers(joint.get("range"))
    effort = _numbers(joint.get("actuatorfrcrange"))
    return _properties(
        limits,
        effort[1] if effort else None,
        None,
        float(joint.get("damping", 0)),
        float(joint.get("frictionloss", 0)),
    )


def _of_sdf(root: ET.Element) -> Holdings:
    (model,) = root.iter("model")
    joints = {each.attrib["name"]: each for each in model.iter("joint")}
    return Holdings(
        name=model.get("name"),
        frames=tuple(each.attrib["name"] for tag in ("link", "frame") for each in model.iter(tag)),
        joints=tuple(joints),
        moving={name: _of_sdf_joint(joint) for name, joint in joints.items()},
        visual=len(list(model.iter("visual"))),
        collision=len(list(model.iter("collision"))),
    )


def _of_sdf_joint(joint: ET.Element) -> Properties:
    lower, upper, effort, velocity, damping, friction = (
        _numbers(joint.findtext(f"axis/{path}"))
        for path in (
            "limit/lower",
            "limit/upper",
            "limit/effort",
            "limit/velocity",
            "dynamics/damping",
            "dynamics/friction",
        )
    )
    return _properties(
        (*lower, *upper),
        effort[0] if effort else None,
        velocity[0] if velocity else None,
        *damping,
        *friction,
    )


def _numbers(text: str | None) -> Numbers:
    return tuple(map(float, (text or "").split()))


_READERS = {"mjcf": _of_mjcf, "sdf": _of_sdf}
