"""Scenes as parameters of the protocol and back."""

import pytest

from twolink.chain import Chain
from twolink.effects import (
    Gravity,
    JointDamping,
    JointFriction,
    JointSpring,
    JointStop,
    MotorInertia,
    Surface,
)
from twolink.engines.messages import Parameters
from twolink.engines.scenes import joint_state, parameters_of, scene_of
from twolink.errors import EngineError
from twolink.scene import Scene

SCENE = Scene(
    chain=Chain.uniform_bars(),
    q=(0.25, -0.5),
    u=(1.0, 0.5),
    duration=2.0,
    effects=(
        Gravity(9.81),
        JointDamping((0.1, 0.2)),
        JointFriction((0.3, 0.4), (0.5, 0.6)),
        JointSpring((6.0, 4.0), (0.2, -0.5)),
        JointStop("A", upper=1.2, restitution=0.5),
        JointStop("B", lower=-0.8, upper=0.6),
        Surface((0.0, 1.0), (0.0, -1.0), on=("B", "D"), restitution=0.4, friction=0.3, static=0.5),
    ),
)


def test_a_scene_survives_the_messages():
    parameters, effects = parameters_of(SCENE)
    assert effects == ("joint_damping", "joint_friction", "joint_spring", "joint_stop", "surface")
    sent = Parameters.model_validate_json(parameters.line())
    angles, speeds = joint_state(SCENE)
    assert angles == (0.25, -0.75)
    back = scene_of(sent, angles, speeds, 2.0)
    assert (back.q, back.u) == (SCENE.q, SCENE.u)
    assert back.chain == SCENE.chain
    assert back.effects[:-1] == SCENE.effects[:-1]
    assert back.effects[-1].on == ("B", "D")
    assert back.effects[-1].static == 0.5


def test_keys_of_effects_are_left_out_without_them():
    plain = Scene(
        chain=Chain.uniform_bars(),
        q=(0.0, 0.0),
        u=(0.0, 0.0),
        duration=1.0,
        effects=(Gravity(9.81),),
    )
    parameters, effects = parameters_of(plain)
    assert effects == ()
    for key in ("stiffness", "stops", "surfaces", "static_friction"):
        assert key not in parameters.line()


def of_effects(*effects):
    return Scene(
        chain=Chain.uniform_bars(), q=(0.1, 0.2), u=(0.0, 0.0), duration=1.0, effects=effects
    )


def test_gravity_has_the_sign_of_its_direction():
    parameters, _ = parameters_of(of_effects(Gravity(9.81, (0.0, -2.0))))
    assert parameters.gravity == -9.81


FLOOR = (0.0, 1.0), (0.0, -1.0)


@pytest.mark.parametrize(
    ("effects", "said"),
    [
        ((Gravity(9.81, (1.0, 0.0)),), "gravity along y alone; got the direction 1, 0"),
        ((Gravity(9.81), Gravity(1.0)), "one Gravity; got 2"),
        ((JointDamping((0.1, 0.1)), JointDamping((0.2, 0.2))), "one JointDamping; got 2"),
        ((JointSpring((1.0, 1.0)), JointSpring((2.0, 2.0))), "one JointSpring; got 2"),
        ((JointFriction((1.0, 1.0)), JointFriction((2.0, 2.0))), "one JointFriction; got 2"),
        ((Surface(*FLOOR, on=("C1", "D")),), "surfaces on B and D alone; got C1"),
        (
            (Surface(*FLOOR, restitution=0.5, friction=0.3, law="newton"),),
            "rough surfaces with the law stronge alone; got newton",
        ),
    ],
)
def test_what_the_messages_do_not_say_is_rejected(effects, said):
    with pytest.raises(EngineError, match=f"the protocol has {said}"):
        parameters_of(of_effects(*effects))


def test_without_friction_all_laws_of_restitution_are_one():
    parameters, _ = parameters_of(of_effects(Surface(*FLOOR, restitution=0.5, law="newton")))
    assert parameters.surfaces[0].restitution == 0.5


def test_other_effects_are_rejected():
    scene = Scene(
        chain=Chain.uniform_bars(),
        q=(0.0, 0.0),
        u=(0.0, 0.0),
        duration=1.0,
        effects=(MotorInertia((0.1, 0.1)),),
    )
    with pytest.raises(EngineError, match="the protocol has no MotorInertia"):
        parameters_of(scene)
