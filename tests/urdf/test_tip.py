"""The end of link 2: the frame that is named, or the best guess."""

import math

import pytest

from tests.urdf.robots import (
    ELBOW_AXIS,
    ELBOW_ORIGIN,
    LOWER_CENTRE,
    PLAIN,
    SHOULDER_ORIGIN,
    TOOL_ORIGIN,
    edited,
    without,
)
from tests.urdf.sentences import names, only, refusal
from twolink.urdf import parse_planar_urdf


class TestTip:
    """The frame taken as D."""

    TWO = (
        '<link name="tool"/>',
        '<link name="tool"/><link name="far"/><link name="aside"/>'
        '<joint name="f" type="fixed"><parent link="tool"/><child link="far"/>'
        '<origin xyz="0.3 0 -0.5"/></joint>'
        '<joint name="s" type="fixed"><parent link="tool"/><child link="aside"/>'
        '<origin xyz="0 7 0"/></joint>',
    )
    NONE = (without('<link name="tool"/>', ">"), without('<joint name="mount"', "</joint>"))

    def test_the_frame_that_is_named(self):
        urdf = parse_planar_urdf(edited(self.TWO), tip="aside")
        assert (urdf.tip, urdf.tip_position) == ("aside", (0.6, 7.0, 0.0))
        assert urdf.links[1].length == 0.6
        assert urdf.notes == ()

    def test_the_frame_d(self):
        text = edited(self.TWO).replace('"tool"', '"D"')
        urdf = parse_planar_urdf(text)
        assert (urdf.tip, urdf.links[1].length, urdf.notes) == ("D", 0.6, ())

    def test_the_farthest_frame_in_the_plane(self):
        urdf = parse_planar_urdf(edited(self.TWO))
        assert urdf.tip == "far"
        assert urdf.links[1].length == pytest.approx(math.hypot(0.9, 0.5))
        assert urdf.joints.offset[1] == pytest.approx(math.atan2(0.5, 0.9))
        only(urdf.notes, "'far'")

    def test_without_a_frame_d_is_at_twice_the_mass_centre(self):
        urdf = parse_planar_urdf(edited(*self.NONE))
        assert (urdf.tip, urdf.tip_position) == (None, (0.5, 0.0, 0.0))
        assert urdf.links[1].length == 0.5
        only(urdf.notes, "'lower'", "twice")

    @pytest.mark.parametrize("yaw", [0.0, 0.1, 0.3, 0.5, 0.7, 1.1, 1.3])
    def test_a_frame_on_the_axis_is_no_tip(self, yaw):
        # In a base that is turned, rounding leaves it a little off the axis.
        base = (SHOULDER_ORIGIN, f'<origin rpy="0 0 {yaw}"/>')
        urdf = parse_planar_urdf(edited(base, (TOOL_ORIGIN, '<origin xyz="0 0.6 0"/>')))
        assert urdf.tip is None
        assert urdf.links[1].length == pytest.approx(0.5, rel=1e-15)

    @pytest.mark.parametrize("axis", ["x", "y"])
    def test_the_second_link_may_have_no_length(self, axis):
        # Turned by a yaw, the x-axis of the lower link's frame is along the joint's axis.
        yaw = "0" if axis == "x" else "-1.5707963267948966"
        text = edited(
            (LOWER_CENTRE, ""),
            *self.NONE,
            (ELBOW_ORIGIN, f'<origin xyz="1 0 0" rpy="0 0 {yaw}"/>'),
            (ELBOW_AXIS, f'<axis xyz="{"0 1 0" if axis == "x" else "-1 0 0"}"/>'),
            ('iyy="0.2"', 'iyy="0.01"'),
        )
        urdf = parse_planar_urdf(text)
        assert (urdf.tip, urdf.links[1].length) == (None, 0.0)
        assert urdf.links[1].centre == (0.0, 0.0)
        assert urdf.joints.offset[1] == pytest.approx(0.0, abs=1e-15)
        assert any(f"{axis}-axis" in sentence for sentence in urdf.notes)

    def test_d_at_the_elbow(self):
        text = edited((TOOL_ORIGIN, "")).replace('"tool"', '"D"')
        urdf = parse_planar_urdf(text)
        assert (urdf.tip, urdf.links[1].length) == ("D", 0.0)
        assert urdf.links[1].centre == (0.25, 0.0)
        only(urdf.notes, "x-axis")

    def test_an_unknown_tip_is_refused(self):
        names(refusal(PLAIN, tip="hand"), "'hand'", "'lower'", "'tool'")
        names(refusal(PLAIN, tip="upper"), "'upper'", "'lower'", "'tool'")
