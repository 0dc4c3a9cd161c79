from dataclasses import fields

import pytest

from twolink.chain import Chain, Rotor
from twolink.effects import Gravity, JointTorque, MotorInertia
from twolink.ensembles.numbers import numbers_in, with_numbers

CHAIN = Chain.uniform_bars((1.0, 2.0), (0.5, 0.7))
EFFECTS = (Gravity(3.7), JointTorque(amplitude=(1.0, 2.0)), MotorInertia((0.1, 0.2)))


@pytest.mark.parametrize("thing", [CHAIN, EFFECTS, EFFECTS[2].with_rotors(CHAIN)])
def test_an_object_with_its_own_numbers_is_equal_to_it(thing):
    numbers, shape = numbers_in(thing)
    made = with_numbers(thing, iter(numbers))
    assert numbers_in(made) == (numbers, shape)
    assert made == thing


def test_each_number_is_found_once_and_set_alone():
    numbers, shape = numbers_in(CHAIN)
    assert len(numbers) == 10
    for place in range(len(numbers)):
        others = [*numbers[:place], 42.0, *numbers[place + 1 :]]
        found, same = numbers_in(with_numbers(CHAIN, iter(others)))
        assert found == others
        assert same == shape


def test_derived_values_are_dropped_when_the_numbers_change():
    assert CHAIN.m2 == 2.0
    heavier = with_numbers(CHAIN, iter([1.0, 3.0, *numbers_in(CHAIN)[0][2:]]))
    assert heavier.m2 == 3.0
    assert heavier._exact_inertia is None


def test_things_that_differ_in_more_than_numbers_have_other_keys():
    with_rotor = Chain(
        CHAIN.mass, CHAIN.length, CHAIN.centre, CHAIN.inertia, (Rotor(0.1, (1.0, 0.0)),)
    )
    assert numbers_in(CHAIN)[1] != numbers_in(with_rotor)[1]
    assert numbers_in((Gravity(),))[1] != numbers_in((JointTorque(),))[1]
    carried, not_carried = (MotorInertia((0.1, 0.2), carried=c) for c in (True, False))
    assert numbers_in(carried)[1] != numbers_in(not_carried)[1]
    assert {field.name for field in fields(CHAIN)} >= {"mass", "rotors"}
