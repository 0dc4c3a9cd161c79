"""Motions of runs from place to place."""

import numpy as np
import pytest

from tests.ensembles.falls import DURATION, FALL, random_starts
from twolink.ensembles import motions as motions_module
from twolink.ensembles.compiled import FORMULATION, PATH_UNIT, System
from twolink.ensembles.motions import WIDTH, Given, begun, go_on
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth.equations import EQUATIONS

SYSTEM = System(FALL.moving_chain, FALL.effects, ())
PLACES = 5
COUNT = WIDTH + 3


def runs_from(q, u):
    none = np.zeros((0, q.shape[1]))
    times = np.linspace(0.0, DURATION, PLACES)
    return Given(SYSTEM, SYSTEM.lanes(none, q, u, DURATION), none, np.ones(q.shape[1]), times)


def followed(runs, which, *parts, paths=False):
    motions = begun(runs, 15, paths=paths)
    for part in parts:
        go_on(runs, motions, which, part, motions.taken)
    return motions


def test_variables_at_the_places_are_those_of_single_runs(random):
    q, u = random_starts(random, COUNT)
    motions = followed(runs_from(q, u), np.arange(COUNT), slice(0, PLACES))
    assert not motions.lost.any()
    for lane in (0, WIDTH, COUNT - 1):
        start = {"q": tuple(q[:, lane]), "u": tuple(u[:, lane])}
        scene = Scene(FALL.chain, **start, duration=DURATION, effects=FALL.effects)
        truth = simulate(scene, accuracy=1e-11, samples=PLACES)
        angles, momenta = motions.variables[:2, :, lane], motions.variables[2:, :, lane]
        assert np.abs(angles - truth.q).max() < 1e-6
        speeds = EQUATIONS[FORMULATION].to_speeds(FALL.chain, tuple(angles), tuple(momenta))
        assert np.abs(np.array(speeds) - truth.u).max() < 1e-5


def test_paths_are_the_integrals_of_squared_speeds(random):
    q, u = random_starts(random, 2)
    motions = followed(runs_from(q, u), np.arange(2), slice(0, PLACES), paths=True)
    start = {"q": tuple(q[:, 1]), "u": tuple(u[:, 1])}
    scene = Scene(FALL.chain, **start, duration=DURATION, effects=FALL.effects)
    truth = simulate(scene, samples=4001)
    squares = np.trapezoid(truth.u**2, truth.t, axis=1)
    assert motions.variables[4:, -1, 1] / PATH_UNIT == pytest.approx(squares, rel=1e-5)


def test_only_the_chosen_runs_go_on_and_parts_have_the_steps_of_both(random):
    q, u = random_starts(random, COUNT)
    chosen = np.array([1, 4])
    motions = followed(runs_from(q, u), chosen, slice(0, 3), slice(2, PLACES))
    assert motions.reached[chosen].tolist() == [PLACES - 1] * 2
    assert np.delete(motions.reached, chosen).tolist() == [0] * (COUNT - 2)
    assert (motions.steps[chosen] > motions.taken[chosen]).all()
    assert np.isnan(np.delete(motions.variables, chosen, axis=2)[:, 1:]).all()


@pytest.mark.parametrize("speed", [1e100, 1e9], ids=["not finite", "too many steps"])
def test_a_run_without_an_end_is_lost_and_leaves_its_neighbours_alone(random, monkeypatch, speed):
    monkeypatch.setattr(motions_module, "MOST_STEPS", 10_000)
    q, u = random_starts(random, COUNT)
    alone = followed(runs_from(q, u), np.arange(COUNT), slice(0, PLACES))
    u[0, 3] = speed
    motions = followed(runs_from(q, u), np.arange(COUNT), slice(0, PLACES))
    assert np.flatnonzero(motions.lost).tolist() == [3]
    others = np.delete(np.arange(COUNT), 3)
    assert np.array_equal(motions.variables[..., others], alone.variables[..., others])


def test_rates_of_another_chain_are_refused(random, monkeypatch):
    q, u = random_starts(random, 2)
    runs = runs_from(q, u)
    other, made = System(FALL.moving_chain, (), ()), System.integrator
    monkeypatch.setattr(System, "integrator", lambda self, *a, **b: made(other, *a, **b))
    with pytest.raises(SimulationError, match="please report this"):
        followed(runs, np.arange(2), slice(0, PLACES))
