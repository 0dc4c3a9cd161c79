"""The differences at all states are consistent with the verdict."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.conftest import SEED
from twolink import kane
from twolink.data import data_path
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.errors import ParameterError
from twolink.formulations import Formulation
from twolink.urdf import read_planar_urdf
from twolink.verification import verify
from twolink.verification.differences import differences
from twolink.verification.states import random_states

SHIPPED = read_planar_urdf(data_path("twolink.urdf"))


@pytest.mark.slow
def test_the_largest_is_that_of_the_verdict():
    """Over more than one portion of states, and in the state that the verdict names."""
    found = differences(SHIPPED, states=4500, seed=SEED)
    verdict = verify(SHIPPED, states=4500, seed=SEED)
    assert len(found) == len(verdict.comparisons)
    portions = [random_states(4000, seed=(SEED, 0)), random_states(500, seed=(SEED, 1))]
    angles = np.concatenate([portion.angles for portion in portions], axis=1)
    for each, comparison in zip(found, verdict.comparisons, strict=True):
        of_verdict = comparison.quantity, comparison.source, comparison.against
        assert (each.quantity, each.source, each.against) == of_verdict
        assert each.shares.shape == (4500,)
        assert each.shares.max() == pytest.approx(comparison.share, rel=1e-12)
        if "angles" in comparison.state:
            worst = angles[:, np.argmax(each.shares)]
            assert list(worst) == comparison.state["angles"]


def test_a_wrong_formula_exceeds_the_tolerance_in_most_states():
    broken = SimpleNamespace(**vars(kane))
    broken.velocity_terms = lambda chain, q, u: tuple(-x for x in kane.velocity_terms(chain, q, u))
    formulations = {"kane": Formulation("Kane", broken, kane.partial_velocities)}
    found = {
        (each.quantity, each.against.split()[0]): each.shares
        for each in differences(SHIPPED, states=200, seed=SEED, formulations=formulations)
    }
    assert np.median(found["velocity terms", "Pinocchio"]) > 1e6
    assert found["mass matrix", "Pinocchio"].max() < 1


def test_less_than_one_state_is_refused():
    with pytest.raises(ParameterError, match=r"states must be .*; got 0"):
        differences(SHIPPED, states=0, engine=PinocchioChain(SHIPPED))
