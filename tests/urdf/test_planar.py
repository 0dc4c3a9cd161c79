"""From a URDF to the planar chain: findings, assumptions and refusals."""

import io
import math

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy
from hypothesis import given, settings
from numpy.typing import ArrayLike

from tests.urdf.robots import PLAIN, Messy, edited, messy_robots, without
from tests.urdf.test_reading import ELBOW_AXIS, ELBOW_ORIGIN, names, refusal
from twolink import ParameterError
from twolink.data import data_path
from twolink.urdf import PlanarUrdf, parse_planar_urdf, read_planar_urdf

SHOULDER_AXIS = '<axis xyz="0 1 0"/>'
SHOULDER_ORIGIN = '<origin xyz="0 0 0"/>'
TOOL_ORIGIN = '<origin xyz="0.6 0 0"/>'
LOWER_CENTRE = '<origin xyz="0.25 0 0"/>'
EVERY_AXIS = ((SHOULDER_AXIS, '<axis xyz="{}"/>'), (ELBOW_AXIS, '<axis xyz="{}"/>'))


def about(axis: str) -> tuple[tuple[str, str], ...]:
    """Return the edits that turn both axes of the plain robot."""
    return tuple((old, new.format(axis)) for old, new in EVERY_AXIS)


def only(sentences: tuple[str, ...], *words: str) -> None:
    """Check that there is one assumption, and that it is a sentence with these words."""
    assert len(sentences) == 1, sentences
    assert sentences[0].endswith(".")
    names(sentences[0], *words)


def test_the_shipped_chain_is_exact():
    urdf = read_planar_urdf(data_path("twolink.urdf"))
    assert [(k.mass, k.length, k.centre, k.inertia) for k in urdf.links] == [
        (1.0, 1.0, (0.5, 0.0), 1 / 12)
    ] * 2
    assert urdf.joints.sign == (1, 1)
    assert urdf.joints.offset == (0.0, 0.0)
    assert urdf.origin == (0.0, 0.0, 0.0)
    assert urdf.axes == ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
    assert (urdf.gravity, urdf.world_gravity) == (9.81, (0.0, 0.0, -9.81))
    assert (urdf.tip, urdf.tip_position) == ("D", (1.0, 0.0, 0.0))
    assert urdf.notes == ()


def test_the_plain_robot():
    urdf = parse_planar_urdf(PLAIN, tip="tool")
    upper, lower = urdf.links
    # across is a quarter turn from x towards y, which is down: a link frame's −z.
    assert (upper.mass, upper.length, upper.centre, upper.inertia) == (2.0, 1.0, (0.4, 0.1), 0.3)
    assert (lower.mass, lower.length, lower.centre, lower.inertia) == (1.5, 0.6, (0.25, 0.0), 0.2)
    assert urdf.joint_names == ("shoulder", "elbow")
    assert urdf.notes == ()


def test_joints_are_ordered_from_the_base_not_as_written():
    start, middle = PLAIN.index('  <joint name="shoulder"'), PLAIN.index('  <joint name="elbow"')
    end = PLAIN.index('  <joint name="mount"')
    text = PLAIN[:start] + PLAIN[middle:end] + PLAIN[start:middle] + PLAIN[end:]
    assert parse_planar_urdf(text).joint_names == ("shoulder", "elbow")
    assert parse_planar_urdf(text).links == parse_planar_urdf(PLAIN).links


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (2, 1, 0), (1, 2, 0)])
def test_properties_of_joints_are_ordered_from_the_base(order):
    more = (
        '<limit lower="-1" upper="2" effort="1" velocity="1"/><dynamics damping="3" friction="4"/>'
    )
    text = edited(
        ('type="continuous"', 'type="revolute"'),
        (SHOULDER_AXIS, SHOULDER_AXIS + more),
        (ELBOW_AXIS, ELBOW_AXIS + '<limit upper="5" effort="1" velocity="1"/>'),
        # Friction of a fixed joint is no friction of the joints that move.
        (TOOL_ORIGIN, TOOL_ORIGIN + '<dynamics damping="6" friction="7"/>'),
    )
    start, end = text.index("  <joint"), text.index("</robot>")
    joints = [part + "</joint>" for part in text[start:end].split("</joint>")[:-1]]
    urdf = parse_planar_urdf(text[:start] + "".join(joints[i] for i in order) + text[end:])
    assert urdf.joint_names == ("shoulder", "elbow")
    assert (urdf.damping, urdf.friction) == ((3.0, 0.0), (4.0, 0.0))
    assert urdf.limits == ((-1.0, 2.0), (0.0, 5.0))


def test_defaults_of_the_standard():
    # Without <axis> a joint turns about x; without <origin> it stands in its parent's frame.
    text = edited(
        (SHOULDER_AXIS, ""),
        (ELBOW_AXIS, ""),
        (SHOULDER_ORIGIN, ""),
        (ELBOW_ORIGIN, '<origin xyz="0 1 0"/>'),
        (TOOL_ORIGIN, '<origin xyz="0 0.6 0"/>'),
        ('iyy="0.3"', 'iyy="0.7"'),
    )
    urdf = parse_planar_urdf(text)
    assert urdf.axes == ((0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0))
    assert urdf.joints.sign == (-1, -1)
    assert urdf.origin == (0.0, 0.0, 0.0)
    assert urdf.links[0].inertia == 0.01


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


class TestLumping:
    """Fixed joints hold links together; the parallel-axis theorem joins their inertias."""

    SECOND = (
        '<link name="tool"/>',
        '<link name="tool"><inertial><origin xyz="0 5 0.4" rpy="1.5707963267948966 0 0"/>'
        '<mass value="0.5"/><inertia ixx="1" ixy="0" ixz="0" iyy="2" iyz="0" izz="4"/>'
        "</inertial></link>",
    )

    def test_two_fixed_links_are_lumped(self):
        lower = parse_planar_urdf(edited(self.SECOND), tip="tool").links[1]
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


@pytest.mark.parametrize(
    ("edits", "words"),
    [
        pytest.param(
            [('type="continuous"', 'type="fixed"')], ["got 0", "two joints"], id="nothing moves"
        ),
        pytest.param(
            [('name="elbow" type="continuous"', 'name="elbow" type="fixed"')],
            ["got 1", "'shoulder'"],
            id="one joint",
        ),
        pytest.param([('type="fixed"', 'type="continuous"')], ["got 3", "'mount'"], id="three"),
        pytest.param([('parent link="upper"', 'parent link="base"')], ["'elbow'"], id="branches"),
        pytest.param(
            [(ELBOW_AXIS, ELBOW_AXIS + '<mimic joint="shoulder"/>')],
            ["'elbow'", "mimic"],
            id="mimic",
        ),
        *(
            pytest.param(
                [('name="elbow" type="continuous"', f'name="elbow" type="{kind}"')],
                ["'elbow'", kind],
                id=kind,
            )
            for kind in ("prismatic", "floating", "planar")
        ),
        pytest.param([(ELBOW_AXIS, '<axis xyz="1 0 0"/>')], ["'elbow'", "parallel"], id="crossed"),
        pytest.param([('xyz="1 0 0"', 'xyz="0 3 0"')], ["'elbow'", "apart"], id="no length"),
        pytest.param([('xyz="1 0 0"', 'xyz="0 0 0"')], ["'elbow'", "apart"], id="no length at all"),
        pytest.param([('value="2.0"', 'value="0"')], ["'upper'", "mass"], id="massless upper"),
        pytest.param(
            [without('<inertial>\n      <origin xyz="0.25', "</inertial>")],
            ["'lower'", "mass"],
            id="massless lower",
        ),
        pytest.param([('iyy="0.2"', 'iyy="-0.2"')], ["'lower'", "-0.2"], id="negative inertia"),
        pytest.param(
            [('iyy="0.2"', 'iyy="0"'), (LOWER_CENTRE, "")], ["'lower'", "'elbow'"], id="no inertia"
        ),
        pytest.param(
            [
                ('iyy="0.2"', 'iyy="0"'),
                ('iyy="0.3"', 'iyy="0"'),
                ('xyz="0.4 0 -0.1"', 'xyz="0 0 0"'),
            ],
            ["'upper'", "'shoulder'"],
            id="no inertia about A, and a point mass",
        ),
        pytest.param(
            [('xyz="1 0 0"', 'xyz="1.7e308 0 1.7e308"')], ["'upper'", "float64"], id="too far"
        ),
        pytest.param(
            [
                TestLumping.SECOND,
                ('value="0.5"', 'value="1e308"'),
                ('value="1.5"', 'value="1e308"'),
            ],
            ["'lower'", "float64"],
            id="beyond float64",
        ),
    ],
)
def test_files_without_a_planar_two_link_chain_are_refused(edits, words):
    text = PLAIN
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    names(refusal(text), *words)


def test_link_1_may_have_no_inertia_about_a_if_link_2_has_inertia():
    text = edited(('iyy="0.3"', 'iyy="0"'), ('xyz="0.4 0 -0.1"', 'xyz="0 0 0"'))
    assert parse_planar_urdf(text).links[0].inertia == 0.0


@pytest.mark.parametrize(
    "dynamics", ['<dynamics damping="0.1"/>', '<dynamics friction="0.2" damping="0"/>']
)
def test_damping_and_friction_are_in_the_notes(dynamics):
    text = edited((ELBOW_AXIS, ELBOW_AXIS + dynamics))
    urdf = parse_planar_urdf(text, tip="tool")
    only(urdf.left_out, "'elbow'", "damping", "friction", "leaves")
    still = edited((ELBOW_AXIS, ELBOW_AXIS + '<dynamics damping="0" friction="0"/>'))
    assert parse_planar_urdf(still, tip="tool").left_out == ()


# Agreement with Pinocchio and yourdfpy, on robots as awkward as URDF allows.


def absolute(urdf: PlanarUrdf, angles: tuple[float, float]) -> np.ndarray:
    return np.array(urdf.joints.absolute_angles(angles))


def closed_form(urdf: PlanarUrdf, angles: tuple[float, float]) -> np.ndarray:
    """Return the mass matrix over the joint angles, by the textbook formula."""
    one, two = urdf.links
    (a1, b1), (a2, b2) = one.centre, two.centre
    q1, q2 = absolute(urdf, angles)
    M11 = one.inertia + one.mass * (a1**2 + b1**2) + two.mass * one.length**2
    M12 = two.mass * one.length * (a2 * math.cos(q2 - q1) - b2 * math.sin(q2 - q1))
    M22 = two.inertia + two.mass * (a2**2 + b2**2)
    s1, s2 = urdf.joints.sign
    S = np.array([[s1, 0], [s1, s2]])
    return np.asarray(S.T @ np.array([[M11, M12], [M12, M22]]) @ S)


def planar_points(urdf: PlanarUrdf, angles: tuple[float, float]) -> np.ndarray:
    """Return C1, C2 and D in the derivation's frame (m), from the parameters alone."""
    q1, q2 = absolute(urdf, angles)
    along1, along2 = (np.array([math.cos(q), math.sin(q)]) for q in (q1, q2))
    across1, across2 = (np.array([-v[1], v[0]]) for v in (along1, along2))
    (a1, b1), (a2, b2) = urdf.links[0].centre, urdf.links[1].centre
    elbow = urdf.links[0].length * along1
    return np.array(
        [
            a1 * along1 + b1 * across1,
            elbow + a2 * along2 + b2 * across2,
            elbow + urdf.links[1].length * along2,
        ]
    )


def weight(urdf: PlanarUrdf, angles: tuple[float, float]) -> tuple[float, float]:
    """Return the joint torques of gravity (N m), from the parameters alone."""
    points = planar_points(urdf, angles)
    # The work of a weight along y: ∂y/∂q of a point is its x counted from the joint.
    elbow = urdf.links[0].length * math.cos(absolute(urdf, angles)[0])
    m1, m2 = (link.mass for link in urdf.links)
    Q1 = urdf.gravity * (m1 * points[0, 0] + m2 * elbow)
    Q2 = urdf.gravity * m2 * (points[1, 0] - elbow)
    one, two = urdf.joints.joint_forces((Q1, Q2))
    return float(one), float(two)


def in_source_frame(urdf: PlanarUrdf, points: ArrayLike) -> np.ndarray:
    return np.asarray((np.asarray(points) - urdf.origin) @ np.array(urdf.axes[:2]).T)


def pinocchio_of(urdf: PlanarUrdf, angles: tuple[float, float]):
    """Return Pinocchio's model and data of the same text, and its configuration."""
    model = pin.buildModelFromXML(urdf.xml)
    q = pin.neutral(model)
    for name, angle in zip(urdf.joint_names, angles, strict=True):
        joint = model.getJointId(name)
        start = model.idx_qs[joint]
        values = [angle] if model.nqs[joint] == 1 else [math.cos(angle), math.sin(angle)]
        q[start : start + len(values)] = values
    return model, model.createData(), q


def read(robot: Messy) -> PlanarUrdf:
    return parse_planar_urdf(robot.text, gravity=robot.gravity)


@pytest.mark.slow
@given(robot=messy_robots())
def test_mass_matrix_and_gravity_agree_with_pinocchio(robot):
    urdf = read(robot)
    assert urdf.notes == ()
    model, data, q = pinocchio_of(urdf, robot.angles)
    theirs, ours = pin.crba(model, data, q), closed_form(urdf, robot.angles)
    # Sizes of a few metres, and a link's own inertia, make up M; rounding is relative to them.
    size = (
        sum(
            (1 + np.linalg.norm(i.lever)) ** 2 * i.mass + np.linalg.norm(i.inertia)
            for i in model.inertias
        )
        * (1 + np.linalg.norm(model.jointPlacements[2].translation)) ** 2
    )
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-13 * size)

    model.gravity.linear = np.array(robot.gravity)
    torque = pin.computeGeneralizedGravity(model, model.createData(), q)
    np.testing.assert_allclose(weight(urdf, robot.angles), -torque, rtol=0, atol=1e-12 * size)


@pytest.mark.slow
@given(robot=messy_robots())
def test_points_agree_with_pinocchio(robot):
    urdf = read(robot)
    model, data, q = pinocchio_of(urdf, robot.angles)
    pin.framesForwardKinematics(model, data, q)
    joints = [model.getJointId(name) for name in urdf.joint_names]
    centres = [data.oMi[j].act(model.inertias[j].lever) for j in joints]
    tip = data.oMf[model.getFrameId("D")].translation
    theirs = in_source_frame(urdf, [*centres, tip])
    np.testing.assert_allclose(planar_points(urdf, robot.angles), theirs, rtol=0, atol=1e-13 * 20)
    # tip_position is D in the frame of the second joint.
    np.testing.assert_allclose(
        data.oMi[joints[1]].act(np.array(urdf.tip_position)), tip, atol=2e-12
    )


@pytest.mark.slow
@settings(max_examples=20)
@given(robot=messy_robots())
def test_the_tip_agrees_with_yourdfpy(robot):
    urdf = read(robot)
    model = yourdfpy.URDF.load(io.BytesIO(urdf.xml.encode()), load_meshes=False)
    model.update_cfg(dict(zip(urdf.joint_names, robot.angles, strict=True)))
    theirs = in_source_frame(urdf, model.get_transform("D", "world")[:3, 3])
    np.testing.assert_allclose(planar_points(urdf, robot.angles)[2], theirs, rtol=0, atol=2e-12)
