from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from tests.variations.cases import RICH, TORQUES, family
from twolink.accuracy.reference import reference
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.variations.directions import directions
from twolink.variations.measure import CONFIGURATIONS, measured_variation

GENERAL = {
    "chain": {"mass": [1.0, 1.0], "length": [1.0, 1.0]},
    "start": {"q": [0.3, 1.2], "u": [0.5, -1.0]},
    "run": {"duration": 2.0},
    "effects": {"gravity": {}},
}


def measured(own, accuracy=1e-9, count=9):
    made = own.scene(own.values)
    times = np.linspace(0.0, made.duration, count)
    return measured_variation(
        made, directions(own), times, accuracy, lambda name: lambda share: None
    )


def difference_of_references(own, place):
    """Return the derivatives of the last state by a parameter, from two motions in 40 digits."""
    value = own.values[place]
    ends = value + 2.0**-44, value - 2.0**-44
    states = []
    for end in ends:
        values = [*own.values]
        values[place] = end
        (state,) = reference(own.scene(values), 40).states
        states.append([Fraction(str(x)) for x in state])
    distance = Fraction(ends[0]) - Fraction(ends[1])
    return np.array([float((a - b) / distance) for a, b in zip(*states, strict=True)])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "parameter"),
    [
        (GENERAL, "q1"),
        (GENERAL, "u2"),
        (GENERAL, "m2"),
        (GENERAL, "L1"),
        (GENERAL, "g"),
        (RICH, "start.theta.1"),
        (RICH, "chain.mass.0"),
        (RICH, "chain.centre.1.1"),
        (RICH, "chain.inertia.1"),
        (RICH, "effects.joint_damping.coefficient.1"),
        (RICH, "effects.joint_spring.stiffness.1"),
        (RICH, "effects.motor_inertia.inertia.1"),
        (RICH, "effects.motor_inertia.ratio.1"),
        (RICH, "effects.end_drag.coefficient"),
    ],
)
@pytest.mark.parametrize("accuracy", [1e-6, 1e-15])
def test_errors_bound_the_distance_from_motions_in_forty_digits(scene, parameter, accuracy):
    check_against_forty_digits(scene, parameter, accuracy)


@pytest.mark.slow
def test_errors_bound_the_distance_of_a_joint_angle_s_derivative():
    check_against_forty_digits({**RICH, "run": {"duration": 0.5}}, "start.theta.1", 1e-9)


def check_against_forty_digits(scene, parameter, accuracy):
    own = family(scene, parameter)
    found = measured(own, accuracy)
    got = np.concatenate([found.dq[0, :, -1], found.du[0, :, -1]])
    # The difference of neighbours is wrong by its third derivatives: (2^-44)² = 3e-27 of them.
    truth = difference_of_references(own, 0)
    assert np.abs(got - truth).max() <= found.errors[0, -1]
    assert found.errors[0, -1] < 1e-9 * np.abs(truth).max()


@pytest.mark.slow_but_first
@pytest.mark.parametrize("accuracy", [1e-6, 1e-15])
@pytest.mark.parametrize(
    "parameter",
    ["start.theta.0", "chain.mass.1", "effects.gravity.g", "effects.sampled_torque.B.1"],
)
def test_errors_bound_the_distance_from_quadruple_runs_through_corners(parameter, accuracy):
    own = family(TORQUES, parameter)
    found = measured(own, accuracy)
    (value,) = own.values
    h = 2.0**-40
    ends = []
    for end in (value + h, value - h):
        run = hybrid_run(
            own.scene([end]), np.linspace(0.0, 2.0, 9), formulation="kane", precision="quadruple"
        )
        ends.append(np.concatenate([run.q, run.u]))
    truth = (ends[0] - ends[1]).astype(float) / (2 * h)
    got = np.concatenate([found.dq[0], found.du[0]])
    off = np.abs(got - truth).max(axis=0)
    assert (off <= found.errors[0]).all()
    assert found.errors[0, -1] < 1e-9 * np.abs(truth).max()


def test_coefficients_that_cancel_between_samples_are_those_of_the_runs_precision():
    """The spline begins 100 s before the motion: rounded to float64 it would be wrong by 1e-12."""
    torque = {
        "times": [-100.0, -99.99, 0.5, 1.0, 5.0],
        "A": [0.1, 0.11, 0.4, 0.7, 0.2],
        "B": [1.0, 1.01, -1.0, 1.0, 0.1],
        "interpolation": "cubic",
    }
    own = family({**TORQUES, "effects": {"gravity": {}, "sampled_torque": torque}}, "start.theta.0")
    found = measured(own, 1e-14)
    assert found.precision == "quadruple"
    scene = own.scene(own.values)
    exact = hybrid_run(scene, np.linspace(0.0, 2.0, 9), formulation="kane", precision="quadruple")
    off = np.concatenate([found.q, found.u]) - np.concatenate([exact.q, exact.u]).astype(float)
    assert np.abs(off).max() <= found.error.max() < 1e-13


def test_a_run_has_neither_its_precision_nor_its_equations_in_common_with_its_judge():
    for (precision, equations), (finer, others) in pairwise(CONFIGURATIONS):
        assert PRECISIONS[finer].rounding < PRECISIONS[precision].rounding
        assert equations in EQUATIONS
        assert others != equations


@pytest.mark.slow
def test_errors_are_those_so_far_and_shrink_with_the_precision():
    own = family({**GENERAL, "run": {"duration": 5.0}}, "q1", "m2")
    rough, fine = measured(own, 1e-6), measured(own, 1e-15)
    assert (rough.precision, fine.precision) == ("long double", "quadruple")
    assert (rough.runs, fine.runs) == (2, 3)
    assert (np.diff(rough.errors, axis=1) >= 0).all()
    assert (np.diff(rough.error) >= 0).all()
    assert (fine.errors[:, -1] < 0.1 * rough.errors[:, -1]).all()
    # The finer result is within the error of the other.
    assert (np.abs(rough.dq - fine.dq).max(axis=1) <= rough.errors).all()


def test_an_accuracy_holds_where_errors_are_within_it():
    own = family(GENERAL, "q1")
    found = measured(own, 1e-6)
    assert found.within(1e-6).all()
    assert not found.within(1e-20).any()
    largest = max(np.abs(found.dq).max(), np.abs(found.du).max())
    at = found.errors[0, 4] / largest
    assert found.within(1.001 * max(at, found.error[4]))[:5].all()


@pytest.mark.slow
@pytest.mark.parametrize("mass", [1e-9, 1e-7])
def test_roundings_of_slopes_count_where_derivatives_nearly_cancel(mass):
    """The motion of link 1 hardly depends on m1, as its inertia is in proportion: dI/dm1 = 1/12."""
    scene = {**GENERAL, "chain": {"mass": [1.0, mass], "length": [1.0, 1.0]}}
    own = family(scene, "m1")
    found = measured(own)
    truth = difference_of_references(own, 0)
    apart = np.abs(np.concatenate([found.dq[0, :, -1], found.du[0, :, -1]]) - truth).max()
    assert apart <= found.errors[0, -1] < 1e-12
