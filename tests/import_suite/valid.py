"""Valid files of the import suite: one feature each, with the parameters that it was built from."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.import_suite.building import (
    HORIZONTAL,
    VERTICAL,
    Arm,
    Bar,
    ball,
    inertial,
    joint,
    robot,
    rpy,
)


@dataclass(frozen=True)
class Valid:
    """A file's text or bytes, its flags, its one feature, and the parameters to be read."""

    flags: tuple[str, ...]
    comment: str
    content: str | bytes
    expect: dict[str, Any]


ARM = Arm()
# Nothing in it is symmetric, so that a lost product, sign or rotation shows.
GENERAL = Arm(
    bars=(Bar(1.3, 0.9, (0.4, 0.15), 0.11), Bar(0.7, 0.6, (0.35, -0.1), 0.05)),
    offset=(0.4, -0.9),
)
TURNED = (rpy(0.3, -0.5, 1.1), rpy(-0.7, 0.4, 0.2))


def _plain(arm: Arm, **parts: str) -> str:
    return robot(*{**arm.parts(), **parts}.values())


def _of(arm: Arm, *flags: str, comment: str, gravity: float = 9.81, **expected: Any) -> Valid:
    return Valid(flags, comment, _plain(arm), arm.expected(gravity, **expected))


def _turned_base(lean: float) -> Arm:
    """Return the general arm on a base that leans out of the vertical plane."""
    axis = np.array([0.0, math.cos(lean), math.sin(lean)])
    down = np.array([0.0, math.sin(lean), -math.cos(lean)])
    return replace(GENERAL, plane=np.array([[1.0, 0.0, 0.0], down, axis]))


def _yawed(yaw: float) -> Arm:
    return replace(GENERAL, plane=VERTICAL @ rpy(0, 0, yaw).T, frames=(rpy(0, 0, yaw),) * 2)


def _half_bars() -> Valid:
    """The second bar in two halves, the outer one fixed to the inner."""
    half = np.diag([1e-4, 0.5 * 0.25 / 12, 0.5 * 0.25 / 12])
    parts = ARM.parts() | {
        "lower": f'<link name="lower">{inertial(0.5, (0.25, 0, 0), None, half)}</link>',
        "outer": f'<link name="outer">{inertial(0.5, (0.25, 0, 0), None, half)}</link>',
        "weld": joint("weld", "fixed", ("lower", "outer"), (0.5, 0, 0)),
        "end": joint("end", "fixed", ("outer", "D"), (0.5, 0, 0)),
    }
    comment = "two half bars joined by a fixed joint are one bar"
    return Valid(("LumpedOffset",), comment, robot(*parts.values()), ARM.expected())


def _lumped(bars: tuple[Bar, Bar], *loads: tuple[int, float, tuple[float, float], float]) -> Any:
    """Return bars with balls added: link, mass, place along and across, and moment."""
    found = list(bars)
    for link, mass, place, moment in loads:
        bar = found[link]
        total = bar.mass + mass
        centre = np.array([bar.mass * a + mass * b for a, b in zip(bar.centre, place, strict=True)])
        centre = centre / total
        inertia = bar.inertia + moment
        for m, c in ((bar.mass, bar.centre), (mass, place)):
            inertia += m * float(np.sum((np.array(c) - centre) ** 2))
        found[link] = Bar(total, bar.length, (float(centre[0]), float(centre[1])), inertia)
    return found[0], found[1]


def _with_loads(flags: tuple[str, ...], comment: str, turned: bool, several: bool) -> Valid:
    """Return the arm with balls fixed to its links; across is −z of the link frames."""
    loads = [(1, 0.4, (0.8, -0.3), 0.02)]
    frame = rpy(0.3, -0.5, 1.1) if turned else None
    parts = ARM.parts()
    # The ball's centre is the origin of its link, wherever that link's frame is turned.
    parts["tool"] = f'<link name="tool">{ball(0.4, (0, 0, 0), 0.02)}</link>'
    parts["mount"] = joint("mount", "fixed", ("lower", "tool"), (0.8, 0.2, 0.3), frame)
    if several:
        loads += [(0, 0.2, (0.3, 0.1), 0.01), (1, 0.1, (1.0, -0.3), 0.005)]
        parts["motor"] = f'<link name="motor">{ball(0.2, (0.1, 0, 0), 0.01)}</link>'
        parts["bracket"] = joint("bracket", "fixed", ("upper", "motor"), (0.2, 0, -0.1))
        inside = (0.2, 0, 0) if frame is None else frame.T @ (0.2, 0, 0)
        parts["gripper"] = f'<link name="gripper">{ball(0.1, (0, 0, 0), 0.005)}</link>'
        parts["wrist"] = joint("wrist", "fixed", ("tool", "gripper"), inside)
    lumped = replace(ARM, bars=_lumped(ARM.bars, *loads))
    return Valid(flags, comment, robot(*parts.values()), lumped.expected())


def _rotated_box() -> Valid:
    """A slender rod across the link, fixed by a rotation about the joint's axis and another."""
    rod = np.diag([1e-3, 0.02, 0.02])
    frame = rpy(0, -math.pi / 2, 0) @ rpy(math.pi / 2, 0, 0)
    parts = ARM.parts() | {
        "cross": f'<link name="cross">{inertial(0.4, (0.3, 0, 0), None, rod)}</link>',
        "weld": joint("weld", "fixed", ("lower", "cross"), (0.5, 0, 0), frame),
    }
    place = frame @ (0.3, 0, 0)
    load = (1, 0.4, (0.5 + float(place[0]), -float(place[2])), float((frame @ rod @ frame.T)[1, 1]))
    lumped = replace(ARM, bars=_lumped(ARM.bars, load))
    comment = "a fixed link is turned, and its inertia is that of a rod"
    return Valid(("LumpedRotated",), comment, robot(*parts.values()), lumped.expected())


def _rod_along_axis() -> Valid:
    """A slender rod that a rotation of its joint lays along the axis of the elbow."""
    rod = np.diag([1e-3, 0.02, 0.02])
    frame = rpy(0, 0, math.pi / 2)
    parts = ARM.parts() | {
        "pin": f'<link name="pin">{inertial(0.4, (0, 0, 0), None, rod)}</link>',
        "weld": joint("weld", "fixed", ("lower", "pin"), (0.5, 0, 0.2), frame),
    }
    load = (1, 0.4, (0.5, -0.2), float((frame @ rod @ frame.T)[1, 1]))
    lumped = replace(ARM, bars=_lumped(ARM.bars, load))
    comment = "a fixed rod is turned along the joint's axis, about which its moment is least"
    return Valid(("LumpedRotated",), comment, robot(*parts.values()), lumped.expected())


def _before_the_joint() -> Valid:
    """The elbow hangs on a link that is fixed to the upper one."""
    parts = ARM.parts()
    parts["sleeve"] = f'<link name="sleeve">{ball(0.5, (0, 0, 0), 0.01)}</link>'
    parts["glue"] = joint("glue", "fixed", ("upper", "sleeve"), (0.6, 0, 0), rpy(0, 0, 0.5))
    elbow = rpy(0, 0, 0.5).T @ (0.4, 0, 0)
    parts["elbow"] = joint(
        "elbow", "continuous", ("sleeve", "lower"), elbow, rpy(0, 0, -0.5), '<axis xyz="0 1 0"/>'
    )
    lumped = replace(ARM, bars=_lumped(ARM.bars, (0, 0.5, (0.6, 0.0), 0.01)))
    comment = "the elbow hangs on a link that is fixed to the first moving one"
    return Valid(
        ("LumpedOffset", "LumpedRotated"), comment, robot(*parts.values()), lumped.expected()
    )


def _behind_the_joint() -> Valid:
    """The moving link weighs nothing, and carries the bar by a fixed joint."""
    parts = ARM.parts()
    bar = parts["lower"].replace('name="lower"', 'name="bar"')
    parts |= {
        "lower": '<link name="lower"/>',
        "bar": bar,
        "weld": joint("weld", "fixed", ("lower", "bar"), (0, 0, 0)),
    }
    comment = "the second moving link has no inertial, and a fixed one has it"
    return Valid(("MasslessFrame",), comment, robot(*parts.values()), ARM.expected())


def _between_frames() -> Valid:
    """A joint between two frames of the links, each posed and turned."""
    seat, plug = rpy(0.4, 0, 0.2), rpy(0, 0.6, -0.3)
    parts = ARM.parts()
    parts["seat"] = '<link name="seat"/>'
    parts["to_seat"] = joint("to_seat", "fixed", ("upper", "seat"), (1, 0, 0), seat)
    parts["plug"] = '<link name="plug"/>'
    parts["elbow"] = joint(
        "elbow",
        "continuous",
        ("seat", "plug"),
        (0, 0, 0),
        seat.T @ plug,
        f'<axis xyz="{" ".join(repr(float(x)) for x in plug.T @ (0, 1, 0))}"/>',
    )
    parts["to_lower"] = joint("to_lower", "fixed", ("plug", "lower"), (0, 0, 0), plug.T)
    comment = "the elbow joins a frame of one link to a frame of the other"
    return Valid(("MasslessFrame",), comment, robot(*parts.values()), ARM.expected())


def _ground() -> Valid:
    """Links with mass before the first joint, which do not move."""
    parts = ARM.parts()
    parts["base"] = f'<link name="base">{ball(5.0, (0, 0, 0.1), 0.3)}</link>'
    parts["pedestal"] = f'<link name="pedestal">{ball(2.0, (0, 0, 0), 0.1)}</link>'
    parts["bolts"] = joint("bolts", "fixed", ("base", "pedestal"), (0.1, 0.2, 0.3), rpy(0, 0, 0.5))
    place = rpy(0, 0, 0.5).T @ (-0.1, -0.2, -0.3)
    parts["shoulder"] = joint(
        "shoulder",
        "continuous",
        ("pedestal", "upper"),
        place,
        rpy(0, 0, -0.5),
        '<axis xyz="0 1 0"/>',
    )
    comment = "links with mass stand before the first joint"
    return Valid(("LumpedOffset",), comment, robot(*parts.values()), ARM.expected())


def _scaled(size: float, comment: str) -> Valid:
    bars = tuple(
        Bar(
            bar.mass * size**3,
            bar.length * size,
            (bar.centre[0] * size, bar.centre[1] * size),
            bar.inertia * size**5,
        )
        for bar in GENERAL.bars
    )
    return _of(replace(GENERAL, bars=(bars[0], bars[1])), "Scale", comment=comment)


def _effects() -> Valid:
    inside = {
        "shoulder": '<dynamics damping="0.3" friction="0.2"/>',
        "elbow": '<dynamics damping="0.1"/>',
    }
    return _of(
        replace(ARM, inside=inside),
        "DampingDropped",
        "FrictionDropped",
        comment="joints have damping and friction",
        damping=[0.3, 0.1],
        friction=[0.2, 0.0],
    )


def _limited() -> Valid:
    limit = '<limit lower="-0.5" upper="1.25" effort="7" velocity="3"/>'
    arm = replace(ARM, kinds=("revolute", "continuous"), inside={"shoulder": limit})
    return _of(arm, "Limits", comment="one joint has limits", limits=[[-0.5, 1.25], None])


def _decorated() -> Valid:
    box = '<geometry><box size="1 0.05 0.05"/></geometry>'
    material = '<material name="blue"><color rgba="0 0 1 1"/></material>'
    shape = f'<visual><origin xyz="0.5 0 0"/>{box}{material}</visual><collision>{box}</collision>'
    more = {
        "transmission": '<transmission name="t"><type>transmission_interface/SimpleTransmission'
        '</type><joint name="elbow"><hardwareInterface>EffortJointInterface</hardwareInterface>'
        '</joint><actuator name="a"><mechanicalReduction>50</mechanicalReduction></actuator>'
        "</transmission>",
        "gazebo": '<gazebo reference="lower"><mu1>0.2</mu1></gazebo>',
        "comment": "<!-- a comment with <link name='x'/> and ${xacro} -->",
    }
    text = _plain(replace(ARM, inside={"upper": shape, "lower": shape}), **more)
    comment = "visuals, collisions, a transmission, Gazebo's tags and comments"
    return Valid(("Decoration",), comment, text, ARM.expected())


def _spelled() -> Valid:
    text = _plain(ARM).replace('xyz="1 0 0"', 'xyz="  +1.  0e0 .0 "').replace('"1"', '"1.E0"')
    return Valid(("Numbers",), "numbers with signs, exponents and spaces", text, ARM.expected())


def _broken_lines() -> Valid:
    text = _plain(ARM).replace('xyz="1 0 0"', 'xyz="1\n 0\t0"')
    comment = "a vector goes over two lines, which XML reads as spaces"
    return Valid(("Whitespace",), comment, text, ARM.expected())


def _default_axis() -> Valid:
    """The joints turn about x of the link frames, which is the axis where none is given."""
    frame = rpy(0, 0, math.pi / 2)
    text = _plain(replace(ARM, frames=(frame, frame)))
    start = text.index("<axis")
    axis = text[start : text.index("/>", start) + 2]
    assert text.count(axis) == 2
    comment = "joints without <axis> turn about x"
    return Valid(("DefaultAxis",), comment, text.replace(axis, ""), ARM.expected())


def _orders() -> Valid:
    parts = list(ARM.parts().values())
    comment = "joints stand before links, and the second before the first"
    return Valid(("Order",), comment, robot(*reversed(parts)), ARM.expected())


def _fixed_axis() -> Valid:
    text = _plain(
        ARM, end=joint("end", "fixed", ("lower", "D"), (1, 0, 0), None, '<axis xyz="0 0 0"/>')
    )
    return Valid(("FixedAxis",), "the axis of a fixed joint is zero", text, ARM.expected())


def _fixed_mimic() -> Valid:
    mimic = '<mimic joint="elbow"/>'
    text = _plain(ARM, end=joint("end", "fixed", ("lower", "D"), (1, 0, 0), None, mimic))
    return Valid(("Mimic",), "a fixed joint mimics another", text, ARM.expected())


def _encoded(content: bytes, comment: str) -> Valid:
    return Valid(("Encoding",), comment, content, ARM.expected())


def _zero_frames() -> Valid:
    nothing = ball(0.0, (0, 0, 0), 0.0)
    arm = replace(ARM, inside={"base": nothing, "D": nothing})
    return _of(arm, "MasslessFrame", comment="frames have an inertial of zero mass")


LATIN = '<?xml version="1.0" encoding="ISO-8859-1"?>\n<!-- Gehäuse -->\n'

VALID: dict[str, Callable[[], Valid]] = {
    "plain": lambda: _of(ARM, "Plain", comment="the plain arm: two uniform bars"),
    "general": lambda: _of(GENERAL, "Plain", comment="no symmetry, and bent at zero"),
    "revolute": lambda: _of(
        replace(ARM, kinds=("revolute", "revolute")), "Limits", comment="both joints revolute"
    ),
    "mixed-types": lambda: _of(
        replace(ARM, kinds=("revolute", "continuous")),
        "ContinuousNq2",
        comment="one joint revolute, one continuous",
    ),
    "order-of-elements": _orders,
    "negative-axis-first": lambda: _of(
        replace(GENERAL, sign=(-1, 1)), "NegativeAxis", comment="the first axis points backwards"
    ),
    "negative-axis-second": lambda: _of(
        replace(GENERAL, sign=(1, -1)), "NegativeAxis", comment="the second axis points backwards"
    ),
    "negative-axes": lambda: _of(
        replace(GENERAL, sign=(-1, -1)), "NegativeAxis", comment="both axes point backwards"
    ),
    "axis-not-unit": lambda: _of(
        replace(GENERAL, axis_length=3.0), "AxisLength", comment="axes are 3 long"
    ),
    "default-axis": _default_axis,
    "oblique-axes": lambda: _of(
        replace(GENERAL, frames=TURNED), "ObliqueAxis", comment="link frames turned, axes oblique"
    ),
    "base-placed": lambda: _of(
        replace(GENERAL, origin=(1.5, -2.0, 0.7)), "Base", comment="the first joint is off the root"
    ),
    "base-turned": lambda: _of(_yawed(0.7), "Base", comment="the plane is turned about gravity"),
    "oblique-gravity": lambda: _of(
        _turned_base(0.3),
        "ObliqueGravity",
        comment="gravity is out of the plane; its component acts",
        gravity=9.81 * math.cos(0.3),
    ),
    "horizontal": lambda: _of(
        Arm(plane=HORIZONTAL),
        "ObliqueGravity",
        comment="a horizontal arm: gravity is along the axes",
        gravity=0.0,
    ),
    "bent-at-zero": lambda: _of(
        replace(ARM, offset=(0.5, -1.1)), "Offset", comment="the arm is bent at joint angles zero"
    ),
    "hanging-at-zero": lambda: _of(
        replace(ARM, offset=(math.pi / 2, 0.0)), "Offset", comment="the arm hangs at zero"
    ),
    "centre-across": lambda: _of(
        replace(ARM, bars=(Bar(centre=(0.4, 0.2)), Bar(centre=(0.6, -0.3)))),
        "CentreAcross",
        comment="mass centres off the lines",
    ),
    "elbow-aside": lambda: _of(
        replace(GENERAL, aside=0.25), "Aside", comment="the links move in parallel planes"
    ),
    "inertial-rpy": lambda: _of(
        replace(GENERAL, turned=rpy(0.4, -0.3, 0.8)),
        "InertialRpy",
        comment="inertial frames turned",
    ),
    "products-of-inertia": lambda: _of(
        replace(GENERAL, frames=(rpy(0, 0.5, 0), rpy(0, -0.8, 0)), turned=rpy(0.6, 0, 0)),
        "ProductOfInertia",
        "InertialRpy",
        comment="inertias with products, in turned frames",
    ),
    "thin-rods": lambda: _of(
        replace(ARM, slender=True), "ThinRod", comment="rods without inertia about their own axis"
    ),
    "two-half-bars": _half_bars,
    "lumped-offset": lambda: _with_loads(
        ("LumpedOffset",), "a ball is fixed to the second link", turned=False, several=False
    ),
    "lumped-rotated": lambda: _with_loads(
        ("LumpedRotated",), "a ball is fixed in a turned frame", turned=True, several=False
    ),
    "lumped-several": lambda: _with_loads(
        ("LumpedOffset", "LumpedRotated"), "three balls are fixed", turned=True, several=True
    ),
    "lumped-rod-rotated": _rotated_box,
    "lumped-rod-along-axis": _rod_along_axis,
    "lumped-before-joint": _before_the_joint,
    "lumped-behind-joint": _behind_the_joint,
    "joint-between-frames": _between_frames,
    "ground-with-mass": _ground,
    "frames-of-zero-mass": _zero_frames,
    "millimetres": lambda: _scaled(1e-3, "an arm of a millimetre"),
    "kilometres": lambda: _scaled(1e3, "an arm of a kilometre"),
    "damping-and-friction": _effects,
    "limits": _limited,
    "decorated": _decorated,
    "number-formats": _spelled,
    "vector-over-two-lines": _broken_lines,
    "fixed-axis-zero": _fixed_axis,
    "fixed-joint-mimics": _fixed_mimic,
    "byte-order-mark": lambda: _encoded(
        b"\xef\xbb\xbf" + _plain(ARM).encode(), "UTF-8 with a byte order mark"
    ),
    "latin-1": lambda: _encoded(
        (LATIN + _plain(ARM)).encode("latin-1"), "ISO-8859-1, which the XML declaration names"
    ),
    "xml-namespace": lambda: Valid(
        ("Namespace",),
        "the robot is in an XML namespace",
        robot(*ARM.parts().values(), attributes=' xmlns="https://example.org/robot"'),
        ARM.expected(),
    ),
}
