"""Losses of conversions: all that the written SDF, or MJCF as MuJoCo writes it, does not have."""

import pytest

from tests.urdf.drawing import arm, at, axis, joint, link, robot
from twolink.urdf.losses import losses
from twolink.urdf.sdf import sdf_of

BOX = "<geometry><box size='1 1 1'/></geometry>"
FULL = arm(
    ground=link("ground", f"<visual>{BOX}</visual>"),
    plate=link("plate", ""),
    hand=link("hand", f"<visual>{BOX}</visual><collision>{BOX}</collision>"),
    bolt=joint("bolt", "ground", "plate", "fixed"),
    shoulder=joint(
        "shoulder",
        "plate",
        "upper",
        "revolute",
        '<limit lower="-1.23456789" upper="2" effort="10" velocity="3"/>'
        '<dynamics damping="0.123456789" friction="0.3"/><safety_controller k_velocity="1"/>',
    ),
    extra='<gazebo reference="upper"/><mujoco/>',
)
MJCF = """\
<mujoco model="{name}">
  <compiler angle="radian"/>
  <worldbody>
    <geom size="0.5 0.5 0.5" type="box"/>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" {shoulder}/>
      <body name="lower" pos="1 0 0">
        <joint name="elbow" axis="0 1 0" limited="false"/>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="shoulder"/></equality>
</mujoco>
"""
KEPT = 'range="-1.23457 2" actuatorfrcrange="-10 10" damping="0.123457" frictionloss="0.3"'


def in_mjcf(text: str, shoulder: str, name: str = "test") -> tuple[str, ...]:
    return losses(text, MJCF.format(shoulder=shoulder, name=name), "mjcf")


def test_nothing_is_lost_of_joints_in_sdf():
    assert losses(FULL, sdf_of(FULL), "sdf") == (
        "Links 'ground', 'plate' are not in the SDF.",
        "Fixed joints 'bolt', 'wrist' are not in the SDF.",
        "2 visual shapes are not in the SDF.",
        "1 collision shape is not in the SDF.",
        "Elements 'gazebo', 'mujoco', 'safety_controller' are not in the SDF.",
    )


def test_what_mujoco_writes():
    assert in_mjcf(FULL, KEPT, name="arm") == (
        "The name 'test' of the robot is not in the MJCF.",
        "Links 'ground', 'hand', 'plate' are not in the MJCF.",
        "Fixed joints 'bolt', 'wrist' are not in the MJCF.",
        "The velocity limit of joint 'shoulder', 3 rad/s, is not in the MJCF.",
        "2 visual shapes are not in the MJCF.",
        "Elements 'gazebo', 'safety_controller' are not in the MJCF.",
    )


@pytest.mark.parametrize(
    ("was", "becomes", "words"),
    [
        (
            'range="-1.2',
            'limited="false" range="-1.2',
            "The limits of joint 'shoulder', -1.23457 to 2 rad, are",
        ),
        ("-1.23457 2", "-1.23 2", "The limits of joint 'shoulder', -1.23457 to 2 rad, are"),
        ("-10 10", "-1 1", "The effort limit of joint 'shoulder', 10 N m, is"),
        ("0.123457", "0.12", "The damping of joint 'shoulder', 0.123457 N m s/rad, is"),
        ('frictionloss="0.3"', "", "The friction of joint 'shoulder', 0.3 N m, is"),
    ],
)
def test_a_property_that_is_lost_or_changed(was, becomes, words):
    assert was in KEPT
    found = set(in_mjcf(FULL, KEPT.replace(was, becomes))) - set(in_mjcf(FULL, KEPT))
    assert found == {f"{words} not in the MJCF."}


@pytest.mark.parametrize(
    ("limits", "written"),
    [
        ("", 'limited="false"'),
        ('lower="1" upper="-1"', 'range="1 -1" limited="false"'),
        ('effort="0"', 'range="0 0" limited="false"'),
    ],
)
def test_limits_without_room_and_an_effort_of_zero_are_lost_in_mjcf(limits, written):
    effort = "" if "effort" in limits else 'effort="1e9"'
    text = arm(
        shoulder=joint(
            "shoulder", "ground", "upper", "revolute", f'<limit {limits} {effort} velocity="1e9"/>'
        )
    )
    found = [each for each in in_mjcf(text, written) if "'shoulder'" in each]
    assert any("The limits of joint 'shoulder'," in each for each in found)
    assert any("effort limit of joint 'shoulder', 0 N m" in each for each in found) != bool(effort)


def test_limits_the_wrong_way_round_are_lost_in_sdf():
    inside = '<limit lower="1" upper="-1" effort="1" velocity="1"/>'
    text = arm(shoulder=joint("shoulder", "ground", "upper", "revolute", inside))
    found = losses(text, sdf_of(text), "sdf")
    assert "The limits of joint 'shoulder', 1 to -1 rad, are not in the SDF." in found


def test_a_plain_arm_loses_little():
    text = robot(
        link("ground", ""),
        link("upper"),
        link("lower"),
        joint("shoulder", "ground", "upper", inside=axis("0 0 1")),
        joint("elbow", "upper", "lower", inside=at("1 0 0") + axis("0 0 1")),
    )
    assert losses(text, sdf_of(text), "sdf") == ("Link 'ground' is not in the SDF.",)
    assert in_mjcf(text, "") == ("Link 'ground' is not in the MJCF.",)
