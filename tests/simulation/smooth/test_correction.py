"""The estimated error within steps, against more precise runs and against exact flows."""

import numpy as np
import pytest
from scipy.linalg import expm

from tests.simulation.smooth.test_measure import HARD
from tests.simulation.smooth.test_step_errors import observed
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth.correction import Correction, correction_of
from twolink.simulation.smooth.linear import Linear
from twolink.simulation.smooth.taylor import taylor_run


def linear_of(matrix, lengths):
    """Return steps of a linear motion with constant coefficients."""
    starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    flows = np.array([expm(h * matrix) for h in lengths])
    jacobians = np.broadcast_to(matrix, (3, len(lengths), 4, 4))
    return Linear(
        starts,
        np.array(lengths),
        np.zeros((len(lengths), 4)),
        jacobians,
        np.zeros((len(lengths), 4)),
        flows,
        np.zeros(len(lengths)),
        np.zeros((len(lengths), 4, 4)),
    )


def test_deviations_follow_the_linear_motion_within_steps(random):
    """Cubic within a step: half the step divides the error by 2⁴ or more."""
    matrix, start = random.normal(size=(4, 4)), random.normal(size=4)
    missed = []
    for h in (0.4, 0.2):
        linear = linear_of(matrix, [h] * 3)
        errors = np.array([expm(k * h * matrix) @ start for k in range(4)])
        found = correction_of([(linear, errors, np.zeros((3, 4)))], 15)
        times = np.linspace(0, 3 * h, 50)
        exact = np.array([expm(t * matrix) @ start for t in times]).T
        missed.append(np.abs(found.at(times) - exact).max())
        # At the ends of steps they are the errors themselves.
        ends = h * np.arange(4.0)
        assert found.at(ends) == pytest.approx(errors.T)
    assert missed[1] < missed[0] / 2**3.8
    assert missed[0] < 0.01 * np.abs(exact).max()


def test_the_defect_of_a_step_arises_at_its_end():
    found = Correction(np.zeros(1), np.ones(1), np.zeros((1, 4, 4)), np.ones((1, 4)), 15)
    assert found.at(np.array([0.0, 0.5, 1.0]))[0] == pytest.approx([0.0, 2.0**-16, 1.0])


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", ["reference", "chaotic", "one mass is 400 times the other"])
@pytest.mark.parametrize("order", [11, 15, 21])
def test_the_error_at_any_time_is_that_of_the_run(name, order):
    """Beside the largest error so far it misses a twentieth at most, within steps as well."""
    times = np.linspace(0, 10, 173)
    hard = HARD[name]
    exact = taylor_run(hard, times, formulation="momenta", precision="quadruple")
    run, errors = observed(hard, order, evaluated_in="long double")
    q, _ = run.dense()(times)
    own = PRECISIONS["quadruple"]
    true = own.mixable(exact.q - own.lengthened(q)).astype(float)
    small = errors.at(times) < 1e-6
    missed = np.abs(errors.correction().at(times)[:2] - true).max(axis=0)
    bound = errors.corrected_at(times) + 8 * 2**-52 * np.abs(q).max()
    assert np.all(missed[small] <= bound[small])
    assert np.count_nonzero(small) >= 20
