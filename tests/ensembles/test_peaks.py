import numpy as np
import pytest

from twolink.ensembles.peaks import WEIGHTS, bends, gain, raise_to_peaks, signed


def test_functions_are_both_numbers_the_difference_and_their_negatives():
    q = np.array([[1.0, 2.0], [5.0, 3.0]])
    assert signed(q).tolist() == (WEIGHTS @ q).tolist()
    assert signed(q.T, 1).tolist() == (q.T @ WEIGHTS.T).tolist()


def test_second_derivatives_are_bounded(random):
    coefficients, lengths = random.normal(size=(4, 2, 6, 3)), random.uniform(0.1, 2, (4, 1, 3))
    scaled = coefficients * lengths[:, :, None] ** np.arange(6.0)[:, None]
    found = bends(coefficients, lengths)
    for x in np.linspace(0, 1, 21):
        powers = [k * (k - 1) * x ** max(k - 2, 0) for k in range(6)]
        second = np.einsum("nvkl,k->nvl", scaled, powers)
        both = np.concatenate([second, second[:, 1:] - second[:, :1]], axis=1)
        assert (np.abs(both) <= found * (1 + 1e-12)).all()


def test_peaks_and_their_places_are_those_of_fine_samples(random):
    rows = random.normal(size=(9, 50)) / 1.5 ** np.arange(9)[:, None]
    bent = np.sum(np.abs(rows) * (np.arange(9) * np.arange(-1, 8))[:, None], axis=0)
    largest = np.full(50, -np.inf)
    places = raise_to_peaks(largest, np.arange(50), rows, bent)
    x = np.linspace(0, 1, 20_001)
    values = np.polynomial.polynomial.polyval(x, rows)
    sampled = values.max(axis=1)
    assert (sampled <= largest + gain(largest)).all()
    assert (largest <= sampled + bent * 5e-5**2).all()
    at_places = np.array(
        [np.polynomial.polynomial.polyval(places[k], rows[:, k]) for k in range(50)]
    )
    assert at_places == pytest.approx(largest, abs=1e-13)


def test_a_value_that_is_known_already_has_no_place():
    rows = np.array([[0.0], [4.0], [-4.0]])
    low, high = np.array([0.5]), np.array([1.5])
    assert raise_to_peaks(low, np.array([0]), rows, np.array([8.0])) == pytest.approx([0.5])
    assert low == pytest.approx([1.0])
    assert np.isnan(raise_to_peaks(high, np.array([0]), rows, np.array([8.0]))).all()
    assert high == [1.5]


def test_several_polynomials_of_one_column_raise_the_same_value():
    rows = np.array([[0.0, 0.0], [4.0, 12.0], [-4.0, -12.0]])
    largest = np.array([-1.0])
    places = raise_to_peaks(largest, np.array([0, 0]), rows, np.array([8.0, 24.0]))
    assert largest == pytest.approx([3.0])
    assert places == pytest.approx([0.5])
