"""A chain's URDF: it reads back to the same bits, and engines find the right mass matrix in it."""

import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

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


@pytest.mark.parametrize(
    ("first", "second", "words"),
    [
        ({"length": -1.0}, {}, "link 1: length must be a positive number of m; got -1.0"),
        ({"length": 0.0}, {}, "link 1: length must be a positive number of m; got 0.0"),
        ({}, {"length": -1e-9}, "link 2: length must be zero or a positive number of m; got -1e"),
        ({"mass": -1.0}, {}, "link 1: mass must be a positive number of kg; got -1.0"),
        ({}, {"mass": 0}, "link 2: mass must be a positive number of kg; got 0.0"),
        ({}, {"inertia": -0.1}, "link 2: inertia must be zero or a positive number of kg m²; got"),
        ({"mass": "a"}, {}, "link 1: mass must be a number; got 'a'"),
        ({}, {"mass": 1j}, "link 2: mass must be a number; got 1j"),
        ({}, {"length": None}, "link 2: length must be a number; got None"),
        ({"centre": 0.5}, {}, r"link 1: centre must be a pair \(along, across\) in m; got 0.5"),
        ({"centre": (0.5,)}, {}, r"link 1: centre must be a pair \(along, across\) in m; got"),
        ({"centre": ("a", 0)}, {}, r"link 1: centre\[0\] must be a number; got 'a'"),
        ({"length": 1e308}, {}, r"link 1: length must be a number of at most 1e\+307 in size; got"),
        ({}, {"centre": (0, -1e308)}, r"link 2: centre\[1\] must be a number of at most 1e\+307"),
        ({}, {"inertia": 0, "centre": (0, 0)}, "link 2: inertia about B must be a positive number"),
        (
            {"inertia": 0, "centre": (0, 0)},
            {"inertia": 0},
            "link 1: inertia about A must be a positive number of kg m²; got 0.0",
        ),
    ],
)
def test_parameters_that_no_chain_has(first, second, words):
    links = replace(BAR, **first), replace(BAR, **second)
    with pytest.raises(ParameterError, match=f"^{words}"):
        write_planar_urdf(links)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"links": (BAR,)}, "links must be a pair of LinkParameters; got "),
        ({"links": 5}, "links must be a pair of LinkParameters; got 5"),
        ({"links": (BAR, 5)}, r"links\[1\] must be a LinkParameters; got 5"),
        ({"joints": (JointProperties(),)}, "joints must be a pair of JointProperties; got "),
        ({"joints": None}, "joints must be a pair of JointProperties; got None"),
        ({"joints": (None, None)}, r"joints\[0\] must be a JointProperties; got None"),
    ],
)
def test_pairs_of_other_objects(arguments, words):
    with pytest.raises(ParameterError, match=f"^{words}"):
        write_planar_urdf(**{"links": (BAR, BAR), **arguments})


numbers = st.sampled_from([0.0, 5e-324, 1e-200, 1.0, 1e200, 1e307])
any_links = st.builds(
    LinkParameters,
    mass=numbers,
    length=numbers,
    centre=st.tuples(numbers, numbers.map(lambda size: -size)),
    inertia=numbers,
)


@given(first=any_links, second=any_links)
def test_the_reader_reads_all_that_is_written(first, second):
    try:
        text = write_planar_urdf((first, second))
    except ParameterError:
        return
    assert parse_planar_urdf(text).links == (first, second)


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


def test_properties_of_joints_are_kept_in_float64():
    kept = JointProperties(Fraction(1, 2), np.int64(2), np.array([-1, Decimal("0.5")]))
    assert kept == JointProperties(0.5, 2.0, (-1.0, 0.5))
    assert {type(number) for number in (kept.damping, kept.friction, *kept.limits)} == {float}


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
        ({"limits": (1.0, 2.0, 3.0)}, r"limits must be a lower angle .*; got \(1.0, 2.0, 3.0\)"),
        ({"limits": (1.0,)}, r"limits must be a lower angle .*; got \(1.0,\)"),
        ({"limits": 5}, "limits must be a lower angle .*; got 5"),
        ({"limits": ("a", 1.0)}, r"limits\[0\] must be a number; got 'a'"),
        ({"damping": "x"}, "damping must be a number; got 'x'"),
        ({"friction": None}, "friction must be a number; got None"),
        ({"friction": 1j}, "friction must be a number; got 1j"),
    ],
)
def test_properties_that_no_joint_has(wrong, words):
    with pytest.raises(ParameterError, match=words):
        JointProperties(**wrong)
