"""Bounds of trajectories: for engines never stricter than ours, with a fair method."""

import numpy as np
import pytest

from tests.simulators import simulator_named
from twolink.hardcases.catalogue import case_named
from twolink.hardcases.reference_integrator import ReferenceStates
from twolink.hardcases.trajectory_trial import NO_ANSWER, Answer, best_method, near

TIMES = np.array([0.0, 1.0])
SCENE = case_named("beats").trial.scene


def answer(error: float, accuracy: float = 1e-6, tolerance: float = 0.0) -> Answer:
    q = np.array([[0.0, 0.5 + error], [0.0, 0.25]])
    return Answer(SCENE, TIMES, q, np.zeros((2, 2)), accuracy, tolerance)


def expected(times):
    return ReferenceStates(times, np.array([[0.0, 0.5], [0.0, 0.25]]), np.zeros((2, 2)))


def test_the_factor_is_the_error_in_units_of_the_bound():
    assert near(expected)(answer(3e-6)).factor == pytest.approx(3.0, rel=1e-9)
    assert near(expected)(answer(0.0)).factor == 0


@pytest.mark.parametrize(
    ("accuracy", "tolerance", "growth", "bound"),
    [
        (1e-6, 0.0, 1e9, 1e-6),
        (1e-6, 1e-12, 1.0, 1e-6),
        # A thousand tolerances times the growth.
        (1e-6, 1e-12, 1e6, 1e-3),
        # The largest bound.
        (1e-6, 1e-12, 1e9, NO_ANSWER),
        (0.1, 1e-12, 1e9, 0.1),
        # The accuracy, or a thousand tolerances, may exceed it.
        (1e-6, 1e-4, 1e9, 0.1),
    ],
)
def test_bounds_of_engines(accuracy, tolerance, growth, bound):
    assert answer(0.0, accuracy, tolerance).bound(growth) == pytest.approx([bound, bound])


@pytest.mark.parametrize(
    ("engine", "smooth", "stiff"),
    [
        ("heyoka", "taylor", "taylor"),
        ("SciPy over Pinocchio", "DOP853", "Radau"),
        ("MuJoCo", "RK4", "implicit"),
        ("Drake", "runge_kutta5", "radau3"),
        ("diffrax", "Dopri8", "Kvaerno5"),
        ("SymPy-generated code", "DOP853", "Radau"),
    ],
)
def test_an_engine_is_given_its_best_method(engine, smooth, stiff):
    methods = [
        best_method(simulator_named(engine).methods, case_named(name).trial.scene).name
        for name in ("beats", "strong-damping-creep")
    ]
    assert methods == [smooth, stiff]
