"""Small URDF texts, put together from parts that tests vary."""

LINK = '<inertial><mass value="1"/><origin xyz="0.5 0 0"/>{inertia}</inertial>'
INERTIA = '<inertia ixx="0.001" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'
BAR = LINK.format(inertia=INERTIA)


def link(name: str, inside: str = BAR) -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(name: str, parent: str, child: str, kind: str = "continuous", inside: str = "") -> str:
    axis = '<axis xyz="0 1 0"/>' if "<axis" not in inside and kind != "fixed" else ""
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{axis}{inside}</joint>'


def at(xyz: str, rpy: str = "0 0 0") -> str:
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def axis(xyz: str) -> str:
    return f'<axis xyz="{xyz}"/>'


def robot(*parts: str) -> str:
    return f'<robot name="test">{"".join(parts)}</robot>'


PARTS = {
    "ground": link("ground", ""),
    "upper": link("upper"),
    "lower": link("lower"),
    "hand": link("hand", ""),
    "shoulder": joint("shoulder", "ground", "upper"),
    "elbow": joint("elbow", "upper", "lower", inside=at("1 0 0")),
    "wrist": joint("wrist", "lower", "hand", "fixed", at("1 0 0")),
}


def arm(**changes: str) -> str:
    """Return the text of a plain arm, with some parts changed, added or (if empty) left out."""
    return robot(*{**PARTS, **changes}.values())


def arm_with_elbow(*properties: str) -> str:
    """Return the text of an arm whose elbow is revolute, with properties such as <limit>."""
    inside = at("1 0 0") + "".join(properties)
    return arm(elbow=joint("elbow", "upper", "lower", "revolute", inside))
