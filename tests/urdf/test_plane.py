"""The plane of motion: its frame, signs and offsets of joints, and gravity in it."""

import math

import numpy as np
import pinocchio as pin
import pytest

from tests.urdf.quantities import pinocchio_of, weight
from tests.urdf.robots import ELBOW_ORIGIN, EVERY_AXIS, PLAIN, SHOULDER_ORIGIN, about, edited
from tests.urdf.sentences import names, only, refusal
from twolink import ParameterError
from twolink.urdf import parse_planar_urdf


@pytest.mark.parametrize(
    ("axes", "sign"),
    [
        (("0 1 0", "0 1 0"), (1, 1)),
        (("0 -1 0", "0 1 0"), (-1, 1)),
        (("0 1 0", "0 -3 0"), (1, -1)),
        (("0 -1e-300 0", "0 -1e300 0"), (-1, -1)),
    ],
)
def test_signs_and_lengths_of_axes(axes, sign):
    edits = [(old, new.format(a)) for (old, new), a in zip(EVERY_AXIS, axes, strict=True)]
    urdf, plain = parse_planar_urdf(edited(*edits)), parse_planar_urdf(PLAIN)
    assert urdf.joints.sign == sign
    assert (urdf.axes, urdf.links) == (plain.axes, plain.links)


def test_offsets_of_a_chain_that_hangs_at_zero():
    # Turned by a right angle about +y, x points down; folded at the elbow, link 2 points up.
    text = edited(
        (SHOULDER_ORIGIN, '<origin xyz="1 2 3" rpy="0 1.5707963267948966 0"/>'),
        (ELBOW_ORIGIN, '<origin xyz="1 0 0" rpy="0 3.141592653589793 0"/>'),
    )
    urdf = parse_planar_urdf(text)
    assert urdf.joints.offset == pytest.approx((math.pi / 2, math.pi), abs=1e-15)
    assert urdf.origin == (1.0, 2.0, 3.0)
    assert urdf.links[0].centre == pytest.approx((0.4, 0.1), abs=1e-15)
    assert urdf.links[1].length == pytest.approx(0.6, abs=1e-15)
    assert urdf.notes == parse_planar_urdf(PLAIN).notes


@pytest.mark.parametrize("turn", range(8))
def test_x_points_along_a_positive_axis_of_the_world(turn):
    # The base turned about the vertical: x stays in the half in which its largest component is
    # positive, also where two components are equal but for rounding.
    yaw = turn * math.pi / 4
    text = edited((SHOULDER_ORIGIN, f'<origin rpy="0 0 {yaw!r}"/>'))
    urdf = parse_planar_urdf(text)
    expected = [0, math.pi / 4, math.pi / 2, -math.pi / 4][turn % 4]
    x = (math.cos(expected), math.sin(expected), 0.0)
    assert urdf.axes[0] == pytest.approx(x, abs=1e-15)
    assert urdf.axes[1] == (0.0, 0.0, -1.0)
    assert np.cross(urdf.axes[0], urdf.axes[1]) == pytest.approx(urdf.axes[2], abs=1e-15)
    assert urdf.joints.sign[0] == (1 if turn in (0, 1, 2, 7) else -1)


class TestGravity:
    """y is gravity's direction in the plane."""

    def test_any_direction_in_the_plane(self):
        urdf = parse_planar_urdf(PLAIN, gravity=(3.0, 0.0, 4.0))
        assert urdf.gravity == 5.0
        assert urdf.axes[0] == pytest.approx((0.8, 0.0, -0.6), abs=1e-15)
        assert urdf.axes[1] == pytest.approx((0.6, 0.0, 0.8), abs=1e-15)
        assert urdf.axes[2] == (0.0, -1.0, 0.0)
        assert urdf.joints.sign == (-1, -1)
        assert urdf.links[0].centre == pytest.approx((0.4, -0.1), abs=1e-15)

    def test_without_gravity_the_frame_is_that_of_the_axes(self):
        urdf = parse_planar_urdf(PLAIN, gravity=(0.0, 0.0, 0.0))
        assert urdf.gravity == 0.0
        assert urdf.axes == ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
        assert urdf.joints.offset == (0.0, 0.0)

    def test_normal_to_the_plane(self):
        text = edited(*about("0 0 1"), (ELBOW_ORIGIN, '<origin xyz="0.6 0.8 0"/>'))
        urdf = parse_planar_urdf(text, tip="tool")
        assert urdf.gravity == 0.0
        assert urdf.axes[0] == pytest.approx((0.6, 0.8, 0.0))
        assert urdf.axes[2] == (0.0, 0.0, 1.0)
        assert urdf.joints.sign == (1, 1)
        assert urdf.joints.offset[0] == pytest.approx(0.0, abs=1e-15)
        only(urdf.notes, "normal", "joints bear it")
        assert urdf.gravity_note == urdf.notes[0]

    @pytest.mark.parametrize(
        "roll", ["1.5707963267948966", "1.570796326794897", "-1.5707963267949"]
    )
    def test_gravity_normal_to_the_plane_but_for_rounding(self, roll):
        text = edited((SHOULDER_ORIGIN, f'<origin rpy="{roll} 0 0"/>'))
        urdf = parse_planar_urdf(text, tip="tool")
        assert (urdf.gravity, urdf.axes[0]) == (0.0, (1.0, 0.0, 0.0))
        only(urdf.notes, "normal")

    @pytest.mark.parametrize(
        ("edits", "tilt"),
        [
            (about("0 9e-6 1"), 9e-6),
            ([(SHOULDER_ORIGIN, f'<origin rpy="{math.pi / 2 - 1e-13!r} 0 0"/>')], 1e-13),
            ([(SHOULDER_ORIGIN, '<origin rpy="1.5708 0 0"/>')], 1.5708 - math.pi / 2),
            ([(SHOULDER_ORIGIN, '<origin rpy="1.57079632679 0 0"/>')], 4.8966e-12),
        ],
        ids=["9e-6", "1e-13", "six digits", "twelve digits"],
    )
    def test_axes_that_are_nearly_vertical_feel_gravity_as_in_pinocchio(self, edits, tilt):
        urdf = parse_planar_urdf(edited(*edits), tip="tool")
        assert urdf.gravity == pytest.approx(9.81 * tilt, rel=1e-4, abs=1e-15)
        only(urdf.notes, f"{urdf.gravity:.5g} m/s²", "acts", "the joints bear the rest")
        model, data, q = pinocchio_of(urdf, (0.3, -0.8))
        model.gravity.linear = np.array([0.0, 0.0, -9.81])
        torque = pin.computeGeneralizedGravity(model, data, q)
        np.testing.assert_allclose(weight(urdf, (0.3, -0.8)), -torque, rtol=0, atol=1e-13)
        assert np.abs(torque).max() > tilt

    @pytest.mark.parametrize("lean", [1e-13, 1.1e-5, 1e-4, 0.3, 1.3])
    def test_the_frame_is_orthonormal_however_oblique_gravity_is(self, lean):
        text = edited((SHOULDER_ORIGIN, f'<origin rpy="{math.pi / 2 - lean!r} 0 0.4"/>'))
        axes = np.array(parse_planar_urdf(text).axes)
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), rtol=0, atol=1e-15)
        assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-15)

    def test_oblique_gravity_acts_by_its_component_in_the_plane(self):
        lean = 0.3
        text = edited((SHOULDER_ORIGIN, f'<origin rpy="{lean} 0 0"/>'))
        urdf = parse_planar_urdf(text, tip="tool")
        assert urdf.gravity == pytest.approx(9.81 * math.cos(lean), rel=1e-15)
        assert urdf.axes[1] == pytest.approx((0.0, math.sin(lean), -math.cos(lean)), abs=1e-15)
        only(urdf.notes, "0.3 rad", f"{urdf.gravity:.5g}", "the joints bear the rest")
        assert urdf.gravity_note == urdf.notes[0]

    @pytest.mark.parametrize("roll", [0.0, 0.3, 1.2, math.pi / 2])
    def test_the_joints_bear_the_rest(self, roll):
        """With gravity in full, Pinocchio finds the same torques as with its part in the plane."""
        urdf = parse_planar_urdf(edited((SHOULDER_ORIGIN, f'<origin rpy="{roll!r} 0 0"/>')))
        model, data, q = pinocchio_of(urdf, (0.3, -0.8))
        model.gravity.linear = np.array([0.0, 0.0, -9.81])
        in_full = pin.computeGeneralizedGravity(model, data, q)
        model.gravity.linear = urdf.gravity * np.array(urdf.axes[1])
        np.testing.assert_allclose(
            in_full, pin.computeGeneralizedGravity(model, data, q), rtol=0, atol=1e-13
        )

    def test_gravity_in_the_plane_but_for_rounding_keeps_its_size(self):
        urdf = parse_planar_urdf(edited((SHOULDER_ORIGIN, '<origin rpy="1e-13 0 0"/>')))
        assert (urdf.gravity, urdf.gravity_note) == (9.81, "")

    def test_nearly_in_the_plane(self):
        text = edited((SHOULDER_ORIGIN, '<origin rpy="1e-6 0 0"/>'))
        only(parse_planar_urdf(text, tip="tool").notes, "1e-06 rad")

    @pytest.mark.parametrize("gravity", [(0, 0, math.nan), (0, math.inf, 0), (1.0, 2.0)])
    def test_not_a_vector(self, gravity):
        with pytest.raises(ParameterError, match="gravity"):
            parse_planar_urdf(PLAIN, gravity=gravity)


@pytest.mark.parametrize(
    ("roll", "accepted", "noted"),
    [
        ("3.141592653589793", True, False),
        ("1e-15", True, False),
        ("1e-13", True, True),
        ("3.1415926536", True, True),
        ("3.14159", True, True),
        ("3.1416", True, True),
        ("9.9e-6", True, True),
        ("1.1e-5", False, True),
        ("3.14", False, True),
        ("1.5707963267948966", False, True),
    ],
)
def test_only_axes_parallel_within_typed_digits_are_accepted(roll, accepted, noted):
    text = edited((ELBOW_ORIGIN, f'<origin xyz="1 0 0" rpy="{roll} 0 0"/>'))
    if not accepted:
        names(refusal(text), "'shoulder'", "'elbow'", "parallel")
        return
    sentences = parse_planar_urdf(text, tip="tool").notes
    assert len(sentences) == noted
    if noted:
        only(sentences, "'shoulder'", "'elbow'", "rad", "m/s² of gravity")
        weightless = parse_planar_urdf(text, tip="tool", gravity=(0.0, 0.0, 0.0))
        assert "gravity" not in weightless.notes[0]
