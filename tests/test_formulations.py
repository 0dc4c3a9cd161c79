"""The registry of formulations: each is complete, and both are of the same chain."""

import inspect
import typing

import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink import kane, lagrange
from twolink.formulations import FORMULATIONS, EquationsOfMotion
from twolink.loads import Force
from twolink.names import FORMULATION_NAMES, FormulationName


def test_both_formulations_are_registered_by_name():
    assert [f.equations for f in FORMULATIONS.values()] == [kane, lagrange]
    assert typing.get_args(FormulationName) == tuple(FORMULATIONS) == FORMULATION_NAMES


def test_every_function_of_the_contract_is_there():
    contract = {name for name in vars(EquationsOfMotion) if not name.startswith("_")}
    assert len(contract) == 8
    for found in FORMULATIONS.values():
        for name in contract:
            expected = list(inspect.signature(getattr(EquationsOfMotion, name)).parameters)[1:]
            assert list(inspect.signature(getattr(found.equations, name)).parameters) == expected


@pytest.mark.parametrize("name", FORMULATIONS)
def test_each_formulation_has_a_consistent_mass_matrix_and_force(name, random):
    """M is symmetric and positive, its determinant is its own, and the force of a load is its
    power by the speeds."""
    formulation = FORMULATIONS[name].equations
    for _ in range(20):
        q, u, force = (tuple(random.normal(size=2)) for _ in range(3))
        M = np.array(formulation.mass_matrix(GENERAL, q))
        assert pytest.approx(M.T) == M
        assert formulation.determinant(GENERAL, q) == pytest.approx(np.linalg.det(M), rel=1e-12)
        Q = formulation.generalized_active_force(GENERAL, q, (Force(GENERAL.D, force),))
        end = np.exp(1j * np.array(q)) * GENERAL.length * 1j * np.array(u)
        assert np.dot(Q, u) == pytest.approx(np.dot([end.sum().real, end.sum().imag], force))
        assert len(formulation.velocity_terms(GENERAL, q, u)) == 2
