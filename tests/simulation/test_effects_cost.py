"""The cost of each effect in a step."""

from dataclasses import replace

from tests.verification.chains import GENERAL
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.scene import Scene
from twolink.simulation.effects_cost import effects_cost

SCENE = Scene(
    chain=GENERAL, q=(0.3, -0.4), u=(1.1, -0.7), duration=2.0, effects=(Gravity(),), accuracy=1e-11
)


def test_each_effect_has_a_cost():
    scene = replace(SCENE, effects=(Gravity(), JointDamping((0.2, 0.1))))
    cost = effects_cost(scene)
    assert set(cost.without) == {"Gravity", "JointDamping"}
    for step in cost.without.values():
        assert 0 < step.operations < cost.whole.operations
        assert step.seconds > 0
