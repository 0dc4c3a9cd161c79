"""Points and links that users name: one sentence for those that no chain has."""

import math
from fractions import Fraction

import numpy as np
import pytest

from twolink.chain import Point
from twolink.errors import ParameterError
from twolink.points import as_link, as_point


@pytest.mark.parametrize(
    ("point", "sentence"),
    [
        ((1, 0.5, 0.0), "point must be a Point; got"),
        (Point(3, 0.0, 0.0), "point: link must be 1 or 2; got 3"),
        (Point(1.5, 0.0, 0.0), r"point: link must be 1 or 2; got 1\.5"),
        (Point(True, 0.0, 0.0), "point: link must be 1 or 2; got True"),
        (Point(1, "a", 0.0), "point: along must be a number; got 'a'"),
        (Point(2, 0.0, None), "point: across must be a number; got None"),
        (Point(2, math.nan, 0.0), "point: along must be a finite number of m; got nan"),
    ],
)
def test_points_of_no_link_are_refused(point, sentence):
    with pytest.raises(ParameterError, match=sentence):
        as_point("point", point)


def test_a_point_has_numbers_of_any_kind():
    assert as_point("point", Point(np.int64(2), Fraction(1, 3), 1)) == Point(2, Fraction(1, 3), 1)


@pytest.mark.parametrize("link", [0, 3, True, 1.0, "1", None, np.array([1, 2])])
def test_numbers_of_no_link_are_refused(link):
    with pytest.raises(ParameterError, match="link must be 1 or 2; got"):
        as_link("link", link)
