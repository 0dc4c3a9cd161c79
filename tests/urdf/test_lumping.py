"""Rigidly connected links are one body."""

import math

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings

from tests.urdf.robots import (
    LOWER_CENTRE,
    MASSIVE_TOOL,
    PLAIN,
    TOOL_ORIGIN,
    Messy,
    edited,
    messy_robots,
)
from twolink import UrdfError
from twolink.urdf import parse_planar_urdf
from twolink.urdf.lumping import lump, lump_in_space, two_bodies
from twolink.urdf.reading import parse_tree
from twolink.urdf.sdf import sdf_of


class TestLumping:
    """Fixed joints hold links together; the parallel-axis theorem joins their inertias."""

    def test_two_fixed_links_are_lumped(self):
        lower = parse_planar_urdf(edited(MASSIVE_TOOL), tip="tool").links[1]
        # Masses 1.5 at (0.25, 0) and 0.5 at (0.6, −0.4) along and across; y does not matter.
        along, across = (1.5 * 0.25 + 0.5 * 0.6) / 2, -0.5 * 0.4 / 2
        reduced = 1.5 * 0.5 / 2 * ((0.6 - 0.25) ** 2 + 0.4**2)
        assert lower.mass == 2.0
        assert lower.centre == pytest.approx((along, across), rel=1e-15)
        # Rolled by a right angle, the tool's z is along the joint's axis.
        assert lower.inertia == pytest.approx(0.2 + 4 + reduced, rel=1e-15)

    def test_products_of_inertia_count_when_turned(self):
        inertia = 'ixx="0.01" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.2"'
        turned = 'ixx="0.5" ixy="0.1" ixz="0" iyy="0.2" iyz="0" izz="0.6"'
        origin = '<origin xyz="0.25 0 0" rpy="0 0 0.5"/>'
        lower = parse_planar_urdf(edited((inertia, turned), (LOWER_CENTRE, origin))).links[1]
        s, c = math.sin(0.5), math.cos(0.5)
        assert lower.inertia == pytest.approx(0.5 * s * s + 2 * 0.1 * s * c + 0.2 * c * c)

    def test_a_weightless_link_changes_no_bit(self):
        nothing = '<inertial><mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0"'
        weightless = f'<link name="tool">{nothing} izz="0"/></inertial></link>'
        text = edited(('<link name="tool"/>', weightless), ('value="1.5"', 'value="0.1"'))
        lower = parse_planar_urdf(text).links[1]
        assert (lower.mass, lower.centre, lower.inertia) == (0.1, (0.25, 0.0), 0.2)

    def test_a_mass_fixed_to_the_base_changes_nothing(self):
        inertial = PLAIN[PLAIN.index("<inertial>") : PLAIN.index("</link>")]
        text = edited(('<link name="base"/>', f'<link name="base">{inertial}</link>'))
        assert parse_planar_urdf(text).links == parse_planar_urdf(PLAIN).links


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


@pytest.mark.parametrize("lumped", [lump, lump_in_space])
@pytest.mark.parametrize(
    ("text", "words"),
    [
        (edited(('value="2.0"', 'value="0"')), "'upper' moves: its mass, .* must be positive"),
        (
            edited(MASSIVE_TOOL, ('value="1.5"', 'value="1.7e308"')).replace('"0.5"', '"1.7e308"'),
            "'lower': mass and inertia must be float64 numbers; got a larger one",
        ),
    ],
)
def test_bodies_that_are_refused_in_the_plane_and_in_space(lumped, text, words):
    bodies = two_bodies(parse_tree(text))
    with pytest.raises(UrdfError, match=words):
        tuple(map(lumped, bodies))


def test_only_in_space_an_inertia_is_beyond_float64():
    """Two masses that are far apart along the joint's axis."""
    far = edited(MASSIVE_TOOL, (TOOL_ORIGIN, '<origin xyz="0 1e160 0"/>'))
    body = two_bodies(parse_tree(far))[1]
    assert lump(body).inertia == parse_planar_urdf(far).links[1].inertia < 10
    with pytest.raises(UrdfError, match=r"'lower': mass and inertia must be float64"):
        lump_in_space(body)
    with pytest.raises(UrdfError, match=r"^arm\.urdf: link 'lower': mass and inertia must be"):
        sdf_of(far, source="arm.urdf")
