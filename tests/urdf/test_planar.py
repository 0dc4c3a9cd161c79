"""From a URDF to the planar chain: findings, assumptions and refusals."""

import io

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy
from hypothesis import given, settings

from tests.urdf.quantities import closed_form, in_source_frame, pinocchio_of, planar_points, weight
from tests.urdf.robots import (
    ELBOW_AXIS,
    ELBOW_ORIGIN,
    LOWER_CENTRE,
    MASSIVE_TOOL,
    PLAIN,
    SHOULDER_AXIS,
    SHOULDER_ORIGIN,
    TOOL_ORIGIN,
    Messy,
    edited,
    messy_robots,
    without,
)
from tests.urdf.sentences import names, only, refusal
from twolink import ParameterError
from twolink.data import data_path
from twolink.urdf import PlanarUrdf, parse_planar_urdf, read_planar_urdf
from twolink.urdf.description import describe


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
                MASSIVE_TOOL,
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


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"text": PLAIN.encode()}, "text must be a string; got b'"),
        ({"source": 5}, "source must be a string; got 5"),
        ({"source": None}, "source must be a string; got None"),
        ({"tip": 5}, "tip must be a string; got 5"),
    ],
)
@pytest.mark.parametrize("read", [parse_planar_urdf, describe])
def test_arguments_that_are_no_strings(read, arguments, words):
    with pytest.raises(ParameterError, match=f"^{words}"):
        read(**{"text": PLAIN, **arguments})


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
