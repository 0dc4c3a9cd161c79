"""Values: immutable objects, compared by content."""

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.values import Content, Own, content, is_value


@dataclass
class Open:
    x: float


@dataclass(frozen=True)
class Frozen:
    x: object
    hidden: object = field(default=None, compare=False)


class Derived(Frozen):
    """Not a data class of its own: it may have other attributes."""

    def __init__(self, x, more):
        super().__init__(x)
        object.__setattr__(self, "more", more)


class Same(Frozen):
    """Not a data class of its own, with the same fields."""


class Plain:
    pass


class Kind(Enum):
    ONE = 1
    UNO = 1.0


@pytest.mark.parametrize(
    "value", [1, 0.5, "a", None, True, 1j, np.longdouble(0.1), (1, (2.0,)), Kind.ONE, Gravity()]
)
def test_immutable_objects_are_values(value):
    assert is_value(value)
    assert content(value) == content(value)


@pytest.mark.parametrize(
    "thing", [[1], {}, {1}, np.zeros(2), Plain(), Open(1.0), Frozen([1]), Frozen(Plain()), len, int]
)
def test_mutable_objects_are_no_values(thing):
    assert not is_value(thing)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (0.0, -0.0),
        (1, 1.0),
        (1, True),
        ((1,), (1.0,)),
        (Frozen(1.0, 2.0), Frozen(1.0, 3.0)),
        (Frozen((1,)), Frozen((1.0,))),
        (Chain.uniform_bars(), replace(Chain.uniform_bars(), _exact_inertia=None)),
    ],
)
def test_different_values_have_different_content(one, other):
    assert content(one) != content(other)


def test_an_object_with_attributes_that_are_no_fields_is_no_value():
    assert not is_value(Derived(1.0, 2.0))
    assert Content((Derived(1.0, 2.0),)) != Content((Derived(1.0, 3.0),))
    assert is_value(Same(1.0))
    assert content(Same(1.0)) != content(Frozen(1.0))


def test_like_objects_share_a_key_if_they_are_values():
    assert Content((Gravity(), 1)) == Content((Gravity(), 1))
    assert hash(Content((Gravity(),))) == hash(Content((Gravity(),)))
    assert Content((Gravity(),)) != Content((Gravity(9.8),))


def test_the_content_of_mutable_objects_is_equal_within_one_run_only():
    thing, own = Plain(), Own()
    assert Content((thing,)) != Content((thing,))
    assert Content((thing,), own) == Content((thing,), own)
    assert Content((thing,), own) != Content((Plain(),), own)
