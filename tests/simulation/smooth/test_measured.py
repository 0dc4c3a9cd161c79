"""A motion with its measured error."""

import numpy as np

from twolink.simulation.smooth.measured import Measured


def test_the_worst_error_is_the_largest_of_all_times():
    assert Measured(None, np.array([0.0, 3e-9, 1e-9]), ()).worst == 3e-9
    assert Measured(None, np.array([0.0, np.inf]), ()).worst == np.inf
