"""The formulations of the simulator: both, and both of the same chain."""

import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink import kane, lagrange
from twolink.loads import Force
from twolink.simulation.hybrid.formulations import FORMULATIONS


def test_both_formulations_are_there_by_name():
    assert {"kane": kane, "lagrange": lagrange} == FORMULATIONS


@pytest.mark.parametrize("name", FORMULATIONS)
def test_each_has_what_a_mode_is_made_of(name, random):
    """M is symmetric and positive, its determinant is its own, and the force of a load is its
    power by the speeds."""
    formulation = FORMULATIONS[name]
    for _ in range(20):
        q, u, force = (tuple(random.normal(size=2)) for _ in range(3))
        M = np.array(formulation.mass_matrix(GENERAL, q))
        assert pytest.approx(M.T) == M
        assert formulation.determinant(GENERAL, q) == pytest.approx(np.linalg.det(M), rel=1e-12)
        Q = formulation.generalized_active_force(GENERAL, q, (Force(GENERAL.D, force),))
        end = np.exp(1j * np.array(q)) * GENERAL.length * 1j * np.array(u)
        assert np.dot(Q, u) == pytest.approx(np.dot([end.sum().real, end.sum().imag], force))
        assert len(formulation.velocity_terms(GENERAL, q, u)) == 2
