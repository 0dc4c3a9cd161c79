"""Times of several sources are merged, without NumPy's masked arrays."""

import subprocess
import sys

import numpy as np

from twolink.times import merged


def test_times_rise_and_are_there_once():
    assert merged([0.0, 2.0], np.array([1.0, 2.0]), ()).tolist() == [0.0, 1.0, 2.0]


def test_the_type_of_numbers_is_kept():
    assert merged(np.array([1.0, 0.5], np.longdouble), [0.5]).dtype == np.longdouble


def test_masked_arrays_are_not_imported():
    program = "import sys\nfrom twolink.times import merged\nmerged([1.0], [2.0])\n"
    program += "assert 'numpy.ma' not in sys.modules"
    subprocess.run([sys.executable, "-c", program], check=True)
