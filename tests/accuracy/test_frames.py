"""Frames of errors contain all errors, and grow as they do."""

import itertools
import random

import flint
import mpmath
import numpy as np
import pytest
from flint import arb, arb_mat

from twolink.accuracy import frames
from twolink.accuracy.frames import Frame, norm, transition

ONES = [arb(1)] * 4


def matrix(rows):
    return arb_mat(len(rows), len(rows), [float(x) for row in rows for x in row])


def polynomial(seed, size=2.0, terms=5):
    """Random coefficients P_i of a matrix of polynomials."""
    numbers = random.Random(seed)
    return [
        [[numbers.uniform(-size, size) for _ in range(4)] for _ in range(4)] for _ in range(terms)
    ]


def exact_transition(P, length):
    """Return Φ by its Taylor series, to 30 digits."""
    terms = [mpmath.eye(4)]
    for k in range(120):
        pairs = zip(P, reversed(terms[-len(P) :]), strict=False)
        terms.append(sum((mpmath.matrix(a) * b for a, b in pairs), mpmath.zeros(4)) / (k + 1))
    powers = (term * mpmath.mpf(length) ** k for k, term in enumerate(terms))
    return sum(powers, mpmath.zeros(4))


@pytest.mark.slow
@pytest.mark.parametrize(("terms", "widest"), [(32, 1e-3), (6, 1e13)])
@pytest.mark.parametrize("weights", [[1, 1, 1, 1], [1, 1, 5, 5]])
@pytest.mark.parametrize("seed", range(4))
def test_the_transition_matrix_solves_its_equation(seed, weights, terms, widest, monkeypatch):
    """With few terms the bound on the others is seen; with all of them balls are narrow."""
    monkeypatch.setattr(frames, "_TERMS", terms)
    P, length = polynomial(seed), 0.25
    given = [matrix(part) for part in P]
    found = transition(flint, given, arb(length), [arb(w) for w in weights])
    with mpmath.workdps(30):
        true = exact_transition(P, length)
        for row, by in itertools.product(range(4), repeat=2):
            middle = mpmath.mpf(found[row, by].mid().str(25, radius=False))
            assert abs(middle - true[row, by]) <= float(found[row, by].rad()) + 1e-24
            assert float(found[row, by].rad()) < widest


def test_the_transition_matrix_of_a_long_step_has_wide_balls_with_the_exact_value():
    """With 32 terms, exp(40) is not known: the bound on the others says so."""
    found = transition(flint, [matrix(np.diag([40.0, 1, 1, 1]))], arb(1), ONES)
    assert found[0, 0].contains(arb(40).exp())
    assert float(found[0, 0].rad()) > 1


def test_the_norm_is_that_of_weighted_vectors():
    A = [[0, 0, 1, 0], [0, 0, 0, 1], [-100, 20, 0, 0], [30, -50, 0, 0]]
    assert float(norm(matrix(A), ONES)) == pytest.approx(120)
    assert float(norm(matrix(A), [arb(1), arb(1), arb(10), arb(10)])) == pytest.approx(12)


@pytest.mark.parametrize("seed", range(6))
def test_a_frame_contains_the_images_of_its_errors(seed):
    numbers = np.random.default_rng(seed)
    radii = 10.0 ** numbers.uniform(-3, 0, 4)
    frame = Frame.around(flint, [arb(float(x)) for x in radii])
    errors = radii[:, None] * np.array(list(itertools.product((-1.0, 1.0), repeat=4))).T
    for _ in range(30):
        flow = np.eye(4) + 0.3 * numbers.uniform(-1, 1, (4, 4))
        jump = 10.0 ** numbers.uniform(-6, -4, 4)
        frame = frame.after(flint, matrix(flow)).moved([arb(float(x)) for x in jump])
        errors = flow @ errors + jump[:, None] * numbers.choice([-1.0, 1.0], errors.shape)
        inside = np.abs(np.array(frame.inverse.tolist(), dtype=float) @ errors)
        assert (inside.max(axis=1) <= np.array(frame.radii, dtype=float) * (1 + 1e-12)).all()
        largest = np.array(frame.bounds(), dtype=float)
        assert (np.abs(errors).max(axis=1) <= largest * (1 + 1e-12)).all()
    # Not only contained: the frame is not much larger than the set of the errors.
    assert largest.max() < 30 * np.abs(errors).max()


def test_turning_a_set_does_not_wrap_it():
    """A box about a turned box grows by √2 at most each time: 2^500 after a thousand turns."""
    c, s = np.cos(0.8), np.sin(0.8)
    turn = matrix([[c, s, 0, 0], [-s, c, 0, 0], [0, 0, c, -s], [0, 0, s, c]])
    frame = Frame.around(flint, [arb(1), arb(1e-3), arb(1), arb(1)])
    for _ in range(1000):
        frame = frame.after(flint, turn)
    assert max(float(bound) for bound in frame.bounds()) < 3


def test_a_stretched_set_grows_along_its_longest_edge_only():
    stretch = np.diag([2.0, 0.5, 1.0, 1.0])
    turn = np.linalg.qr(np.random.default_rng(1).uniform(-1, 1, (4, 4)))[0]
    flow = matrix(turn @ stretch @ turn.T)
    frame = Frame.around(flint, [arb(1e-300) * arb(1e-100)] * 4)
    for _ in range(100):
        frame = frame.after(flint, flow)
    grown = max(float((bound * arb(10) ** 400).log().mid()) for bound in frame.bounds())
    assert grown == pytest.approx(100 * np.log(2), abs=2)
