import numpy as np
import pytest

from twolink.ensembles.carried_bounds import corrected, known, of_last_steps, uncorrected
from twolink.ensembles.lane_rows import ROWS, Rows


def rows_with(spread, shift, **parts):
    found = Rows.of(np.zeros((ROWS, 1)))
    found.spread[:], found.shift[:] = spread, shift
    for name, value in parts.items():
        getattr(found, name)[1] = value
    return found


def test_a_tenth_of_a_correction_is_added_to_the_region():
    rows = rows_with(spread=1e-6, shift=3e-6)
    assert corrected(rows)[0] == pytest.approx(1.3e-6)
    assert uncorrected(rows)[0] == pytest.approx(4.3e-6)


@pytest.mark.parametrize("part", ["centre", "shape"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_region_that_is_not_finite_is_unknown(part, value):
    rows = rows_with(1e-9, 1e-9, **{part: value})
    assert corrected(rows)[0] == uncorrected(rows)[0] == np.inf


def test_a_last_step_counts_by_its_tolerance_or_its_region_until_it_has_ended():
    rows = rows_with(spread=1e-6, shift=0.0)
    assert of_last_steps(rows, 1e-9)[0] == 0.0
    rows.last[:] = 0.1
    assert of_last_steps(rows, 1e-9)[0] == pytest.approx(1e-7)
    assert of_last_steps(rows, 1e-3)[0] == 1e-3


def test_large_bounds_are_unknown():
    assert uncorrected(rows_with(spread=0.02, shift=0.0))[0] == np.inf
    assert known(np.array([0.0, 0.009, 0.011, np.nan, np.inf])).tolist() == [
        True,
        True,
        *[False] * 3,
    ]
