"""Methods of fixed steps: the iteration of an implicit step."""

import numpy as np
import pytest

from twolink.errors import IntegrationError
from twolink.integration.methods import NUMERIC_METHODS

IMPLICIT = ("gauss-legendre-4", "gauss-legendre-6", "implicit-midpoint")


def controlled(stiffness, damping):
    """Return the rates of two masses at springs and dampers; at rest the terms cancel."""

    def rates(t, x):
        forces = stiffness / 3 - stiffness * x[:2] - damping * x[2:]
        return np.concatenate([x[2:], forces])

    return rates


@pytest.mark.parametrize("name", IMPLICIT)
def test_a_stiff_motion_near_rest_converges(name):
    """Its slopes are round-off of large terms, which does not shrink with them."""
    start = [1 / 3 + 1e-9, 1 / 3, 0.0, 0.0]
    times = np.array([0.0, 20.0])
    found, _ = NUMERIC_METHODS[name].integrate(controlled(300.0, 20.0), times, start, 0.02)
    assert found[:, -1] == pytest.approx([1 / 3, 1 / 3, 0.0, 0.0], abs=1e-13)


@pytest.mark.parametrize("name", IMPLICIT)
def test_an_iteration_that_diverges_is_an_error(name):
    times = np.array([0.0, 1.0])
    with pytest.raises(IntegrationError, match="iteration of an implicit step did not converge"):
        NUMERIC_METHODS[name].integrate(controlled(300.0, 200.0), times, [1.0, 0.0, 0.0, 0.0], 0.1)
