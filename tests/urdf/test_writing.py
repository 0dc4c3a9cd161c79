"""A chain's URDF: it reads back to the same bits, and engines find the right mass matrix in it."""

import math
import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.strategies import decades
from twolink import ParameterError
from twolink.data import data_path
from twolink.urdf import (
    JointProperties,
    LinkParameters,
    parse_planar_urdf,
    write_planar_urdf,
)

BAR = LinkParameters(mass=1.0, length=1.0, centre=(0.5, 0.0), inertia=1 / 12)

positive = decades(-200.0, 200.0)
signed = positive.flatmap(lambda size: st.sampled_from([size, -size]))
links = st.builds(
    LinkParameters,
    mass=positive,
    length=positive,
    centre=st.tuples(signed, signed),
    inertia=positive,
)


@given(first=links, second=links)
def test_round_trip_to_the_last_bit(first, second):
    read = parse_planar_urdf(write_planar_urdf((first, second)))
    assert read.links == (first, second)
    assert (read.joints.sign, read.joints.offset) == ((1, 1), (0.0, 0.0))
    assert read.notes == ()


@pytest.mark.slow
@given(first=links, second=links, length=st.just(0.0), centre=st.tuples(signed, signed))
def test_round_trip_without_a_second_length(first, second, length, centre):
    second = LinkParameters(second.mass, length, centre, second.inertia)
    assert parse_planar_urdf(write_planar_urdf((first, second))).links == (first, second)


@pytest.mark.parametrize("value", [5e-324, 2.2250738585072014e-308, 1e307, 0.1, 1 / 3])
def test_round_trip_at_the_edges_of_float64(value):
    link = LinkParameters(value, value, (value, -value), value)
    assert parse_planar_urdf(write_planar_urdf((link, link))).links == (link, link)


def test_round_trip_of_point_masses():
    link = LinkParameters(1.0, 2.0, (2.0, 0.0), 0.0)
    assert parse_planar_urdf(write_planar_urdf((link, link))).links == (link, link)


def test_integers_and_numpy_numbers_are_written_as_numbers():
    link = LinkParameters(1, 1, (np.float64(0.5), 0), np.float64(1 / 12))
    assert write_planar_urdf((link, link)) == write_planar_urdf((BAR, BAR))


def test_the_shipped_file_is_the_one_that_is_written():
    assert data_path("twolink.urdf").read_text(encoding="utf-8") == write_planar_urdf((BAR, BAR))


def test_every_inertia_is_physically_possible():
    robot = ET.fromstring(write_planar_urdf((BAR, LinkParameters(2.0, 3.0, (1.0, -0.2), 0.7))))
    for link in ("link1", "link2"):
        found = robot.find(f"link[@name='{link}']/inertial/inertia")
        assert found is not None
        x, y, z = (float(found.attrib[name]) for name in ("ixx", "iyy", "izz"))
        assert x > 0
        assert x + y > z
        assert x + z > y
        assert y == z
        # A rod of radius L/50: m r²/2 over m L²/12.
        assert x == pytest.approx(y * (1 / 50) ** 2 / 2 * 12, rel=1e-15)


@pytest.mark.parametrize("length", [0.0, 1e-3, 1.0])
def test_every_link_is_drawn_with_a_size(length):
    second = LinkParameters(1.0, length, (0.1, 0.0), 0.1)
    robot = ET.fromstring(write_planar_urdf((BAR, second)))
    for shape in robot.findall("link[@name='link2']/*/geometry/*"):
        assert all(float(size) > 0 for size in shape.attrib.values())
    drawn = [shape.tag for shape in robot.findall("link[@name='link2']/visual/geometry/*")]
    assert drawn == (["cylinder", "sphere", "sphere"] if length else ["sphere"])


def test_the_name_is_escaped():
    text = write_planar_urdf((BAR, BAR), name="a \"b\" 'c' <d> & e")
    assert ET.fromstring(text).get("name") == "a \"b\" 'c' <d> & e"
    assert parse_planar_urdf(text).links == (BAR, BAR)


@pytest.mark.parametrize("name", ["", "a\nb", "a\x00", "\ud800"])
def test_a_name_that_is_not_text(name):
    with pytest.raises(ParameterError, match="name"):
        write_planar_urdf((BAR, BAR), name=name)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["mass", "length", "inertia", "centre"])
def test_non_finite_parameters_are_refused(field, value):
    parameters = {"mass": 1.0, "length": 1.0, "centre": (0.5, 0.0), "inertia": 0.1}
    parameters[field] = (value, 0.0) if field == "centre" else value
    with pytest.raises(ParameterError, match="finite"):
        write_planar_urdf((BAR, LinkParameters(**parameters)))  # type: ignore[arg-type]


def test_points_have_frames():
    second = LinkParameters(1.0, 2.0, (0.7, -0.3), 0.1)
    model = pin.buildModelFromXML(write_planar_urdf((BAR, second)))
    data = model.createData()
    theta = (0.4, 0.9)
    q = np.array([number for angle in theta for number in (math.cos(angle), math.sin(angle))])
    pin.framesForwardKinematics(model, data, q)
    q1, q2 = theta[0], sum(theta)
    elbow = np.array([math.cos(q1), math.sin(q1)])
    along, across = np.array([math.cos(q2), math.sin(q2)]), np.array([-math.sin(q2), math.cos(q2)])
    expected = {
        "A": 0 * elbow,
        "C1": elbow / 2,
        "B": elbow,
        "C2": elbow + 0.7 * along - 0.3 * across,
        "D": elbow + 2 * along,
    }
    for name, place in expected.items():
        x, y, z = data.oMf[model.getFrameId(name)].translation
        # World z is up, the derivation's y is down.
        np.testing.assert_allclose((x, -z), place, atol=1e-15)
        assert y == 0


JOINTS = (JointProperties(0.1, 0.2, (-1.0, 0.5)), JointProperties(damping=1 / 3))


def test_properties_of_joints_read_back():
    text = write_planar_urdf((BAR, BAR), joints=JOINTS)
    read = parse_planar_urdf(text)
    assert read.links == (BAR, BAR)
    assert (read.damping, read.friction) == ((0.1, 1 / 3), (0.2, 0.0))
    assert read.limits == ((-1.0, 0.5), None)
    model = pin.buildModelFromXML(text)
    assert model.nqs.tolist() == [0, 1, 2]
    assert model.lowerPositionLimit[0] == -1.0


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"damping": -1.0}, "damping must be zero or a positive number; got -1.0"),
        ({"friction": math.nan}, "friction must be"),
        ({"limits": (1.0, 1.0)}, "limits must be a lower angle below"),
        ({"limits": (0.0, math.inf)}, "limits must be"),
    ],
)
def test_properties_that_no_joint_has(wrong, words):
    with pytest.raises(ParameterError, match=words):
        JointProperties(**wrong)
