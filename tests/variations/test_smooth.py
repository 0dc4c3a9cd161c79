from dataclasses import replace

import pytest

from twolink.effects import JointFriction
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.variations.smooth import check_smooth


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("drop", "got Surface, which has modes and events: runs of `sweep`"),
        ("joint_stops", "got JointStop A, which has modes and events"),
        ("stick_slip", "which has modes and events"),
        ("hertz_bounce", "got CompliantSurface, which has modes and events"),
        ("sampled_torque", "got SampledTorque, which has corners in time"),
    ],
)
def test_a_scene_with_events_is_refused_by_the_name_of_the_effect(name, sentence):
    with pytest.raises(SimulationError, match=r"a scene must be smooth") as raised:
        check_smooth(Scene.load(name))
    assert sentence in str(raised.value)


def test_friction_of_no_size_is_smooth():
    scene = Scene.load("general")
    scene = replace(scene, effects=(*scene.effects, JointFriction((0.0, 0.0))))
    check_smooth(scene)


@pytest.mark.parametrize("name", ["general", "free_fall", "acrobot", "small_swings"])
def test_smooth_scenes_pass(name):
    check_smooth(Scene.load(name))


def test_corners_in_time_are_no_modes():
    scene = Scene.load("sampled_torque")
    check_smooth(scene, corners=True)
    with pytest.raises(SimulationError, match="got JointFriction, which has modes and events"):
        check_smooth(
            replace(scene, effects=(*scene.effects, JointFriction((0.1, 0.0)))), corners=True
        )
