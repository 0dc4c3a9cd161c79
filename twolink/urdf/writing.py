"""From the parameters of a chain to a URDF that every engine reads alike.

The link frames have x along the link and turn about y, and the world has z up. So the derivation's
(along, across) are a link frame's (x, −z), and its joint angles are the file's: θ1 = q1,
θ2 = q2 − q1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeVar

from twolink.chain_checks import check_signs
from twolink.inputs import (
    as_number,
    as_pair,
    as_real,
    as_tuple,
    as_word,
    check_instance,
    nearest_float,
    refuse,
)
from twolink.urdf.link_parameters import LinkParameters, link_without_inertia
from twolink.urdf.reading import UNLIMITED, Limits

_Kind = TypeVar("_Kind")

_COMMENT = """\
  <!--
    A planar two-link chain. World: x right, y into the page, z up. A joint turns about y, from x
    towards -z, which is down: the derivation's positive sense. Lengths in m, masses in
    kg, inertias in kg m2.

    Motion in the plane depends on iyy alone, which is the inertia about the joint's axis. ixx, the
    inertia about the link's own axis, is that of a rod whose radius is 1/50 of its length. A thin
    bar has none, but MuJoCo and Drake refuse zero.

    A, B, C1, C2 and D are frames that weigh nothing. They say so because PyBullet takes a link
    without <inertial> to weigh 1 kg.
  -->"""

_SLENDERNESS = 50

_NOTHING = """\
    <inertial>
      <mass value="0"/>
      <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>
    </inertial>"""

# The reader doubles distances, and the writer takes six times an inertia.
_LARGEST = 1e307

_COLOURS = {"link1": "0.00 0.45 0.70 1", "link2": "0.90 0.62 0.00 1"}


@dataclass(frozen=True)
class JointProperties:
    """Damping (N m s/rad), friction (N m) and limits (rad) of a joint that turns."""

    damping: float = 0.0
    friction: float = 0.0
    limits: Limits | None = None

    def __post_init__(self) -> None:
        """Require resistance that does not drive, and limits with room between them."""
        for name in ("damping", "friction"):
            given = getattr(self, name)
            value = nearest_float(as_number(name, given))
            if not 0 <= value < math.inf:
                refuse(name, given, "zero or a positive number")
            object.__setattr__(self, name, value)
        if self.limits is not None:
            wanted = "a lower angle below an upper one, in rad"
            lower, upper = map(nearest_float, as_pair("limits", self.limits, wanted))
            if not -math.inf < lower < upper < math.inf:
                refuse("limits", self.limits, wanted)
            object.__setattr__(self, "limits", (lower, upper))


_FREE = (JointProperties(), JointProperties())


def write_planar_urdf(
    links: tuple[LinkParameters, LinkParameters],
    *,
    name: str = "twolink",
    joints: tuple[JointProperties, JointProperties] = _FREE,
) -> str:
    """Return a URDF of the chain with the given links (kg, m, kg m²), from the base outward.

    A joint with limits is revolute, any other continuous. Reading the text back gives the same
    numbers to the last bit. Raises `ParameterError` for parameters that no chain has, such as a
    length of link 1 that is not positive, or a name that is not printable text.
    """
    # It imports the network library, which commands that write no URDF do not need.
    from xml.sax.saxutils import quoteattr

    if not as_word("name", name) or not name.isprintable():
        refuse("name", name, "printable text")
    first, second = _checked(links)
    joint1, joint2 = _both("joints", joints, JointProperties)
    radius1 = first.length / _SLENDERNESS
    radius2 = second.length / _SLENDERNESS or radius1
    at_base, at_elbow, at_end = ((x, 0.0) for x in (0.0, first.length, second.length))
    parts = [
        '<?xml version="1.0" encoding="utf-8"?>',
        f"<robot name={quoteattr(name)}>",
        _COMMENT,
        *(_material(link, colour) for link, colour in _COLOURS.items()),
        _marker("ground"),
        _link("link1", first, radius1),
        _link("link2", second, radius2),
        _hinge("joint1", "ground", "link1", at_base, joint1),
        _hinge("joint2", "link1", "link2", at_elbow, joint2),
    ]
    markers = (
        ("A", "ground", at_base),
        ("B", "link1", at_elbow),
        ("C1", "link1", first.centre),
        ("C2", "link2", second.centre),
        ("D", "link2", at_end),
    )
    for marker, parent, place in markers:
        parts += [_marker(marker), _joint(f"{marker}_frame", "fixed", parent, marker, place)]
    return "\n".join([*parts, "</robot>", ""])


def _both(name: str, value: Any, kind: type[_Kind]) -> tuple[_Kind, _Kind]:
    """Return two objects of a class, or raise `ParameterError`."""
    wanted = f"a pair of {kind.__name__}"
    entries = as_tuple(name, value, wanted)
    if len(entries) != 2:
        refuse(name, value, wanted)
    for k, entry in enumerate(entries):
        check_instance(f"{name}[{k}]", entry, kind)
    return entries[0], entries[1]


def _checked(links: Any) -> tuple[LinkParameters, LinkParameters]:
    """Return links in float64 that the reader accepts, or raise `ParameterError`."""
    first, second = map(_within_float64, (1, 2), _both("links", links, LinkParameters))
    check_signs(
        (first.mass, second.mass), (first.length, second.length), (first.inertia, second.inertia)
    )
    link = link_without_inertia((first, second))
    if link is not None:
        refuse(f"link {link}: inertia about {'AB'[link - 1]}", 0.0, "a positive number of kg m²")
    return first, second


def _within_float64(number: int, link: LinkParameters) -> LinkParameters:
    """Return a link, by its number, with finite numbers that the reader accepts."""
    where = f"link {number}"
    centre = f"{where}: centre"
    along, across = as_pair(centre, link.centre, "a pair (along, across) in m")
    return LinkParameters(
        mass=_within_range(f"{where}: mass", link.mass),
        length=_within_range(f"{where}: length", link.length),
        centre=(_within_range(f"{centre}[0]", along), _within_range(f"{centre}[1]", across)),
        inertia=_within_range(f"{where}: inertia", link.inertia),
    )


def _within_range(name: str, value: Any) -> float:
    number = as_real(name, value)
    if abs(number) > _LARGEST:
        refuse(name, value, f"a number of at most {_LARGEST:.0e} in size")
    return number


def _number(value: float) -> str:
    """Return the shortest text that reads back as the same number, and zero without a sign."""
    return repr(value + 0.0)


def _xyz(place: tuple[float, float]) -> str:
    """Return the coordinates, in a link's frame, of a point along and across the link (m)."""
    along, across = place
    return f"{_number(along)} 0 {_number(-across)}"


def _material(link: str, colour: str) -> str:
    return f"""\
  <material name="{link}_colour">
    <color rgba="{colour}"/>
  </material>"""


def _marker(name: str) -> str:
    return f"""\
  <link name="{name}">
{_NOTHING}
  </link>"""


def _hinge(
    name: str, parent: str, child: str, place: tuple[float, float], properties: JointProperties
) -> str:
    """Return a joint that turns about y, with its properties."""
    inside = '\n    <axis xyz="0 1 0"/>'
    if properties.limits is not None:
        lower, upper = map(_number, properties.limits)
        inside += (
            f'\n    <limit lower="{lower}" upper="{upper}"'
            f' effort="{UNLIMITED}" velocity="{UNLIMITED}"/>'
        )
    if properties.damping or properties.friction:
        damping, friction = _number(properties.damping), _number(properties.friction)
        inside += f'\n    <dynamics damping="{damping}" friction="{friction}"/>'
    kind = "continuous" if properties.limits is None else "revolute"
    return _joint(name, kind, parent, child, place, inside)


def _joint(
    name: str,
    kind: str,
    parent: str,
    child: str,
    place: tuple[float, float],
    inside: str = "",
) -> str:
    return f"""\
  <joint name="{name}" type="{kind}">
    <parent link="{parent}"/>
    <child link="{child}"/>
    <origin xyz="{_xyz(place)}"/>{inside}
  </joint>"""


def _link(name: str, link: LinkParameters, radius: float) -> str:
    inertia = _number(link.inertia)
    # The ratio of a rod's axial inertia m r²/2 to its transverse m L²/12.
    axial = _number(link.inertia * 6 / _SLENDERNESS**2)
    bar, ends = _bar(link.length, radius)
    solids = [bar, *ends] if link.length else ends[:1]
    shapes = [
        _shape("visual", solid, f'\n      <material name="{name}_colour"/>') for solid in solids
    ]
    shapes.append(_shape("collision", solids[0]))
    drawn = "\n".join(shapes)
    return f"""\
  <link name="{name}">
    <inertial>
      <origin xyz="{_xyz(link.centre)}"/>
      <mass value="{_number(link.mass)}"/>
      <inertia ixx="{axial}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/>
    </inertial>
{drawn}
  </link>"""


def _bar(length: float, radius: float) -> tuple[str, list[str]]:
    """Return a bar along x, and the balls that round its two ends: origin and geometry."""
    # A URDF's cylinder lies along z.
    bar = f"""\
      <origin xyz="{_xyz((length / 2, 0.0))}" rpy="0 {math.pi / 2!r} 0"/>
      <geometry><cylinder radius="{_number(radius)}" length="{_number(length)}"/></geometry>"""
    balls = [
        f"""\
      <origin xyz="{_xyz((place, 0.0))}"/>
      <geometry><sphere radius="{_number(radius)}"/></geometry>"""
        for place in (0.0, length)
    ]
    return bar, balls


def _shape(tag: str, solid: str, material: str = "") -> str:
    return f"""\
    <{tag}>
{solid}{material}
    </{tag}>"""
