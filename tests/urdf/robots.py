"""URDF text for tests: one plain robot to edit, and messy robots of every kind."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from hypothesis import strategies as st

from tests.strategies import decades, sizes

PLAIN = """\
<robot name="plain">
  <link name="base"/>
  <link name="upper">
    <inertial>
      <origin xyz="0.4 0 -0.1" rpy="0 0 0"/>
      <mass value="2.0"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.3" iyz="0" izz="0.3"/>
    </inertial>
  </link>
  <link name="lower">
    <inertial>
      <origin xyz="0.25 0 0"/>
      <mass value="1.5"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.2"/>
    </inertial>
  </link>
  <link name="tool"/>
  <joint name="shoulder" type="continuous">
    <parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0"/><axis xyz="0 1 0"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/><child link="lower"/>
    <origin xyz="1 0 0" rpy="0 0 0"/><axis xyz="0 1.0 0"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="lower"/><child link="tool"/>
    <origin xyz="0.6 0 0"/>
  </joint>
</robot>
"""


SHOULDER_AXIS = '<axis xyz="0 1 0"/>'
SHOULDER_ORIGIN = '<origin xyz="0 0 0"/>'
ELBOW_AXIS = '<axis xyz="0 1.0 0"/>'
ELBOW_ORIGIN = '<origin xyz="1 0 0" rpy="0 0 0"/>'
TOOL_ORIGIN = '<origin xyz="0.6 0 0"/>'
LOWER_CENTRE = '<origin xyz="0.25 0 0"/>'
EVERY_AXIS = ((SHOULDER_AXIS, '<axis xyz="{}"/>'), (ELBOW_AXIS, '<axis xyz="{}"/>'))
# The edit that gives the tool a mass, in a frame that is turned about x.
MASSIVE_TOOL = (
    '<link name="tool"/>',
    '<link name="tool"><inertial><origin xyz="0 5 0.4" rpy="1.5707963267948966 0 0"/>'
    '<mass value="0.5"/><inertia ixx="1" ixy="0" ixz="0" iyy="2" iyz="0" izz="4"/>'
    "</inertial></link>",
)


def about(axis: str) -> tuple[tuple[str, str], ...]:
    """Return the edits that turn both axes of the plain robot."""
    return tuple((old, new.format(axis)) for old, new in EVERY_AXIS)


def edited(*edits: tuple[str, str]) -> str:
    """Return the plain robot with pieces of its text replaced, each of which must be there."""
    text = PLAIN
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new)
    return text


def without(start: str, end: str) -> tuple[str, str]:
    """Return the edit that deletes the plain robot's text from one word through another."""
    first = PLAIN.index(start)
    return PLAIN[first : PLAIN.index(end, first) + len(end)], ""


@dataclass(frozen=True)
class Messy:
    """A planar two-link robot written as awkwardly as a URDF allows, and gravity in its plane."""

    text: str
    gravity: tuple[float, float, float]
    angles: tuple[float, float]


_small = sizes(0.01, 2.0)
_angles = st.floats(-3.0, 3.0)


@st.composite
def _placements(draw: st.DrawFn) -> pin.SE3:
    rotation = pin.rpy.rpyToMatrix(*(draw(_angles) for _ in range(3)))
    return pin.SE3(rotation, np.array([draw(_small) for _ in range(3)]))


@st.composite
def messy_robots(draw: st.DrawFn, low: float = -2.0, high: float = 2.0) -> Messy:
    """Robots with any base, frame, axis and split into links; all their numbers are general."""
    base, upper, lower = draw(_placements()), draw(_placements()), draw(_placements())
    normal = base.rotation[:, 2]
    in_plane = base.rotation[:, :2]

    # The elbow lies anywhere in space; the frame on it may turn any way.
    upper = pin.SE3(upper.rotation, base.translation)
    elbow = pin.SE3(lower.rotation, base.act(np.array([draw(_small) for _ in range(3)])))
    tip = pin.SE3(draw(_placements()).rotation, elbow.act(np.array([draw(_small) for _ in "xyz"])))

    elements = ['<link name="world"/><link name="pedestal"/>']
    fixed = draw(_placements())
    elements.append(_joint("bolt", "fixed", ("world", "pedestal"), fixed))
    axis1, axis2 = upper.rotation.T @ normal, elbow.rotation.T @ normal
    elements.append(_moving(draw, "j1", ("pedestal", "upper"), fixed.actInv(upper), axis1))
    for link in ("upper", "lower"):
        weld = draw(_placements())
        elements.append(_link(draw, link, low, high) + _link(draw, f"{link}_half", low, high))
        elements.append(_joint(f"{link}_weld", "fixed", (link, f"{link}_half"), weld))
        if link == "upper":
            # The elbow hangs on the welded half.
            stands = upper * weld
            elements.append(
                _moving(draw, "j2", ("upper_half", "lower"), stands.actInv(elbow), axis2)
            )
        else:
            stands = elbow * weld
            elements.append(_joint("D_joint", "fixed", ("lower_half", "D"), stands.actInv(tip)))
    elements.append('<link name="D"/>')
    lean = draw(_angles)
    gravity = 9.81 * (in_plane @ [np.cos(lean), np.sin(lean)])
    shuffled = draw(st.permutations(elements))
    x, y, z = gravity.tolist()
    return Messy(
        text=f'<robot name="messy">{"".join(shuffled)}</robot>',
        gravity=(x, y, z),
        # yourdfpy does not move a joint by 1e-9 rad.
        angles=(draw(_small), draw(_small)),
    )


def _origin(pose: pin.SE3) -> str:
    xyz, rpy = pose.translation, pin.rpy.matrixToRpy(pose.rotation)
    return f'<origin xyz="{_words(xyz)}" rpy="{_words(rpy)}"/>'


def _words(vector: np.ndarray) -> str:
    return " ".join(repr(float(number)) for number in vector)


def _joint(name: str, kind: str, between: tuple[str, str], pose: pin.SE3, more: str = "") -> str:
    parent, child = between
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{_origin(pose)}{more}</joint>'


def _moving(
    draw: st.DrawFn,
    name: str,
    between: tuple[str, str],
    pose: pin.SE3,
    normal: np.ndarray,
) -> str:
    """Return a joint about a direction that is given in the child's frame."""
    kind = draw(st.sampled_from(["revolute", "continuous"]))
    length = draw(decades(-1.0, 1.0)) * draw(st.sampled_from([1, -1]))
    axis = length * normal
    limit = '<limit lower="-9" upper="9" effort="9" velocity="9"/>' if kind == "revolute" else ""
    return _joint(name, kind, between, pose, f'<axis xyz="{_words(axis)}"/>{limit}')


def _link(draw: st.DrawFn, name: str, low: float, high: float) -> str:
    """Return a link with an inertia that is full in its frame, and physically possible."""
    mass = draw(decades(low, high))
    x, y, z = (draw(st.floats(0.1, 1.0)) for _ in "xyz")
    moments = (y + z, x + z, x + y)
    turned = draw(_placements()).rotation
    matrix = mass * turned @ np.diag(moments) @ turned.T
    entries = zip(("xx", "xy", "xz", "yy", "yz", "zz"), matrix[np.triu_indices(3)], strict=True)
    inertia = " ".join(f'i{where}="{float(entry)!r}"' for where, entry in entries)
    return (
        f'<link name="{name}"><inertial>{_origin(draw(_placements()))}'
        f'<mass value="{mass!r}"/><inertia {inertia}/></inertial></link>'
    )
