import numpy as np
import pytest
from scipy.linalg import expm

from tests.ensembles.evaluated import evaluated, symbolic
from twolink.ensembles.linear_flow import NODES, derivatives, flow, frequency
from twolink.optional import heyoka


def matrix(numbers):
    return np.array([symbolic(row) for row in numbers], object)


def of(jacobians, length):
    found = flow(tuple(map(matrix, jacobians)), heyoka().expression(length))
    return evaluated(found.ravel()).reshape(4, 4)


def exact(jacobian, length, steps=4000):
    """Return the flow of x' = J(t) x by many small steps at their middle."""
    found, h = np.eye(4), length / steps
    for k in range(steps):
        found = expm(h * jacobian((k + 0.5) * h)) @ found
    return found


@pytest.mark.slow
def test_the_flow_is_of_sixth_order(random):
    constant, slope = random.normal(size=(2, 4, 4))

    def jacobian(t):
        return constant + slope * np.sin(2 * t)

    errors = []
    for length in (0.4, 0.2):
        found = of([jacobian(node * length) for node in NODES], length)
        errors.append(np.abs(found - exact(jacobian, length)).max())
    assert errors[0] < 1e-3
    # The error of a step has the seventh power of its length.
    assert 80 < errors[0] / errors[1] < 200


def test_oscillations_are_not_damped():
    jacobian = np.zeros((4, 4))
    jacobian[0, 2], jacobian[2, 0] = 1.0, -1.0
    found = of([jacobian] * 3, 0.6)[[[0], [2]], [0, 2]]
    assert np.linalg.norm(np.linalg.matrix_power(found, 1000), 2) == pytest.approx(1.0, abs=5e-3)


@pytest.mark.parametrize(("signs", "angle"), [((1.0, -1.0), 0.6), ((1.0, 1.0), 2.0)])
def test_the_frequency_of_an_oscillation_and_of_a_growth(signs, angle):
    # x' = a y, y' = b x, in any units: the eigenvalues are those of a b = ±400.
    for unit in (1.0, 1e3):
        jacobian = np.zeros((4, 4))
        jacobian[1, 3], jacobian[3, 1] = signs[0] * 20.0 * unit, signs[1] * 20.0 / unit
        assert evaluated([frequency(matrix(jacobian))])[0] == pytest.approx(20.0 / angle)


def test_derivatives_have_a_row_for_each_rate():
    hy = heyoka()
    names = hy.make_vars("a", "b")
    found = derivatives([names[0] * names[1], hy.sin(names[0])], list(names))
    flat = evaluated(found.ravel(), names, (0.3, 2.0))
    assert flat == pytest.approx([2.0, 0.3, np.cos(0.3), 0.0])
