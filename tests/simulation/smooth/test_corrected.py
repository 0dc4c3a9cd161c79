"""Corrected runs, against quadruple ones: at samples, between them, and repeated."""

import pickle

import numpy as np
import pytest

from tests.simulation.smooth.test_measure import HARD, TIMES, scene, true_errors
from tests.simulation.smooth.test_step_errors import observed
from twolink import simulate
from twolink.errors import SimulationError
from twolink.simulation import Trajectory
from twolink.simulation.run import Recipe
from twolink.simulation.smooth import corrected, step_errors
from twolink.simulation.smooth.corrected import corrected_run, corrected_taylor_run
from twolink.simulation.smooth.taylor import taylor_run

ROUNDED = 8 * 2**-52


def made(name, order, precision="double", evaluated_in="long double", formulation="momenta"):
    """Return a raw run, its errors, and the corrected run."""
    raw, errors = observed(HARD[name], order, formulation, precision, evaluated_in)
    return raw, errors, corrected_run(raw, TIMES, errors.correction(), errors.evaluated_in)


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["momenta", "lagrange"])
@pytest.mark.parametrize("name", ["reference", "chaotic", "damped"])
def test_a_correction_leaves_a_twentieth_of_the_error(name, formulation):
    exact = taylor_run(HARD[name], TIMES, formulation="kane", precision="quadruple")
    for order in (15, 19):
        raw, errors, found = made(name, order, formulation=formulation)
        before, after = (true_errors(run, exact) for run in (raw, found))
        output = ROUNDED * np.abs(np.concatenate([raw.q, raw.u])).max()
        assert np.all(after <= errors.corrected_at(TIMES) + output)
        assert after[-1] < max(before[-1] / 20, output)
        assert found.recipe == Recipe(order, raw.longest_step, "long double")


@pytest.mark.slow
@pytest.mark.parametrize("name", HARD)
def test_the_error_of_a_corrected_run_is_bounded_at_all_times(name):
    exact = taylor_run(HARD[name], TIMES, formulation="kane", precision="quadruple")
    for order in (11, 13, 15, 17, 19, 21):
        for evaluated_in in ("double", "long double"):
            raw, errors, found = made(name, order, evaluated_in=evaluated_in)
            output = ROUNDED * np.abs(np.concatenate([raw.q, raw.u])).max()
            bound = errors.corrected_at(TIMES) + output
            assert np.all(true_errors(found, exact) <= bound)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["reference", "chaotic"])
def test_a_correction_of_long_doubles(name):
    exact = taylor_run(HARD[name], TIMES, formulation="kane", precision="quadruple")
    raw, errors, found = made(name, 21, "long double", "quadruple")
    before, after = (true_errors(run, exact) for run in (raw, found))
    output = ROUNDED / 1000 * np.abs(np.concatenate([raw.q, raw.u])).max()
    assert np.all(after <= errors.corrected_at(TIMES) + output)
    assert after[-1] < before[-1] / 20


@pytest.mark.slow
def test_values_between_samples_are_corrected():
    """As accurate as at the samples."""
    times = np.linspace(0, 10, 77)
    exact = taylor_run(HARD["reference"], times, formulation="kane", precision="quadruple")
    _, errors, found = made("reference", 15)
    q, u = found.dense()(times)
    between = type("Run", (), {"q": q, "u": u})
    bound = errors.corrected_at(times) + ROUNDED * np.abs(u).max().astype(float)
    assert np.all(true_errors(between, exact) <= bound)


def test_a_repeated_run_is_the_same():
    raw, _, found = made("reference", 15)
    again = corrected_taylor_run(
        HARD["reference"],
        TIMES,
        formulation="momenta",
        precision="double",
        order=15,
        evaluated_in="long double",
    )
    assert np.array_equal(again.q, found.q)
    assert np.array_equal(again.u, found.u)
    assert np.array_equal(again.step_times(), raw.step_times())
    assert again.arithmetic == raw.arithmetic
    stored = pickle.loads(pickle.dumps(found))
    assert np.array_equal(stored.dense()(TIMES)[1], found.dense()(TIMES)[1])


def test_a_motion_of_too_many_steps_is_not_corrected(monkeypatch):
    for module in (corrected, step_errors):
        monkeypatch.setattr(module, "MOST_KEPT", 100)
    with pytest.raises(SimulationError, match="must take at most 100 steps; got"):
        corrected_taylor_run(
            HARD["reference"],
            TIMES,
            formulation="momenta",
            precision="double",
            order=15,
            evaluated_in="double",
        )


@pytest.mark.slow
def test_a_corrected_trajectory_is_saved_and_loaded(tmp_path):
    """Double precision misses the accuracy; its corrected run is returned, and says so."""
    hard = scene((0.3, -0.4), (0.1, 0.2), HARD["reference"].chain)
    exact = taylor_run(hard, TIMES, formulation="kane", precision="quadruple")
    found = simulate(hard, accuracy=3e-11, samples=11)
    assert found.recipe.evaluated_in == "long double"
    assert "momenta, double, corrected" in found.facts["method"]
    assert found.met
    q, u = found.at(TIMES)
    assert true_errors(type("Run", (), {"q": q, "u": u}), exact).max() <= found.error
    found.save(tmp_path / "run.npz")
    back = Trajectory.load(tmp_path / "run.npz")
    assert np.array_equal(back.at(TIMES)[1], u)
    work = back.work()["Gravity"]
    gained = back.kinetic_energy - back.kinetic_energy[0]
    assert work == pytest.approx(gained, abs=1e-9)
