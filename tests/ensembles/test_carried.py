import math

import numpy as np
import pytest

from tests.campaign.dice import Dice
from tests.campaign.draw import draw_chain, draw_start
from tests.campaign.draw_forces import smooth_effects
from tests.ensembles.falls import DURATION, FALL, check_bounds, random_starts
from twolink.ensembles import carried
from twolink.ensembles.alone import shares_round_off
from twolink.ensembles.carried import carried_ends
from twolink.ensembles.compiled import System
from twolink.ensembles.marching import marched
from twolink.ensembles.step import Rows
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.motion import has_events

SYSTEM = System(FALL.moving_chain, FALL.effects, ())


def ends_of(q, u, accuracy, system=SYSTEM, duration=DURATION):
    numbers = np.zeros((0, q.shape[1]))
    return carried_ends(system, system.lanes(numbers, q, u, duration), numbers, accuracy)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("accuracy", [0.1, 1e-4, 1e-7, 1e-9])
def test_the_bound_holds_and_is_not_far_above_the_error(accuracy, random):
    q, u = random_starts(random, 41)
    ends, lost, steps = ends_of(q, u, accuracy)
    assert not lost.any()
    assert steps > 41 * 10
    check_bounds(ends, q, u)


def test_runs_are_made_again_where_shorter_steps_help(random, monkeypatch):
    made = []

    def noted(step, runs):
        made.append((runs.state.shape[1], runs.parameters[0, 0]))
        return marched(step, runs)

    monkeypatch.setattr(carried, "marched", noted)
    q, u = random_starts(random, 40)
    ends, _, _ = ends_of(q, u, 1e-6, duration=10.0)
    (count, first), (again, last) = made
    assert (count, first, last) == (40, pytest.approx(1e-12), 1e-15)
    assert 0 < again < 10
    # The others have grown round-off.
    assert again < (ends.errors > 1e-6).sum() + 10


def test_runs_without_a_finite_start_or_end_are_lost(random):
    q, u = random_starts(random, 9)
    u[0, 3] = math.inf
    q[1, 5] = math.nan
    ends, lost, _ = ends_of(q, u, 1e-6)
    assert np.flatnonzero(lost).tolist() == [3, 5]
    assert np.isnan(ends.errors[lost]).all()
    assert np.isfinite(ends.errors[~lost]).all()


def test_large_errors_are_unknown_and_leave_the_state():
    # The unstable poses multiply errors over 60 s without a bound.
    q, u = np.array([[-1.4, 1.6], [3.0, 1.5]]), np.zeros((2, 2))
    ends, lost, _ = ends_of(q, u, 1e-6, duration=60.0)
    assert ends.errors[0] == math.inf
    assert ends.errors[1] < 1e-6
    assert not lost.any()
    assert np.isfinite(ends.q).all()


@pytest.mark.parametrize("part", ["centre", "shape"])
def test_a_region_that_is_not_a_number_is_unknown(part, random, monkeypatch):
    """Its largest size so far does not show it."""

    def spoilt(step, runs):
        found = marched(step, runs)
        getattr(Rows.of(found), part)[1, 2] = math.nan
        return found

    monkeypatch.setattr(carried, "marched", spoilt)
    ends, lost, _ = ends_of(*random_starts(random, 5), 1e-9)
    assert np.isinf(ends.errors).tolist() == [False, False, True, False, False]
    assert not lost.any()
    assert np.isfinite(ends.q).all()


def test_a_chain_at_rest_in_equilibrium_stays_there():
    hanging = np.full((2, 1), math.pi / 2)
    ends, _, _ = ends_of(hanging, np.zeros((2, 1)), 0.1, duration=1000.0)
    assert np.abs(ends.q - math.pi / 2).max() < 1e-12
    assert ends.errors[0] < 1e-9


@pytest.mark.slow
def test_true_errors_of_random_scenes_are_below_their_bounds():
    ratios = []
    for index in range(16):
        dice = Dice(700, index)
        chain, duration = draw_chain(dice), dice.pick([0.5, 3.0, 10.0])
        effects = tuple(smooth_effects(dice, chain, duration))
        accuracy = dice.pick([1e-1, 1e-3, 1e-5, 1e-7, 1e-9])
        starts = [draw_start(dice, dice.pick(("random", "at rest", "stretched"))) for _ in range(3)]
        scene = Scene(chain, *starts[0], duration, effects)
        if not has_events(scene):
            ratios += list(_ratios(scene, starts, accuracy))
    assert len(ratios) > 15
    assert max(ratios) < 1


def _ratios(scene, starts, accuracy):
    """Yield the true errors relative to the bounds where these are small."""
    system = System(scene.moving_chain, scene.effects, ())
    q, u = np.moveaxis(np.array(starts), 0, -1)
    ends, lost, _ = ends_of(q, u, accuracy, system, scene.duration)
    lanes = system.lanes(np.zeros((0, len(starts))), q, u, scene.duration)
    unfit = shares_round_off(lanes, carried=True) | lost
    for k, (q0, u0) in enumerate(starts):
        bound = ends.errors[k]
        if unfit[k] or not bound < 1e-3:
            continue
        start = Scene(scene.chain, q0, u0, scene.duration, scene.effects)
        run = simulate(start, accuracy=min(1e-11, max(bound / 100, 1e-15)), samples=2)
        found = np.concatenate([ends.q[:, k], ends.u[:, k]])
        error = np.abs(found - np.concatenate([run.q[:, -1], run.u[:, -1]])).max()
        yield max(0.0, float(error) - run.error) / bound
