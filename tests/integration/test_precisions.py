"""The registry of precisions."""

from typing import get_args

import numpy as np
import pytest

from twolink.integration.precisions import PRECISIONS, PrecisionName, longer_than


def test_every_name_has_a_precision_and_longer_ones_follow():
    assert tuple(PRECISIONS) == get_args(PrecisionName)
    roundings = [precision.rounding for precision in PRECISIONS.values()]
    assert roundings == sorted(roundings, reverse=True)


@pytest.mark.parametrize("precision", PRECISIONS.values(), ids=tuple(PRECISIONS))
def test_one_plus_the_rounding_is_the_number_after_one(precision):
    one, rounding = precision.number(1), precision.number(precision.rounding)
    assert one + rounding > one
    assert one + rounding / precision.number(2) == one


@pytest.mark.parametrize("precision", PRECISIONS.values(), ids=tuple(PRECISIONS))
def test_arrays_have_the_numbers_of_the_precision(precision):
    found = precision.array(np.array([0.5, 1.5]))
    assert [float(value) for value in found] == [0.5, 1.5]
    assert float(found[0] + precision.number(precision.rounding)) == 0.5 + precision.rounding


@pytest.mark.parametrize("precision", PRECISIONS.values(), ids=tuple(PRECISIONS))
def test_the_order_of_the_step_tolerance_is_odd_and_the_full_one_by_default(precision):
    assert precision.full_order % 2 == precision.truncated_order % 2 == 1
    assert precision.step_tolerance() == precision.step_tolerance(precision.full_order)
    assert precision.step_tolerance() < precision.step_tolerance(precision.truncated_order)


@pytest.mark.parametrize("precision", PRECISIONS.values(), ids=tuple(PRECISIONS))
def test_numbers_that_mix_with_float64_are_rounded_to_long_double_at_most(precision):
    third = precision.number(1) / precision.number(3)
    found = precision.mixable(np.array([third]))
    rounding = max(precision.rounding, float(np.finfo(np.longdouble).eps))
    assert abs(float(3.0 * found[0] - 1)) <= 2 * rounding
    assert (2.0 * found).dtype == found.dtype


@pytest.mark.parametrize("precision", PRECISIONS)
def test_numbers_are_lengthened_without_loss(precision):
    own = PRECISIONS[precision]
    shorter = [name for name in PRECISIONS if PRECISIONS[name].rounding >= own.rounding]
    for name in shorter:
        values = PRECISIONS[name].array([1.0, -2.0]) / PRECISIONS[name].number(3)
        found = own.lengthened(values)
        assert found.dtype == np.dtype(own.number)
        back = PRECISIONS[name].mixable(found) if name != "double" else found.astype(float)
        assert np.array_equal(back, PRECISIONS[name].mixable(values))


def test_the_next_longer_precision():
    assert longer_than("double") == "long double"
    assert longer_than("long double") == "quadruple"
    with pytest.raises(IndexError):
        longer_than("quadruple")
