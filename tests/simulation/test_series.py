"""Powers of the lengths of steps, in any precision."""

import numpy as np
import pytest

from twolink.simulation.series import powers, powers_of


@pytest.mark.parametrize("kind", [float, np.longdouble])
def test_powers_start_with_one(kind):
    found = powers(np.array([2, 0.5], dtype=kind), 4)
    assert found.dtype == np.dtype(kind)
    assert found.tolist() == [[1, 2, 4, 8], [1, 0.5, 0.25, 0.125]]


@pytest.mark.parametrize("kind", [float, np.longdouble])
def test_powers_of_one_length_are_those_among_others(kind, random):
    lengths = random.uniform(-2, 2, 5).astype(kind)
    together = powers(lengths, 24)
    for place, row in enumerate(together):
        assert (powers_of(lengths[place : place + 1], 24) == row).all()
