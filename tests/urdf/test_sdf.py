"""SDF of a URDF: the inertia in space that Pinocchio finds, and all that joints have."""

import math
import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings

from tests.urdf.drawing import arm, arm_with_elbow, at, joint, link
from tests.urdf.robots import PLAIN, Messy, messy_robots
from twolink import UrdfError
from twolink.urdf.lumping import two_bodies
from twolink.urdf.reading import parse_tree
from twolink.urdf.sdf import _rpy, lump_in_space, sdf_of
from twolink.urdf.spatial import rotation_from_rpy

DRIVEN = arm_with_elbow(
    '<limit lower="-1" upper="2" effort="1" velocity="1"/>',
    '<dynamics damping="0.5" friction="0.25"/>',
)


@pytest.mark.slow
@settings(max_examples=30)
@given(robot=messy_robots())
def test_inertias_in_space_are_pinocchios(robot: Messy):
    model = pin.buildModelFromXML(robot.text)
    for number, body in enumerate(two_bodies(parse_tree(robot.text)), start=1):
        mass, centre, inertia = lump_in_space(body)
        theirs = model.inertias[model.getJointId(body.joint.name)]
        size = np.linalg.norm(theirs.inertia) + mass * np.linalg.norm(theirs.lever) ** 2
        assert mass == pytest.approx(theirs.mass, rel=1e-14), number
        np.testing.assert_allclose(centre, theirs.lever, rtol=0, atol=1e-13 * 10)
        np.testing.assert_allclose(inertia, theirs.inertia, rtol=0, atol=1e-13 * (1 + size))


def test_joints_and_frames():
    model = ET.fromstring(sdf_of(DRIVEN)).find("model")
    assert model is not None
    elbow = model.find("joint[@name='elbow']")
    assert elbow is not None
    texts = {element.tag: element.text for element in elbow.iter()}
    expected = {"parent": "upper", "child": "lower", "xyz": "0.0 1.0 0.0", "lower": "-1.0"}
    expected |= {"upper": "2.0", "damping": "0.5", "friction": "0.25"}
    assert {key: texts[key] for key in expected} == expected
    assert elbow.get("type") == "revolute"
    assert model.findtext("joint[@name='shoulder']/parent") == "world"
    assert model.findtext("frame[@name='hand']/pose") == "1.0 0.0 0.0 0.0 0.0 0.0"
    assert [each.get("name") for each in model.findall("link")] == ["upper", "lower"]


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


def test_a_refusal_names_the_file():
    with pytest.raises(UrdfError, match=r"^arm\.urdf: exactly two joints"):
        sdf_of(PLAIN.replace('type="fixed"', 'type="continuous"'), source="arm.urdf")
