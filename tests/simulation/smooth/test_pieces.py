from dataclasses import replace

import numpy as np

from twolink.effects.sampled_torque import PolynomialTorque, SampledTorque
from twolink.scene import Scene
from twolink.simulation.smooth.pieces import pieces_of

TORQUE = SampledTorque((0.25, 0.5, 2.0), (1.0, 2.0, 3.0), (0.0, 0.0, 0.0), "hold")
SCENE = Scene.load("general")


def test_pieces_begin_and_end_at_discontinuities_and_share_no_time_inside():
    scene = replace(SCENE, effects=(*SCENE.effects, TORQUE))
    found = list(pieces_of(scene, np.array([0.0, 0.25, 0.4, 1.0])))
    assert [times.tolist() for times, _ in found] == [[0.0, 0.25], [0.25, 0.4, 0.5], [0.5, 1.0]]
    torques = [effects[-1] for _, effects in found]
    assert all(isinstance(torque, PolynomialTorque) for torque in torques)
    assert [torque.coefficients[0] for torque in torques] == [(1.0,), (1.0,), (2.0,)]


def test_a_smooth_scene_is_one_piece():
    times = np.array([0.0, 0.5, 1.0])
    ((own, effects),) = pieces_of(SCENE, times)
    assert own.tolist() == times.tolist()
    assert effects == SCENE.effects
