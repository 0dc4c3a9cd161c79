"""Fitted exponents of errors with known exponents."""

import numpy as np
import pytest

from twolink.accuracy.error_growth import ErrorGrowth, binned, fit_growth

TIMES = np.logspace(0, 4, 321)


def walks(random, starts: int) -> np.ndarray:
    """Return random walks (n, starts) at the times: each goes on from where it was."""
    steps = np.sqrt(np.diff(TIMES, prepend=0.0))
    return np.cumsum(steps[:, None] * random.standard_normal((len(TIMES), starts)), axis=0)


@pytest.mark.parametrize("power", [0.0, 0.5, 1.0, 2.0])
def test_a_pure_power_is_found(power):
    errors = 1e-9 * TIMES[:, None] ** power * np.array([1.0, -2.0, 3.0])
    found = fit_growth(binned(TIMES, errors), start=10.0)
    assert found.exponent == pytest.approx(power, abs=1e-3)
    assert found.uncertainty < 1e-3
    assert 10 <= found.start < 13
    assert 8e3 < found.end < 1e4


@pytest.mark.slow
def test_the_uncertainty_of_random_walks_is_that_of_many_repeats(random):
    found = [fit_growth(binned(TIMES, walks(random, 16)), start=10.0) for _ in range(200)]
    exponents = np.array([one.exponent for one in found])
    reported = np.sqrt(np.mean([one.uncertainty**2 for one in found]))
    assert exponents.mean() == pytest.approx(0.5, abs=0.03)
    # The jackknife's square is right or too large on the mean (Efron and Stein).
    assert 0.9 < reported / exponents.std() < 1.5


def test_an_oscillating_error_has_an_exponent_of_zero(random):
    errors = np.sin(TIMES[:, None] * np.array([1.0, 1.1, 1.2, 1.3]))
    found = fit_growth(binned(TIMES, errors), start=10.0)
    assert abs(found.exponent) < 0.05


def test_bins_are_evenly_spaced_in_the_logarithm_of_time():
    measured = binned(TIMES, np.ones((len(TIMES), 2)))
    assert len(measured.times) == 41
    assert measured.times == pytest.approx(
        measured.times[-1] * 10 ** np.arange(-4, 0.01, 0.1), rel=0.2
    )
    assert measured.rms == pytest.approx(1.0)


def test_too_few_errors_give_no_exponent():
    assert fit_growth(binned(TIMES, np.zeros((len(TIMES), 4))), start=1.0) is None
    assert fit_growth(binned(TIMES, np.ones((len(TIMES), 1))), start=1.0) is None
    assert fit_growth(binned(TIMES, np.ones((len(TIMES), 4))), start=7e3) is None
    assert fit_growth(binned(np.empty(0), np.empty((0, 4))), start=1.0) is None


def test_an_exponent_that_rounds_to_zero_has_no_sign():
    assert ErrorGrowth(-0.004, 0.01, 1.0, 2.0).rounded == "0.00"
    assert ErrorGrowth(-0.006, 0.01, 1.0, 2.0).rounded == "-0.01"
    assert ErrorGrowth(1.004, 0.01, 1.0, 2.0).rounded == "1.00"
