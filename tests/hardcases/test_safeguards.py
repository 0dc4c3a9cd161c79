"""Each safeguard of the library is needed: without it at least one hard case fails."""

import math
import sys
from dataclasses import replace

import pytest

from twolink import arithmetic, kane, lagrange
from twolink.engines.marks import Mark
from twolink.hardcases.catalogue import case_named
from twolink.hardcases.record import Case, Column
from twolink.hardcases.run import outcome
from twolink.hardcases.trajectory_trial import TrajectoryTrial
from twolink.simulation.hybrid import compile as compilation
from twolink.simulation.hybrid import configurations, judged, measure, start_of_arc, tolerances
from twolink.simulation.smooth import equations, integrators
from twolink.simulation.smooth.equations import EQUATIONS


def fresh(name: str, seconds: float = 20.0) -> Case:
    """Return a case that remembers nothing of earlier trials."""
    case = case_named(name)
    trial = case.trial
    if isinstance(trial, TrajectoryTrial):
        trial = replace(trial, _found={}, accuracies=trial.accuracies[:1])
    return replace(case, trial=trial, seconds=seconds)


def mark(name: str, formulation: str) -> Mark:
    forget_what_is_compiled()
    return outcome(fresh(name), Column(formulation)).mark


def forget_what_is_compiled() -> None:
    compilation.compiled_kind.cache_clear()
    integrators.INTEGRATORS.clear()


@pytest.fixture(autouse=True)
def nothing_compiled():
    """Compile anew when a safeguard is back."""
    yield
    forget_what_is_compiled()


def cancelling(chain, q):
    (M11, M12), (_, M22) = lagrange.mass_matrix(chain, q)
    return M11 * M22 - M12 * M12


@pytest.mark.slow
@pytest.mark.parametrize("formulation", EQUATIONS)
@pytest.mark.parametrize("name", ["point-masses-heavy-tip-aligned", "nearly-aligned"])
def test_a_case_fails_with_a_cancelling_determinant(name, formulation, monkeypatch):
    assert mark(name, formulation) is Mark.PASS
    for text in (kane, lagrange):
        monkeypatch.setattr(text, "determinant", cancelling)
    whole = equations.mass
    monkeypatch.setattr(
        equations,
        "mass",
        lambda chain, q, both: (*whole(chain, q, both)[:3], cancelling(chain, q)),
    )
    assert mark(name, formulation) is not Mark.PASS


@pytest.mark.slow
@pytest.mark.parametrize("formulation", EQUATIONS)
def test_steps_without_a_cap(formulation, monkeypatch):
    assert mark("soft-torque", formulation) is Mark.PASS
    monkeypatch.setattr(measure, "default_longest_step", lambda scene: scene.duration)
    monkeypatch.setattr(configurations, "_LOWEST_ORDER", 7)
    # The comparison with a second run would detect the error.
    monkeypatch.setattr(judged, "differences", lambda first, second, times, accuracy: 0 * times)
    assert mark("soft-torque", formulation) is Mark.SILENT


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["lagrange", "kane"])
def test_a_case_fails_without_the_zeno_limit(formulation, monkeypatch):
    assert mark("zeno", formulation) is Mark.PASS
    monkeypatch.setattr(tolerances, "zeno_time", lambda step, rounding: 0.0)
    monkeypatch.setattr(tolerances, "MOST_IMPACTS_OF_A_BURST", 10**9)
    for module in (start_of_arc, tolerances):
        monkeypatch.setattr(module, "LEADING", 0.0)
    monkeypatch.setattr(start_of_arc, "LEADING_SHARE", 0.0)
    assert mark("zeno", formulation) is not Mark.PASS


def within_a_turn(x):
    """Return a float less turns of float64's 2π; numbers that are only stored pass."""
    return math.remainder(x, 2 * math.pi) if isinstance(x, float) else x


@pytest.mark.parametrize("formulation", EQUATIONS)
def test_a_case_fails_with_angles_reduced_to_one_turn(formulation, monkeypatch):
    assert mark("angles-of-1e8", formulation) is Mark.PASS
    for text in (kane, lagrange, equations):
        for name in ("sin", "cos", "sine_and_cosine"):
            function = getattr(arithmetic, name)
            if hasattr(text, name):
                monkeypatch.setattr(text, name, lambda x, f=function: f(within_a_turn(x)))
    assert mark("angles-of-1e8", formulation) is Mark.SILENT


@pytest.mark.slow_but_first
@pytest.mark.parametrize("formulation", ["lagrange", "kane"])
def test_a_case_fails_without_stabilisation(formulation, monkeypatch):
    assert mark("sliding-200-s", formulation) is Mark.PASS
    monkeypatch.setattr(tolerances, "STABILISATION", 0.0)
    assert mark("sliding-200-s", formulation) is not Mark.PASS


@pytest.mark.slow
def test_a_case_fails_at_orders_that_are_multiples_of_four(monkeypatch):
    """At even orders the natural start's series ends on two terms that are not there."""
    assert mark("natural-start", "momenta") is Mark.PASS
    smooth = sys.modules["twolink.hardcases.smooth"]
    monkeypatch.setattr(smooth, "_EVERY_ORDER", range(8, 30, 4))
    assert mark("natural-start", "momenta") is Mark.SILENT
