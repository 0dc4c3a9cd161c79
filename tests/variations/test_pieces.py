from fractions import Fraction

import numpy as np
import pytest

from tests.variations.cases import TORQUES, family
from twolink.effects import pieces_at
from twolink.ensembles.numbers import numbers_in
from twolink.variations.directions import directions
from twolink.variations.pieces import slopes_of_pieces, varies_pieces


def with_torques(interpolation):
    scene = TORQUES | {"effects": {**TORQUES["effects"]}}
    scene["effects"]["sampled_torque"] = {
        **TORQUES["effects"]["sampled_torque"],
        "interpolation": interpolation,
    }
    return scene


def numbers_at(scene, t):
    return np.array(numbers_in((scene.moving_chain, pieces_at(scene.effects, t)))[0])


@pytest.mark.parametrize("interpolation", ["hold", "linear", "cubic"])
@pytest.mark.parametrize("t", [0.0, 0.35, 0.5, 1.25])
def test_slopes_are_differences_of_the_pieces_of_neighbours(interpolation, t):
    names = ("effects.sampled_torque.A.2", "chain.mass.1", "effects.joint_damping.coefficient.0")
    own = family(with_torques(interpolation), *names)
    scene = own.scene(own.values)
    for k, along in enumerate(directions(own)):
        ends = []
        for sign in (1, -1):
            values = [*own.values]
            values[k] += sign * 0.0625
            ends.append(numbers_at(own.scene(values), t))
        expected = (ends[0] - ends[1]) / 0.125
        # Coefficients of some hundreds have roundings of 1e-14 each, several of them.
        assert slopes_of_pieces(scene, along)(t) == pytest.approx(
            expected, rel=0, abs=1e-12 / 0.125
        )
        assert varies_pieces(scene, along) == (k == 0)


def test_a_line_between_samples_has_the_slopes_of_the_hat_function():
    own = family(with_torques("linear"), "effects.sampled_torque.B.1")
    scene = own.scene(own.values)
    (along,) = directions(own)
    times = TORQUES["effects"]["sampled_torque"]["times"]
    rise = 1 / (Fraction(times[2]) - Fraction(times[1]))
    # The start of the piece, which stays, then the coefficients at A and at B.
    assert slopes_of_pieces(scene, along)(times[1])[-5:] == (0.0, 0.0, 0.0, 1.0, -rise)
    assert slopes_of_pieces(scene, along)(times[2])[-5:] == (0.0,) * 5
