"""Invalid files of the import suite: one fault each, with the words of the reason."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tests.import_suite.building import Arm, ball, joint, robot

ARM = Arm()
LIMIT = '<limit lower="-3" upper="3" effort="10" velocity="10"/>'


@dataclass(frozen=True)
class Invalid:
    """A file's text or bytes, its fault, words of the reason, and whether repair removes it."""

    flags: tuple[str, ...]
    comment: str
    content: str | bytes
    reason: tuple[str, ...]
    repairable: bool = False


def _file(**parts: str) -> str:
    return robot(*{**ARM.parts(), **parts}.values())


def _edited(old: str, new: str, count: int = 1) -> str:
    text = _file()
    assert old in text, old
    return text.replace(old, new, count)


def _moving(
    name: str, kind: str, ends: tuple[str, str], more: str = "", axis: str = "0 1 0"
) -> str:
    return joint(name, kind, ends, (1, 0, 0), None, f'<axis xyz="{axis}"/>{more}')


def _elbow(kind: str = "continuous", more: str = "", axis: str = "0 1 0") -> str:
    return _file(elbow=_moving("elbow", kind, ("upper", "lower"), more, axis))


def _of(
    content: str | bytes, *reason: str, flags: tuple[str, ...], comment: str, repair: bool = False
) -> Invalid:
    return Invalid(flags, comment, content, reason, repair)


def _structure(content: str, *reason: str, comment: str, repair: bool = False) -> Invalid:
    return _of(content, *reason, flags=("Structure",), comment=comment, repair=repair)


def _number(content: str, *reason: str, comment: str, repair: bool = False) -> Invalid:
    return _of(content, *reason, flags=("Numbers",), comment=comment, repair=repair)


def _edited_number(old: str, new: str, words: str, comment: str) -> Callable[[], Invalid]:
    """Return a sample that has a wrong number in place of a text."""
    return lambda: _number(_edited(old, new), words, comment=comment)


def _missing(content: str, attribute: str, *, comment: str) -> Invalid:
    return _number(content, f"{attribute} is missing", comment=comment, repair=True)


def _limit_without(attribute: str, *, others: str) -> Invalid:
    limit = f'<limit lower="-3" upper="3" {others}/>'
    comment = f"a limit without {attribute}"
    return _missing(_elbow("revolute", limit), f"limit {attribute}", comment=comment)


def _format(content: str | bytes, *reason: str, comment: str, repair: bool = False) -> Invalid:
    return _of(content, *reason, flags=("Format",), comment=comment, repair=repair)


MASS = '<mass value="1"/>'
THIRD = {
    "third": f'<link name="third">{ball(1.0, (0.5, 0, 0), 0.1)}</link>',
    "wrist": _moving("wrist", "continuous", ("lower", "third")),
}
BRANCH = {"elbow": _moving("elbow", "continuous", ("base", "lower"))}

INVALID: dict[str, Callable[[], Invalid]] = {
    "three-joints": lambda: _structure(_file(**THIRD), "exactly two joints", comment="three move"),
    "one-joint": lambda: _structure(
        _elbow("fixed"), "exactly two joints", "got 1", comment="one joint moves"
    ),
    "no-joint": lambda: _structure(
        _file().replace("continuous", "fixed"), "got 0", comment="no joint moves"
    ),
    "branches": lambda: _structure(
        _file(**BRANCH), "two branches", "'elbow'", comment="both joints hang on the base"
    ),
    "loop": lambda: _structure(
        _file(shoulder=_moving("shoulder", "continuous", ("D", "upper"))),
        "loop",
        comment="the first link hangs on the end",
    ),
    "two-roots": lambda: _structure(
        _file(stray='<link name="stray"/>'), "'stray'", "one tree", comment="a link hangs nowhere"
    ),
    "two-parents": lambda: _structure(
        _file(more=joint("more", "fixed", ("base", "lower"), (0, 0, 0))),
        "'lower'",
        "child of one joint",
        comment="a link is the child of two joints",
    ),
    "undeclared-parent": lambda: _structure(
        _file(base=""), "'base'", "not declared", comment="the root is not declared", repair=True
    ),
    "undeclared-child": lambda: _structure(
        _file(lower=""), "'lower'", "not declared", comment="a moving link is not declared"
    ),
    "undeclared-frame": lambda: _structure(
        _file(D=""), "'D'", "not declared", comment="a fixed frame is not declared", repair=True
    ),
    "two-links-of-one-name": lambda: _structure(
        _file(more='<link name="upper"/>'), "two links named 'upper'", comment="a name twice"
    ),
    "two-joints-of-one-name": lambda: _structure(
        _edited('name="end"', 'name="elbow"'),
        "two joints named 'elbow'",
        comment="a name twice",
        repair=True,
    ),
    "nameless-link": lambda: _structure(
        _edited('<link name="D">', "<link>"), "link number 4", comment="a link without a name"
    ),
    "nameless-joint": lambda: _structure(
        _edited('<joint name="end"', "<joint"),
        "joint number 3",
        comment="a joint without a name",
        repair=True,
    ),
    "nameless-robot": lambda: _structure(
        _edited(' name="arm"', ""), "<robot> must have a name", comment="no name", repair=True
    ),
    "prismatic": lambda: _structure(
        _elbow("prismatic", LIMIT), "'elbow'", "prismatic", comment="the elbow slides"
    ),
    "floating": lambda: _structure(_elbow("floating"), "floating", comment="the elbow floats"),
    "planar-joint": lambda: _structure(_elbow("planar"), "planar", comment="the elbow is planar"),
    "unknown-type": lambda: _structure(_elbow("hinge"), "'hinge'", comment="no type of URDF"),
    "mimic": lambda: _structure(
        _elbow(more='<mimic joint="shoulder"/>'), "mimics", comment="the elbow follows the shoulder"
    ),
    "crossed-axes": lambda: _structure(
        _elbow(axis="0 0 1"), "parallel", "1.57", comment="the axes are at a right angle"
    ),
    "skewed-axes": lambda: _structure(
        _elbow(axis="0 1 0.001"), "parallel", "0.001 rad", comment="the axes are nearly parallel"
    ),
    "coincident-axes": lambda: _structure(
        _edited('<origin xyz="1 0 0" rpy="0 0 0"/><axis', '<origin xyz="0 0.5 0"/><axis'),
        "must be apart",
        comment="both joints turn about one line",
    ),
    "zero-axis": lambda: _number(
        _elbow(axis="0 0 0"), "'elbow': axis", "got zero", comment="the axis has no direction"
    ),
    "massless-first-link": lambda: _number(
        _file(upper='<link name="upper"/>'), "'upper'", "mass", comment="link 1 weighs nothing"
    ),
    "massless-second-link": lambda: _number(
        _file(lower='<link name="lower"/>'), "'lower'", "mass", comment="link 2 weighs nothing"
    ),
    "negative-mass": lambda: _number(
        _edited(MASS, '<mass value="-1"/>'), "'upper': mass", "-1.0", comment="mass below zero"
    ),
    "negative-inertia": lambda: _of(
        _file(lower=f'<link name="lower">{ball(1.0, (0.5, 0, 0), -0.1)}</link>'),
        "'lower'",
        "-0.1",
        flags=("InvalidInertia",),
        comment="inertia below zero",
    ),
    "no-inertia": lambda: _of(
        _file(lower=f'<link name="lower">{ball(1.0, (0, 0, 0), 0.0)}</link>'),
        "'lower'",
        "must have an inertia",
        flags=("InvalidInertia",),
        comment="a point mass on the axis",
    ),
    "nan-mass": _edited_number(MASS, '<mass value="nan"/>', "'nan'", "NaN"),
    "infinite-mass": _edited_number(MASS, '<mass value="1e999"/>', "'1e999'", "beyond float64"),
    "decimal-comma": _edited_number(
        'xyz="0.5 0 0"', 'xyz="0,5 0 0"', "'0,5 0 0'", "a decimal comma"
    ),
    "two-coordinates": _edited_number('xyz="1 0 0"', 'xyz="1 0"', "'1 0'", "a vector of two"),
    "missing-mass": _edited_number(
        MASS, "", "'upper': mass is missing", "an inertial without mass"
    ),
    "missing-moment": _edited_number(
        "iyy=", "iww=", "inertia iyy is missing", "a moment is absent"
    ),
    "missing-product": lambda: _missing(
        _edited(' ixy="0"', ""), "inertia ixy", comment="a product is absent"
    ),
    "quaternion": _edited_number('rpy="0 0 0"', 'quat_xyzw="0 0 0 1"', "quat_xyzw", "a quaternion"),
    "missing-effort": lambda: _limit_without("effort", others='velocity="1"'),
    "missing-velocity": lambda: _limit_without("velocity", others='effort="1"'),
    "revolute-without-limit": lambda: _number(
        _elbow("revolute"), "'elbow'", "<limit>", comment="revolute without <limit>", repair=True
    ),
    "limit-of-words": lambda: _number(
        _elbow("revolute", '<limit lower="-pi" upper="pi" effort="1" velocity="1"/>'),
        "'-pi'",
        comment="a limit in words",
    ),
    "xacro-expression": lambda: _format(
        _edited(MASS, '<mass value="${mass}"/>'), "xacro", "${mass}", comment="an expression"
    ),
    "xacro-macro": lambda: _format(
        _file(more='<xacro:gripper parent="D"/>'), "xacro", comment="a macro, and no namespace"
    ),
    "xacro-namespace": lambda: _format(
        robot(
            *ARM.parts().values(),
            '<xacro:property name="m" value="1"/>',
            attributes=' xmlns:xacro="http://www.ros.org/wiki/xacro"',
        ),
        "xacro",
        "property",
        comment="a property in xacro's namespace",
    ),
    "sdf": lambda: _format(
        '<sdf version="1.9"><model name="arm"><link name="upper"/></model></sdf>\n',
        "SDF",
        comment="SDF",
    ),
    "mjcf": lambda: _format(
        '<mujoco model="arm"><worldbody><body name="upper"/></worldbody></mujoco>\n',
        "MJCF",
        comment="MJCF",
    ),
    "web-page": lambda: _format("<html><body>404</body></html>\n", "web page", comment="HTML"),
    "doctype": lambda: _format(
        f'<!DOCTYPE robot [<!ENTITY m "1">]>\n{_file()}', "DOCTYPE", comment="entities"
    ),
    "truncated": lambda: _format(_file()[:-60], "well-formed", comment="the end is missing"),
    "empty": lambda: _format("", "empty", comment="no text"),
    "utf-16": lambda: _format(
        _file().encode("utf-16-le").join([b"\xff\xfe", b""]),
        "UTF-16",
        comment="UTF-16",
        repair=True,
    ),
    "nul-byte": lambda: _format(
        _file().encode().replace(b"base", b"b\0se", 1), "NUL", comment="a NUL byte"
    ),
    "undeclared-encoding": lambda: _format(
        f"<!-- Gehäuse -->\n{_file()}".encode("latin-1"),
        "UTF-8",
        "0xe4",
        comment="Latin-1 that no declaration names",
        repair=True,
    ),
}
