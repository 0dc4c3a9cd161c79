"""The error that the defect of a run's steps gives, against more precise runs."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from tests.simulation.smooth.test_measure import HARD, TIMES, scene, true_errors
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth import defect
from twolink.simulation.smooth.defect import StepErrors
from twolink.simulation.smooth.taylor import taylor_run

STIFF = {
    "stiff springs": (Gravity(), JointSpring((300.0, 500.0))),
    "strong damping": (Gravity(), JointDamping((40.0, 30.0))),
}
# The values of a run have the round-off of the output, which is no part of the defect.
OUTPUT = 8


def observed(scene, order, formulation="momenta", precision="double"):
    """Return a run and the errors that its steps give."""
    errors = StepErrors(scene, formulation, precision)
    run = taylor_run(
        scene, TIMES, formulation=formulation, precision=precision, order=order, observe=errors
    )
    return run, errors


def missed(scene, run, errors):
    """Return the true error over the bound, the larger of it and of the output, at each time."""
    finest = "long double" if run.precision == "double" else "quadruple"
    exact = taylor_run(scene, TIMES, formulation="kane", precision=finest)
    q, u = ([PRECISIONS[finest].array(row) for row in pair] for pair in (run.q, run.u))
    true = true_errors(type("Run", (), {"q": np.array(q), "u": np.array(u)}), exact)
    sizes = np.abs(np.concatenate([run.q, run.u]).astype(float)).max()
    output = OUTPUT * PRECISIONS[run.precision].rounding * sizes
    return true, errors.at(TIMES) + output


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["momenta", "lagrange", "kane"])
@pytest.mark.parametrize("name", HARD)
def test_the_error_is_bounded_at_all_times(name, formulation):
    for order in (11, 13, 15, 17, 19, 21):
        run, errors = observed(HARD[name], order, formulation)
        true, bound = missed(HARD[name], run, errors)
        assert np.all(true <= bound)


def test_the_error_is_bounded_by_little_more_than_itself():
    hard = HARD["reference"]
    run, errors = observed(hard, 15)
    true, bound = missed(hard, run, errors)
    assert np.all(true <= bound)
    assert np.all(bound[5:21] < 2 * true[5:21])


@pytest.mark.parametrize("name", STIFF)
def test_steps_over_which_errors_change_much(name):
    stiff = scene((1.0, -2.0), (0.5, 0.0), effects=STIFF[name])
    for order in (15, 21):
        run, errors = observed(stiff, order)
        true, bound = missed(stiff, run, errors)
        assert np.all(true <= bound)
    assert bound[-1] < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("name", ["reference", "chaotic", "damped"])
def test_long_doubles(name):
    for order in (15, 19, 23):
        run, errors = observed(HARD[name], order, precision="long double")
        true, bound = missed(HARD[name], run, errors)
        assert np.all(true <= bound)
    assert bound[-1] < 1e-11


@pytest.mark.slow
def test_random_starts(random):
    """Of 3 × 30 runs none has an error above its bound; the median is well above a hundredth."""
    shares = []
    for hard in HARD.values():
        q, u = random.uniform(-3, 3, (2, 2)).tolist()
        start = scene(tuple(q), tuple(u), hard.chain, hard.effects)
        for order in (13, 17, 21):
            true, bound = missed(start, *observed(start, order))
            shares.append((true / bound).max())
    assert max(shares) <= 1
    assert np.median(shares) > 0.05


def test_steps_that_come_in_parts_give_the_same():
    found = []
    hard = HARD["reference"]
    taylor_run(hard, TIMES, formulation="momenta", observe=found.append)
    (steps,) = found
    whole, parts = (StepErrors(hard, "momenta", "double") for _ in range(2))
    # Steps from 0 s begin anew.
    whole(steps)
    whole(steps)
    for cut in (slice(0, 100), slice(100, 101), slice(101, None)):
        rows = [steps.starts[cut], steps.lengths[cut], steps.coefficients[cut]]
        last = cut.stop is None
        end = steps.end if last else steps.coefficients[cut.stop, :, 0]
        parts(type(steps)(*rows, end))
    assert parts.at(TIMES) == pytest.approx(whole.at(TIMES), rel=1e-6)
    assert parts.round_off_at(TIMES) == pytest.approx(whole.round_off_at(TIMES), rel=1e-6)


def test_an_error_that_is_not_small_has_no_bound():
    """The motion is linearized: two chaotic motions far apart are not."""
    _, errors = observed(HARD["chaotic"], 7)
    bounds = errors.at(TIMES)
    assert np.isfinite(bounds[0])
    assert np.isinf(bounds[-1])
    assert np.all(np.diff(bounds[np.isfinite(bounds)]) >= 0)


@pytest.mark.parametrize(("kind", "rounding"), [(np.float64, 2**-52), (np.longdouble, 2**-63)])
def test_gauss_integrates_polynomials(kind, rounding):
    for count in (2, 6, 8):
        nodes, weights = defect._gauss(count, kind)
        for k in range(2 * count):
            assert abs((weights * nodes**k).sum() - 1 / kind(k + 1)) <= 4 * rounding


def test_the_bound_includes_the_error_of_an_insufficient_quadrature(monkeypatch):
    """With two nodes Gauss's error is a thousand times the defect, and is in the bound."""
    hard = HARD["reference"]
    run, enough = observed(hard, 21)
    monkeypatch.setattr(defect, "_OF_A_ROUNDING", 1e12)
    run, errors = observed(hard, 21)
    assert errors._nodes == 2
    true, bound = missed(hard, run, errors)
    assert np.all(true <= bound)
    assert bound[1] > 100 * enough.at(TIMES)[1]


def test_the_flow_of_a_step_is_of_sixth_order():
    """Half a step divides the error of its flow by 2⁷: the matrices do not commute."""

    def slope(t):
        return np.array(
            [[0.1, 1, 0.3 * t, 0], [t, -0.2, 0, 1], [math.sin(t), 0, 0.3, t * t], [0, 0.5, 1, 0]]
        )

    def rates(t, x):
        return (slope(t) @ x.reshape(4, 4)).ravel()

    nodes, _ = defect._gauss(3)
    missed = []
    for h in (0.4, 0.2):
        exact = solve_ivp(rates, (0, h), np.eye(4).ravel(), method="DOP853", rtol=1e-13, atol=1e-14)
        found = expm(defect._magnus(*(h * slope(h * node) for node in nodes)))
        missed.append(np.abs(found - exact.y[:, -1].reshape(4, 4)).max())
    assert missed[1] < missed[0] / 2**6.5
    assert missed[0] < 1e-5


@pytest.mark.parametrize("size", [1e-9, 0.3, 3.0, 40.0])
def test_exponentials(size, random):
    matrices = size * random.uniform(-1, 1, (5, 4, 4))
    for matrix, found in zip(matrices, defect._exponentials(matrices), strict=True):
        assert found == pytest.approx(expm(matrix), rel=1e-2, abs=1e-3 * np.abs(expm(matrix)).max())


def test_errors_are_carried_from_step_to_step(random):
    flows, sources = random.normal(size=(7, 4, 4)), random.normal(size=(7, 4, 3))
    start = random.normal(size=(4, 3))
    carried = [start]
    for flow, source in zip(flows, sources, strict=True):
        carried.append(flow @ carried[-1] + source)
    assert defect._accumulated(flows, sources, start) == pytest.approx(np.array(carried))


def test_the_nodes_are_enough_for_the_precision():
    """Gauss's error (e⁻²/4)^(2 m) is below a rounding, and that of one node less is not."""
    for precision, nodes in (("double", 6), ("long double", 8)):
        errors = StepErrors(HARD["reference"], "momenta", precision)
        assert errors._nodes == nodes
        ratio = math.exp(-2) / 4
        assert ratio ** (2 * nodes) < PRECISIONS[precision].rounding
