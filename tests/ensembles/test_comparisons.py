import math
from fractions import Fraction

import numpy as np

from twolink.ensembles.comparisons import largest, size, smallest, total, two_sum
from twolink.optional import heyoka

NAMES = heyoka().make_vars("x", "y", "z")


def value(expression, *numbers):
    function = heyoka().cfunc([expression], NAMES)
    return function(np.array(numbers, float))[0]


def test_sums_and_sizes():
    assert value(total(list(NAMES)), 1.0, 2.0, -4.0) == -1.0
    assert value(size(NAMES[0]), -3.0, 0.0, 0.0) == 3.0
    assert value(size(NAMES[0]), 3.0, 0.0, 0.0) == 3.0


def test_a_sum_and_its_rest_are_exact(random):
    high, low = two_sum(*NAMES[:2])
    numbers = random.normal(size=(20, 2)) * 10.0 ** random.integers(-20, 20, (20, 2))
    for a, b in numbers.tolist():
        assert value(high, a, b, 0.0) == a + b
        rest = value(low, a, b, 0.0)
        assert Fraction(a) + Fraction(b) == Fraction(a + b) + Fraction(rest)


def test_largest_and_smallest():
    assert value(largest(*NAMES), 1.0, 5.0, -7.0) == 5.0
    assert value(smallest(*NAMES), 1.0, 5.0, -7.0) == -7.0


def test_later_values_that_are_not_numbers_do_not_count():
    assert value(largest(*NAMES), 1.0, math.nan, 2.0) == 2.0
    assert value(smallest(*NAMES), 1.0, math.nan, 2.0) == 1.0
