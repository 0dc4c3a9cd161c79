"""The linearized motion over steps, against matrix exponentials and a numerical integrator."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from twolink.simulation.smooth.flows import (
    accumulated,
    carried,
    exponentials,
    magnus,
)
from twolink.simulation.smooth.quadrature import gauss_nodes


def test_the_flow_of_a_step_is_of_sixth_order():
    """Half a step divides the error of its flow by 2⁷: the matrices do not commute."""

    def slope(t):
        return np.array(
            [[0.1, 1, 0.3 * t, 0], [t, -0.2, 0, 1], [math.sin(t), 0, 0.3, t * t], [0, 0.5, 1, 0]]
        )

    def rates(t, x):
        return (slope(t) @ x.reshape(4, 4)).ravel()

    nodes = gauss_nodes(3)
    missed = []
    for h in (0.4, 0.2):
        exact = solve_ivp(rates, (0, h), np.eye(4).ravel(), method="DOP853", rtol=1e-13, atol=1e-14)
        logarithm, difference = magnus(*(h * slope(h * node) for node in nodes))
        missed.append(np.abs(expm(logarithm) - exact.y[:, -1].reshape(4, 4)).max())
        coarse = np.abs(expm(logarithm - difference) - exact.y[:, -1].reshape(4, 4)).max()
        assert missed[-1] < coarse / 10
    assert missed[1] < missed[0] / 2**6.5
    assert missed[0] < 1e-5


@pytest.mark.parametrize("size", [1e-9, 0.3, 3.0, 40.0])
def test_exponentials(size, random):
    matrices = size * random.uniform(-1, 1, (5, 4, 4))
    for matrix, found in zip(matrices, exponentials(matrices)[0], strict=True):
        assert found == pytest.approx(expm(matrix), rel=1e-2, abs=1e-3 * np.abs(expm(matrix)).max())


@pytest.mark.parametrize("count", [1, 2, 7, 50])
def test_errors_and_covariances_are_carried_from_step_to_step(count, random):
    flows, sources = random.normal(size=(count, 4, 4)), random.normal(size=(count, 4, 3))
    variances, half = random.uniform(0, 1, (count, 4)), random.normal(size=(4, 4))
    error, covariance = random.normal(size=(4, 3)), half @ half.T
    errors, covariances = accumulated(flows, sources, variances, (error, covariance))
    assert (errors[0] == error).all()
    assert (covariances[0] == covariance).all()
    for flow, source, variance, got, spread in zip(
        flows, sources, variances, errors[1:], covariances[1:], strict=True
    ):
        error = flow @ error + source
        covariance = flow @ covariance @ flow.T + np.diag(variance)
        assert got == pytest.approx(error, rel=1e-9, abs=1e-9 * np.abs(error).max())
        assert spread == pytest.approx(covariance, rel=1e-9, abs=1e-9 * covariance.max())


@pytest.mark.parametrize("count", [1, 2, 7, 50])
def test_errors_alone_are_carried_alike(count, random):
    flows, sources = random.normal(size=(count, 4, 4)), random.normal(size=(count, 4))
    start = random.normal(size=4)
    both = accumulated(
        flows, sources[:, :, None], np.zeros((count, 4)), (start[:, None], np.zeros((4, 4)))
    )
    assert carried(flows, sources, start) == pytest.approx(both[0][:, :, 0])


def test_a_covariance_is_that_of_random_errors(random):
    flows, sizes = 0.5 * random.normal(size=(20, 4, 4)), random.uniform(0, 1, (20, 4))
    draws = np.zeros((4, 40_000))
    for flow, size in zip(flows, sizes, strict=True):
        draws = flow @ draws + size[:, None] * random.choice([-1.0, 1.0], draws.shape)
    nothing = np.zeros((20, 4, 1))
    _, found = accumulated(flows, nothing, sizes**2, (nothing[0], np.zeros((4, 4))))
    exact = draws @ draws.T / draws.shape[1]
    assert found[-1] == pytest.approx(exact, abs=0.03 * exact.max())


def test_sizes_are_spectral_radii_from_above(random):
    """Also where columns differ in size, as angles and momenta do."""
    for scale in (1.0, 30.0):
        units = np.diag([1.0, 1.0, scale, scale])
        matrices = units @ random.normal(size=(40, 4, 4)) @ np.linalg.inv(units)
        exact = np.abs(np.linalg.eigvals(matrices)).max(axis=1)
        _, found = exponentials(matrices)
        assert np.all(found >= exact * (1 - 1e-12))
        assert np.all(found <= 2.5 * exact)
