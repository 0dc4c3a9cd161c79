"""The linearized motion along a run, against neighbouring runs and single polynomials."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.smooth.test_measure import HARD
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.scene import Scene
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.linear import linearized, scaled_polynomials, values
from twolink.simulation.smooth.rates import jacobians_of, rates_of
from twolink.simulation.smooth.taylor import taylor_run

NOW = np.zeros(1)


def taken(scene, formulation="lagrange", order=None):
    """Return the steps of a run over two seconds."""
    found = []
    short = Scene(scene.chain, scene.q, scene.u, 2.0, scene.effects)
    taylor_run(short, [0.0, 2.0], formulation=formulation, order=order, observe=found.append)
    (steps,) = found
    return steps


def linear_of(scene, formulation, steps):
    return linearized(jacobians_of(scene, formulation), steps, scaled_polynomials(steps))


def ends(scene, starts):
    """Return the ends of motions of two seconds from starts, shape (4, count), in long doubles."""
    found = []
    for q1, q2, u1, u2 in starts:
        near = Scene(scene.chain, (q1, q2), (u1, u2), 2.0, scene.effects)
        run = taylor_run(near, [0.0, 2.0], formulation="kane", precision="long double")
        found.append(np.concatenate([run.q[:, -1], run.u[:, -1]]))
    return np.array(found).T


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", ["reference", "chaotic", "damped"])
def test_the_flows_carry_small_deviations(name):
    hard = HARD[name]
    linear = linear_of(hard, "lagrange", taken(hard))
    product = np.eye(4)
    for flow in linear.flows:
        product = flow @ product
    start, size = np.array([*hard.q, *hard.u]), 1e-6
    two = [ends(hard, start + sign * size * np.eye(4)) for sign in (1, -1)]
    exact = ((two[0] - two[1]) / (2 * size)).astype(float)
    assert product == pytest.approx(exact, rel=1e-3, abs=1e-4 * np.abs(exact).max())


def test_the_jacobians_are_those_of_the_rates():
    hard = HARD["reference"]
    for formulation in EQUATIONS:
        steps = taken(hard, formulation)
        rates = rates_of(hard, formulation, "double")
        linear = linear_of(hard, formulation, steps)
        assert linear.jacobians.shape == (3, len(steps.lengths), 4, 4)
        assert linear.scaled[1, 3] == pytest.approx(linear.jacobians[1, 3] * steps.lengths[3])
        # At the middle of a step.
        middle = values(steps.coefficients[3:4], np.array([steps.lengths[3] / 2]))[:, 0]
        for k in range(4):
            apart = 1e-5 * np.eye(4)[k][:, None]
            found = (rates(middle + apart, NOW) - rates(middle - apart, NOW)) / 2e-5
            assert linear.jacobians[1, 3, :, k] == pytest.approx(found[:, 0], rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("kind", [np.float64, np.longdouble])
def test_values_of_polynomials(kind, random):
    coefficients = random.normal(size=(3, 4, 6)).astype(kind)
    nodes = np.array([0.0, 0.3, 1.0], kind)
    found = values(coefficients, nodes)
    for n in range(3):
        for k in range(4):
            exact = np.polynomial.polynomial.polyval(nodes, coefficients[n, k])
            assert found[k, n] == pytest.approx(exact)
    assert found.dtype == kind


def test_the_derivative_by_time_is_that_of_the_loads():
    """A torque a sin(ω t) at A gives a ω cos(ω t) in the rate of the first momentum."""
    pushed = replace(
        HARD["reference"], effects=(Gravity(), JointTorque((0.0, 0.0), (2.0, 0.0), (7.0, 1.0)))
    )
    steps = taken(pushed, "momenta")
    linear = linear_of(pushed, "momenta", steps)
    middle = linear.starts + linear.lengths / 2
    exact = np.zeros((len(middle), 4))
    exact[:, 2] = 2.0 * 7.0 * np.cos(7.0 * middle)
    assert linear.by_time == pytest.approx(exact, abs=1e-3)
