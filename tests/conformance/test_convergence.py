"""The convergence verdict on sequences whose limit and order are known."""

import math

import numpy as np
import pytest

from twolink.conformance.convergence import Curve, Limit, convergence

TRUTH = np.array([[1.0, -2.0, 0.5, 3.0]])
SLOPE = np.array([[1.0, 0.3, -2.0, 0.7]])
EPSILON = 2.0**-52


def motions(order, limit=TRUTH, count=5, ratio=2.0, first=1e-2):
    return [limit + SLOPE * first * ratio ** (-order * k) for k in range(count)]


@pytest.mark.parametrize("order", [1, 2, 3, 4])
@pytest.mark.parametrize("ratio", [2.0, 10.0])
def test_the_order_is_measured(order, ratio):
    found = convergence(motions(order, ratio=ratio, count=4), TRUTH, EPSILON, ratio)
    assert found.limit is Limit.TRUTH
    assert found.order == pytest.approx(order, abs=0.01)
    assert found.limit_error <= 0.1 * found.error or found.error < 1e-7


@pytest.mark.parametrize(
    ("order", "off"), [(1, 1e-2), (1, 1e-3), (2, 1e-2), (2, 1e-5), (4, 1e-2), (4, 1e-6)]
)
def test_convergence_to_another_model_is_recognised(order, off):
    limit = TRUTH + np.array([[off, 0.0, -off, 0.0]])
    found = convergence(motions(order, limit, count=7), TRUTH, EPSILON)
    assert found.limit is Limit.ANOTHER
    assert found.limit_error == pytest.approx(off, rel=1e-3)
    assert found.order == pytest.approx(order, abs=0.1)
    assert "converges to another model" in found.sentence


def test_errors_are_kept_from_coarse_to_fine():
    found = convergence(motions(1, count=4), TRUTH, EPSILON)
    assert found.errors == pytest.approx([2e-2, 1e-2, 5e-3, 2.5e-3])
    assert found.error == found.errors[-1]
    curve = Curve("step", (8.0, 4.0, 2.0, 1.0), found)
    assert curve.points[0] == (8.0, pytest.approx(2e-2))
    with pytest.raises(ValueError, match="zip"):
        _ = Curve("step", (1.0,), found).points


def test_a_limit_within_the_finest_error_counts_as_the_truth():
    limit = TRUTH + np.array([[1e-6, 0.0, -1e-6, 0.0]])
    found = convergence(motions(1, limit, count=7), TRUTH, EPSILON)
    assert found.limit is Limit.TRUTH
    assert found.limit_error < 0.1 * found.error


def test_oscillating_and_growing_differences_have_no_limit():
    away = [TRUTH + SLOPE * 0.1 * (-1) ** k for k in range(5)]
    assert convergence(away, TRUTH, EPSILON).limit is Limit.NONE
    growing = [TRUTH + SLOPE * 0.01 * 2.0**k for k in range(5)]
    found = convergence(growing, TRUTH, EPSILON)
    assert found.limit is Limit.NONE
    assert found.order == pytest.approx(-1, abs=0.01)


def test_values_that_are_not_finite():
    found = convergence([*motions(1), TRUTH * math.nan], TRUTH, EPSILON)
    assert found.limit is Limit.NONE
    assert math.isnan(found.order)
    assert found.sentence == "does not converge; values are not finite at the finest setting"


def test_motions_that_are_not_finite_at_coarse_settings_are_left_out():
    unstable = [TRUTH * math.nan, TRUTH * math.inf]
    found = convergence([*unstable, *motions(1)], TRUTH, EPSILON)
    assert found.limit is Limit.TRUTH
    assert found.order == pytest.approx(1, abs=0.01)
    assert len(found.errors) == 7
    found = convergence([*motions(1), *unstable, *motions(2)[:2]], TRUTH, EPSILON)
    assert found.limit is Limit.NONE
    assert convergence([*unstable, *uneven(1)], TRUTH, EPSILON, even=False).limit is Limit.TRUTH


def test_exact_values_have_no_order():
    found = convergence([TRUTH] * 3, TRUTH, EPSILON)
    assert found.limit is Limit.TRUTH
    assert math.isnan(found.order)
    assert "order" not in found.sentence


def test_the_precision_decides_between_round_off_and_another_limit():
    off = [TRUTH + 1e-5 * SLOPE] * 3
    assert convergence(off, TRUTH, EPSILON).limit is Limit.ANOTHER
    assert convergence(off, TRUTH, 2.0**-23).limit is Limit.TRUTH


def test_growing_differences_below_half_of_all_digits_are_no_order():
    # As in binary32, where the round-off of the finer steps adds up.
    off = [TRUTH + 0.01 * SLOPE + 1e-5 * 2.0**k * SLOPE for k in range(5)]
    found = convergence(off, TRUTH, 2.0**-23)
    assert found.limit is Limit.ANOTHER
    assert math.isnan(found.order)
    assert "order" not in found.sentence


def uneven(order, limit=TRUTH, count=9):
    """Errors with the step on average, times a factor from 0.5 to 1.5 that jumps."""
    shares = [0.5 + (7 * k % 5) / 4 for k in range(count)]
    return [limit + SLOPE * 1e-2 * share * 2.0 ** (-order * k) for k, share in enumerate(shares)]


def test_uneven_errors_of_motions_with_events():
    found = convergence(uneven(1), TRUTH, EPSILON, even=False)
    assert found.limit is Limit.TRUTH
    assert found.order == pytest.approx(1, abs=0.4)
    limit = TRUTH + np.array([[1e-2, 0.0, -1e-2, 0.0]])
    found = convergence(uneven(1, limit), TRUTH, EPSILON, even=False)
    assert found.limit is Limit.ANOTHER
    # Drake's radau3 at tolerances from 1e-3 to 1e-11: the last two differences are alike.
    variable = [TRUTH + SLOPE * size for size in (1.4e-4, 1.8e-5, 3.8e-6, -2.2e-6, 2.2e-7)]
    assert convergence(variable, TRUTH, EPSILON, 100.0, even=False).limit is Limit.TRUTH
    # One motion comes near the truth, and the finest one does not.
    sizes = [3.0, 1.2, 1.7, 0.8, 0.5, 0.35, 0.15, 0.015, 0.32]
    passing = [TRUTH + SLOPE * size for size in sizes]
    assert convergence(passing, TRUTH, EPSILON, even=False).limit is not Limit.TRUTH
    # MuJoCo's Euler method on impact/floor: the finest motions move away from each other.
    sizes = [3.27, 0.19, 1.94, 0.18, -0.1, 0.18, 0.09, 0.3, 0.73]
    parting = [TRUTH + SLOPE * size for size in sizes]
    assert convergence(parting, TRUTH, EPSILON, even=False).limit is Limit.NONE
    away = [TRUTH + SLOPE * 0.1 * (-1) ** k for k in range(9)]
    assert convergence(away, TRUTH, EPSILON, even=False).limit is Limit.NONE


def test_uneven_errors_that_fall_to_one_digit_have_no_limit_yet():
    """MuJoCo's implicit method on friction/stops: at a 32nd of the last step the error is 0.8."""
    sizes = [6.1, 5.3, 6.2, 3.6, 2.1, 0.94, 0.15, 0.45, 0.3]
    falling = [TRUTH + SLOPE / 2 * size for size in sizes]
    assert convergence(falling, TRUTH, EPSILON, even=False).limit is not Limit.TRUTH
    # Siconos on friction/stops, which goes on to the truth.
    sizes = [0.51, 1.0, 1.3, 0.1, 0.068, 0.02, 0.025, 0.0026, 0.0064]
    falling = [TRUTH + SLOPE / 2 * size for size in sizes]
    assert convergence(falling, TRUTH, EPSILON, even=False).limit is Limit.TRUTH
