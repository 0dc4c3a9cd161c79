"""Orders of runs and of their judges, and differences of runs."""

from types import SimpleNamespace

import numpy as np
import pytest

from twolink.simulation.smooth import judging
from twolink.simulation.smooth.judging import apart, difference, order_for, truncation


@pytest.mark.parametrize("error", [1e-3, 1e-9, 1e-15, 1e-30])
def test_an_order_is_the_lowest_odd_one(error):
    order = order_for(error)
    assert order % 2 == 1
    assert order == judging._LOWEST_ORDER or truncation(order) <= error < truncation(order - 2)


def test_an_error_that_has_underflown_has_the_order_of_the_least_number():
    assert order_for(0.0) == order_for(5e-324) > 300


@pytest.mark.parametrize("error", [1.0, 1e308, float("inf")])
def test_a_large_error_has_the_lowest_order(error):
    assert order_for(error) == judging._LOWEST_ORDER


def run_of(values, kind=float):
    """Return a run with these angles, and speeds of zero."""
    q = np.array([values, [0.0] * len(values)], dtype=kind)
    return SimpleNamespace(q=q, u=0 * q)


def test_a_difference_is_the_largest_so_far():
    found = difference(run_of([0.0, 1.0, 2.0, 3.0]), run_of([0.0, 1.5, 2.25, 3.0]))
    assert found.tolist() == [0.0, 0.5, 0.5, 0.5]


def test_arrays_of_two_precisions_are_compared_in_the_longer_one():
    third = np.longdouble(1) / 3
    found = apart(np.array([1 / 3]), np.array([third]))
    assert found[0] == float(abs(third - np.longdouble(1 / 3))) > 0
