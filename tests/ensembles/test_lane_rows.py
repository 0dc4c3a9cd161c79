import numpy as np

from twolink.ensembles.deviations import INDICES
from twolink.ensembles.lane_rows import FREQUENCY, LAST, LEFT, ROWS, STEPS, Rows


def test_the_places_of_rows():
    rows = Rows.of(list(range(ROWS)))
    assert (rows.last, rows.left, rows.frequency, rows.steps) == (LAST, LEFT, FREQUENCY, STEPS)
    assert len(rows.shape) == len(INDICES)
    assert rows.steps == ROWS - 1


def test_parts_are_views_without_a_gap():
    array = np.zeros((ROWS, 3))
    rows = Rows.of(array)
    for number, part in enumerate(rows, start=1):
        part[...] += number
    assert (array > 0).all()
    assert array.sum() == sum(number * part.size for number, part in enumerate(rows, start=1))
