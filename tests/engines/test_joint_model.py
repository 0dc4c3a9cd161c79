"""Joint models of scenes: collected effects, and errors for unsupported ones."""

from dataclasses import replace

import pytest

from tests.verification.chains import GENERAL
from twolink import lagrange
from twolink.effects import smooth_loads
from twolink.effects.end_drag import EndDrag
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.motor_inertia import MotorInertia
from twolink.effects.pd_control import PdControl
from twolink.engines.joint_model import JOINTS, joint_model, why_not
from twolink.errors import EngineError
from twolink.scene import Scene

SCENE = Scene(GENERAL, (0.3, -0.4), (0.7, 1.9), 1.0)
EFFECTS = (
    Gravity(9.0, (0.6, 0.8)),
    Gravity(1.0),
    JointDamping((0.3, 0.2)),
    JointSpring((4.0, 3.0), (0.2, -0.3)),
    JointSpring((1.0, 0.0), (-0.5, 9.0)),
    PdControl((0.1, 0.2), (2.0, 3.0), (0.15, 0.1)),
    JointTorque((0.5, -0.4), (2.0, 1.5), (3.0, 4.0), (0.3, 0.2)),
)


def torques_in_joints(model, theta, speed, t):
    """The force of the model, by the formula in its docstring."""
    from math import sin

    found = [
        model.torque[i]
        - model.stiffness[i] * (theta[i] - model.rest[i])
        - model.damping[i] * speed[i]
        for i in (0, 1)
    ]
    for wave in model.waves:
        found[wave.joint] += wave.amplitude * sin(wave.frequency * t + wave.phase)
    return found


def test_the_joint_model_has_the_torques_of_the_effects():
    scene, t = replace(SCENE, effects=EFFECTS), 0.7
    model = joint_model(scene)
    loads = smooth_loads(EFFECTS[2:], GENERAL, scene.q, scene.u, t)
    wanted = JOINTS.joint_forces(lagrange.generalized_active_force(GENERAL, scene.q, loads))
    found = torques_in_joints(model, model.theta, model.theta_speed, t)
    assert found == pytest.approx(wanted, rel=1e-14)
    assert model.gravity == pytest.approx((5.4, 8.2))
    assert model.uses == {"torque", "stiffness", "damping", "waves"}


def test_one_spring_keeps_its_rest_to_the_last_bit():
    model = joint_model(replace(SCENE, effects=(JointSpring((1e10, 3.0), (0.1, 0.7)),)))
    assert (model.stiffness, model.rest, model.torque) == ((1e10, 3.0), (0.1, 0.7), (0.0, 0.0))


def test_springs_that_cancel_leave_a_torque():
    springs = JointSpring((2.0, 0.0), (0.5, 0.0)), JointSpring((-2.0, 0.0), (0.1, 0.0))
    model = joint_model(replace(SCENE, effects=springs))
    assert model.torque == pytest.approx((0.8, 0.0))
    assert model.stiffness == (0.0, 0.0)
    assert model.uses == {"torque"}


@pytest.mark.parametrize(
    ("effect", "uses"),
    [
        (JointSpring((-1.0, 0.0)), {"stiffness", "push"}),
        (PdControl((0.0, 0.0), (2.0, -3.0), (0.0, 0.0)), {"stiffness", "push"}),
        (PdControl((0.0, 0.0), (0.0, 0.0), (0.0, -0.1)), {"damping", "drive"}),
    ],
)
def test_negative_numbers_are_uses_of_their_own(effect, uses):
    assert joint_model(replace(SCENE, effects=(effect,))).uses == uses


@pytest.mark.parametrize(
    "motors",
    [
        MotorInertia((0.02, 0.03), (3.0, 5.0), carried=False),
        MotorInertia((0.02, 0.03), (3.0, 1.0)),
        MotorInertia((0.02, 0.0), (3.0, 7.0)),
    ],
)
def test_rotors_become_armature_or_part_of_link_2(motors):
    scene = replace(SCENE, effects=(motors,))
    model = joint_model(scene)
    assert not model.chain.rotors
    (M11, M12), (M21, M22) = JOINTS.joint_matrix(lagrange.mass_matrix(model.chain, scene.q))
    J1, J2 = model.armature
    wanted = JOINTS.joint_matrix(lagrange.mass_matrix(scene.moving_chain, scene.q))
    found = [M11 + J1, M12, M21, M22 + J2]
    assert found == pytest.approx([*wanted[0], *wanted[1]], rel=1e-14)


def test_a_rotor_that_is_carried_and_geared_has_no_place():
    scene = replace(SCENE, effects=(MotorInertia((0.02, 0.03), (3.0, 5.0)),))
    with pytest.raises(EngineError, match="carries the rotor of B"):
        joint_model(scene)


@pytest.mark.parametrize(
    ("effect", "sentence"),
    [
        (EndDrag(1.0), "E cannot express the scene: end_drag is neither gravity nor"),
        (JointFriction((1.0, 1.0)), "E cannot express joint_friction: it creeps"),
        (JointDamping((1.0, 0.0)), "E cannot express a joint's damping: it has no such element"),
        (PdControl((0, 0), (0, 0), (-1.0, 0)), "E cannot express a joint's damping"),
    ],
)
def test_reasons_are_one_sentence(effect, sentence):
    reasons = {"joint_friction": "it creeps"}
    found = why_not(replace(SCENE, effects=(effect,)), "E", frozenset(), reasons)
    assert found.startswith(sentence)
    assert why_not(replace(SCENE, effects=(Gravity(),)), "E", frozenset(), reasons) is None
