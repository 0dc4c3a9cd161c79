"""Variables of the kept quantities: shapes, types, units and words."""

import numpy as np
import pytest

from tests.ensembles.cases import axis, ensemble
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.quantities import QUANTITIES

VALUES = {
    "final": True,
    "energy": True,
    "extremes": True,
    "extreme_speeds": True,
    "impacts": True,
    "samples": 4,
    "first": [{"of": "q1"}],
}


def test_every_key_is_tested_here():
    assert set(VALUES) == set(QUANTITIES)


@pytest.mark.parametrize("scene", ["free_fall", "bounce_to_rest"])
@pytest.mark.parametrize("key", VALUES)
def test_values_have_the_shape_and_the_type_of_their_variables(key, scene):
    asked = ensemble(
        scene=scene,
        axes=[axis("start.q.0", 0.1, 0.2)],
        runs={"duration": 0.3},
        keep={key: VALUES[key]},
    )
    rows = rows_of(asked, 0, 2)
    assert not any(rows.reasons)
    (quantity,) = asked.kept
    for variable in quantity.variables:
        found = rows.arrays[variable.name]
        empty = variable.empty(2)
        assert (found.shape, found.dtype) == (empty.shape, empty.dtype)
        if variable.dtype == "f8" and key != "first":
            assert np.isfinite(found).all()
            assert variable.units or key == "impacts"
        assert variable.words


@pytest.mark.parametrize("key", ["final", "energy", "extremes", "extreme_speeds", "impacts"])
def test_quantities_set_to_false_are_not_kept(key):
    assert ensemble(keep={key: False}).kept == ()
