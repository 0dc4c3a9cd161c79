import math

import numpy as np

from twolink.ensembles.comparisons import largest, size, smallest, total
from twolink.optional import heyoka

NAMES = heyoka().make_vars("x", "y", "z")


def value(expression, *numbers):
    function = heyoka().cfunc([expression], NAMES)
    return function(np.array(numbers, float))[0]


def test_sums_and_sizes():
    assert value(total(list(NAMES)), 1.0, 2.0, -4.0) == -1.0
    assert value(size(NAMES[0]), -3.0, 0.0, 0.0) == 3.0
    assert value(size(NAMES[0]), 3.0, 0.0, 0.0) == 3.0


def test_largest_and_smallest():
    assert value(largest(*NAMES), 1.0, 5.0, -7.0) == 5.0
    assert value(smallest(*NAMES), 1.0, 5.0, -7.0) == -7.0


def test_later_values_that_are_not_numbers_do_not_count():
    assert value(largest(*NAMES), 1.0, math.nan, 2.0) == 2.0
    assert value(smallest(*NAMES), 1.0, math.nan, 2.0) == 1.0
