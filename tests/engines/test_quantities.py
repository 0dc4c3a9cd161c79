"""Answers as arrays: their shapes, and numbers that are not finite."""

import numpy as np
import pytest

from twolink.engines.faults import EngineFault, FaultKind
from twolink.engines.quantities import QUANTITIES


def test_the_strings_nan_and_inf_are_numbers():
    found = QUANTITIES["gravity_terms"].array([[1, "nan"], ["-inf", 2.5]], 2, from_urdf=False)
    assert np.array_equal(found, [[1.0, np.nan], [-np.inf, 2.5]], equal_nan=True)


def test_vectors_of_a_file_are_spatial():
    position = QUANTITIES["position"]
    assert position.array([[1.0, 2.0, 3.0]], 1, from_urdf=True).shape == (1, 3)
    with pytest.raises(EngineFault, match="must be 1 × 2 numbers; got 1 × 3"):
        position.array([[1.0, 2.0, 3.0]], 1, from_urdf=False)


@pytest.mark.parametrize(
    "values", [[], [1.0] * 6, [[1.0, 2.0]] * 5, [[1.0, 2.0, 3.0]] * 6, [[True, False]] * 6]
)
def test_other_shapes_are_faults(values):
    with pytest.raises(EngineFault, match="wrong length") as caught:
        QUANTITIES["gravity_terms"].array(values, 6, from_urdf=False)
    assert caught.value.kind is FaultKind.WRONG_LENGTH
