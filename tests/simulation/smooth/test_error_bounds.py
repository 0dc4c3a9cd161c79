"""Bounds from errors that are carried along a run, on a free motion whose rates of q are u."""

import numpy as np
import pytest

from twolink.simulation.smooth.error_bounds import error_bounds, of_values
from twolink.simulation.smooth.linear import Linear

N = 3
FREE = np.zeros((4, 4))
FREE[:2, 2:] = np.eye(2)


def linear_of(exponents=(0.1, 0.1, 0.1)):
    """Return the linearized motion over three steps of 1/2 s."""
    return Linear(
        starts=0.5 * np.arange(N),
        lengths=np.full(N, 0.5),
        states=np.ones((N, 4)),
        jacobians=np.broadcast_to(FREE, (3, N, 4, 4)),
        by_time=np.zeros((N, 4)),
        flows=np.broadcast_to(np.eye(4) + 0.5 * FREE, (N, 4, 4)),
        exponents=np.array(exponents),
        differences=np.zeros((N, 4, 4)),
    )


def bounds_of(*parts, linear=None, variance=0.0, fastest=1.0, values=0.0, within=0.0):
    """Return bounds from parts of the error of q1: their numbers and sizes."""
    errors = np.zeros((N + 1, 4, 7))
    for number, size in parts:
        errors[:, 0, number] = size
    covariances = np.broadcast_to(variance * np.eye(4), (N + 1, 4, 4))
    own = linear_of() if linear is None else linear
    more = np.full(N, values), np.full(N, within)
    return error_bounds(own, (errors, covariances), fastest, *more)


def test_the_estimate_has_a_margin_and_the_other_parts_their_sizes():
    found = bounds_of((0, -1e-9), (1, 2e-9), (4, -3e-9), (6, 1e-8), within=1e-10)
    assert found.ends.tolist() == [0.5, 1.0, 1.5]
    assert found.errors == pytest.approx(1.25e-9 + 5e-9 + 3e-9 + 1e-10)
    assert found.estimates == pytest.approx(1e-9)
    assert np.isinf(found.longest_step)


def test_a_correction_leaves_a_part_of_the_estimate_and_all_that_it_does_not_see():
    seen = bounds_of((0, 1e-12))
    assert seen.corrected == pytest.approx(1e-12 * (0.005 + 0.02 * 0.1**4), rel=1e-3)
    truncated = bounds_of((0, 1e-12), (5, 1e-12))
    assert truncated.corrected - seen.corrected == pytest.approx(0.05e-12)
    hidden = bounds_of((1, 1e-12), values=3e-12)
    assert hidden.corrected == pytest.approx(4e-12)
    assert hidden.left == pytest.approx(0.0)


def test_round_off_counts_by_its_standard_deviation():
    found = bounds_of(variance=1e-24)
    assert found.noise == pytest.approx(1e-12)
    assert found.errors == pytest.approx(3.5e-12)


@pytest.mark.parametrize(("size", "known"), [(7e-6, True), (9e-6, False)])
def test_errors_beyond_the_range_of_a_linearization_are_unknown(size, known):
    found = bounds_of((0, size))
    assert np.isfinite(found.errors).all() == known
    assert np.isfinite(found.corrected).all() == known


def test_a_step_in_which_errors_decay_too_far_has_no_bound_and_a_shorter_one_has():
    found = bounds_of((0, 1e-12), linear=linear_of((0.1, 5.0, 2.4)))
    assert np.isfinite(found.errors).tolist() == [True, False, True]
    assert found.longest_step == pytest.approx(0.9 * 2.5 / 5.0 * 0.5)


def test_bounds_are_unknown_where_errors_are():
    found = bounds_of((0, 1e-12)).known_where(np.array([True, False, False]))
    for each in (found.errors, found.corrected):
        assert np.isfinite(each).tolist() == [True, False, False]
    assert np.isfinite(found.left).all()


def test_changes_of_variables_are_those_of_angles_and_speeds():
    deviations = np.array([[1.0, 2.0, 3.0, 0.0], [4.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.0, 5.0]])
    assert of_values(linear_of(), deviations).tolist() == [3.0, 4.0, 5.0]
