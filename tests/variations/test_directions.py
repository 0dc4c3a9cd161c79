import numpy as np
import pytest

from tests.variations.cases import RICH, SPRING, TORQUES, family
from twolink.ensembles.numbers import numbers_in
from twolink.errors import SimulationError
from twolink.variations.directions import directions


def slopes(scene, *parameters):
    return directions(family(scene, *parameters))


def test_a_uniform_bar_changes_with_its_length_and_mass():
    by_length, by_mass = slopes("free_fall", "L1", "m2")
    # Masses, lengths, centres, inertias, g and its direction, in the order of the fields.
    L = m = 1.0
    assert by_length.numbers == pytest.approx(
        (0, 0, 1, 0, 0.5, 0, 0, 0, m * L / 6, 0, 0, 0, 0), abs=1e-15
    )
    assert by_mass.numbers == pytest.approx((0, 1, *[0] * 7, L**2 / 12, 0, 0, 0), abs=1e-15)
    assert by_length.q == by_length.u == by_mass.q == by_mass.u == (0.0, 0.0)


def test_a_number_that_stands_for_itself_has_a_slope_of_exactly_one():
    for name in ("chain.centre.1.1", "effects.joint_damping.coefficient.0", "effects.gravity.g"):
        (found,) = slopes(RICH, name)
        assert sorted(found.numbers)[-1] == 1.0
        assert np.count_nonzero(found.numbers) == 1
        assert found.doubt == 0.0


def test_joint_angles_move_both_links_as_their_convention_says():
    first, second, speed = slopes(RICH, "start.theta.0", "start.theta.1", "start.omega.1")
    # The angles are rounded when the offset is added.
    assert first.q == pytest.approx((1.0, 1.0), abs=1e-15)
    assert second.q == pytest.approx((0.0, -1.0), abs=1e-15)
    assert speed.q == (0.0, 0.0)
    assert speed.u == (0.0, -1.0)
    assert second.doubt < 1e-14


def test_gear_ratios_are_those_of_rotors():
    (found,) = slopes(RICH, "effects.motor_inertia.ratio.1")
    own = family(RICH)
    chain = own.scene([]).moving_chain
    place = len(numbers_in(chain)[0]) - 2
    # ω = u1 + n (u2 − u1) of the rotor at B.
    assert found.numbers[place : place + 2] == (-1.0, 1.0)


def test_a_number_at_the_edge_of_its_range_has_neighbours_on_one_side():
    scene = {**SPRING, "chain": {**SPRING["chain"], "inertia": [0.0, 0.5]}}
    (found,) = slopes(scene, "chain.inertia.0")
    assert sorted(found.numbers)[-2:] == [0.0, 1.0]


def test_a_number_without_which_the_scene_has_another_form_is_refused():
    # A rotor of no inertia is none.
    rotors = {"motor_inertia": {"inertia": [0.0, 0.002]}}
    with pytest.raises(SimulationError, match="must be a number that can be a little greater"):
        slopes({**RICH, "effects": rotors}, "effects.motor_inertia.inertia.0")


def test_a_number_that_moves_a_corner_in_time_is_refused():
    with pytest.raises(SimulationError, match=r"times\.1 must be a number that moves no "):
        slopes(TORQUES, "effects.sampled_torque.times.1")
    (by_sample,) = slopes(TORQUES, "effects.sampled_torque.A.1")
    assert sorted(by_sample.numbers)[-2:] == [0.0, 1.0]
