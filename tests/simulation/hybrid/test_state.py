"""Hybrid states are values: nothing can change one."""

import pytest

from twolink.simulation.hybrid.state import HybridState, put

STATE = HybridState(0.0, (0.1, 0.2), (0.3, 0.4), (None, 0.5), frozenset(), (0, 0), (None, None))


@pytest.mark.parametrize("field", HybridState._fields)
def test_no_field_of_a_state_can_be_set(field):
    with pytest.raises(AttributeError):
        setattr(STATE, field, None)


def test_a_replaced_state_leaves_the_first_as_it_was():
    later = STATE._replace(t=1.0)
    assert (STATE.t, later.t) == (0.0, 1.0)
    assert later._replace(t=0.0) == STATE


@pytest.mark.parametrize(
    ("index", "expected"), [(0, ("x", 2, 3)), (1, (1, "x", 3)), (2, (1, 2, "x"))]
)
def test_one_value_is_put_in_another_place(index, expected):
    values = (1, 2, 3)
    assert put(values, index, "x") == expected
    assert values == (1, 2, 3)
