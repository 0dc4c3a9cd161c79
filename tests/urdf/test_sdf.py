"""SDF of a URDF: all that links and joints have."""

import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from tests.urdf.drawing import arm, arm_with_elbow, at, axis, joint, link
from tests.urdf.robots import PLAIN
from twolink import UrdfError
from twolink.urdf.lumping import two_bodies
from twolink.urdf.reading import parse_tree
from twolink.urdf.sdf import _rpy, sdf_of
from twolink.urdf.spatial import Pose, rotation_from_rpy, transpose

DRIVEN = arm_with_elbow(
    '<limit lower="-1" upper="2" effort="5" velocity="3"/>',
    '<dynamics damping="0.5" friction="0.25"/>',
)


def test_joints_and_frames():
    model = ET.fromstring(sdf_of(DRIVEN)).find("model")
    assert model is not None
    elbow = model.find("joint[@name='elbow']")
    assert elbow is not None
    texts = {element.tag: element.text for element in elbow.iter()}
    expected = {"parent": "upper", "child": "lower", "xyz": "0.0 1.0 0.0", "lower": "-1.0"}
    expected |= {"upper": "2.0", "effort": "5.0", "velocity": "3.0"}
    expected |= {"damping": "0.5", "friction": "0.25", "pose": "0.0 0.0 0.0 0.0 0.0 0.0"}
    assert {key: texts[key] for key in expected} == expected
    assert elbow.get("type") == "revolute"
    assert model.findtext("joint[@name='shoulder']/parent") == "world"
    assert model.findtext("frame[@name='hand']/pose") == "1.0 0.0 0.0 0.0 0.0 0.0"
    assert [each.get("name") for each in model.findall("link")] == ["upper", "lower"]
    assert model.get("name") == "test"


@pytest.mark.parametrize("name", ["world", "__arm__", "an::arm"])
def test_a_name_that_sdf_reserves_is_not_kept(name):
    text = arm().replace('name="test"', f'name="{name}"')
    model = ET.fromstring(sdf_of(text)).find("model")
    assert model is not None
    assert model.get("name") == "shoulder_elbow"


@pytest.mark.parametrize(
    ("limits", "kept"),
    [
        ('lower="-1" upper="2"', ("-1.0", "2.0")),
        ("", ("0.0", "0.0")),
        ('lower="1" upper="1"', ("1.0", "1.0")),
        ('lower="1" upper="-1"', (None, None)),
    ],
)
def test_limits_but_those_the_wrong_way_round_are_kept(limits, kept):
    text = arm_with_elbow(f'<limit {limits} effort="0" velocity="0"/>')
    limit = ET.fromstring(sdf_of(text)).find("model/joint[@name='elbow']/axis/limit")
    assert limit is not None
    found = tuple(limit.findtext(tag) for tag in ("lower", "upper", "effort", "velocity"))
    assert found == (*kept, "0.0", "0.0")


def test_names_are_escaped():
    text = arm(
        upper=link("a&lt;&amp;&quot;b"),
        shoulder=joint("shoulder", "ground", "a&lt;&amp;&quot;b"),
        elbow=joint("elbow", "a&lt;&amp;&quot;b", "lower", inside=at("1 0 0")),
    )
    root = ET.fromstring(sdf_of(text))
    assert root.findtext("model/joint[@name='elbow']/parent") == 'a<&"b'


@pytest.mark.parametrize("pitch", [0.0, 0.3, -1.2, math.pi / 2, -math.pi / 2])
def test_angles_of_a_rotation(pitch):
    rotation = rotation_from_rpy((0.4, pitch, -2.1))
    np.testing.assert_allclose(rotation_from_rpy(_rpy(rotation)), rotation, rtol=0, atol=1e-15)


@pytest.mark.parametrize("short", [0.0, 1e-15, 2e-12, 1e-11, 1e-9, 1e-7, 1e-3])
def test_angles_of_a_product_of_rotations_near_a_right_angle_of_pitch(short, random):
    """Its entries have round-off, as large as cos(pitch) or larger."""
    for _ in range(50):
        turned = Pose(rotation=rotation_from_rpy(tuple(random.uniform(-3, 3, 3))))
        back = Pose(rotation=transpose(turned.rotation))
        roll, yaw = random.uniform(-3, 3, 2)
        near = Pose(rotation=rotation_from_rpy((roll, math.pi / 2 - short, yaw)))
        product = (back @ (turned @ near)).rotation
        np.testing.assert_allclose(rotation_from_rpy(_rpy(product)), product, rtol=0, atol=2e-15)


@pytest.mark.parametrize(
    "xyz", ["0 1 0", "0 0 -2", "1e-12 0 1", "4e-10 -1 2e-9", "0.3 -0.5 0.2", "1 1 1", "-1 -1 1"]
)
def test_joints_turn_about_an_axis_of_their_frame(xyz):
    """Drake takes an axis that is within 1.5e-8 rad of one of the frame's for this one."""
    text = arm_with_axis(xyz)
    expected = two_bodies(parse_tree(text))[0].joint.axis
    found = ET.fromstring(sdf_of(text)).find("model/joint[@name='shoulder']")
    assert found is not None
    near = [float(word) for word in (found.findtext("axis/xyz") or "").split()]
    pose = [float(word) for word in (found.findtext("pose") or "").split()]
    assert sorted(map(abs, near)) == [0.0, 0.0, 1.0]
    assert pose[:3] == [0.0, 0.0, 0.0]
    turned = np.array(rotation_from_rpy((pose[3], pose[4], pose[5])))
    np.testing.assert_allclose(turned @ near, expected, rtol=1e-15, atol=1e-24)


def arm_with_axis(xyz: str) -> str:
    """Return the plain arm with both axes along a direction."""
    return arm(
        shoulder=joint("shoulder", "ground", "upper", inside=axis(xyz)),
        elbow=joint("elbow", "upper", "lower", inside=axis(xyz) + at("1 0.2 0.1")),
    )


def test_a_refusal_names_the_file():
    with pytest.raises(UrdfError, match=r"^arm\.urdf: exactly two joints"):
        sdf_of(PLAIN.replace('type="fixed"', 'type="continuous"'), source="arm.urdf")
