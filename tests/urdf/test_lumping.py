"""Rigidly connected links are one body."""

import math

import pytest

from tests.urdf.robots import LOWER_CENTRE, MASSIVE_TOOL, PLAIN, edited
from twolink.urdf import parse_planar_urdf


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
