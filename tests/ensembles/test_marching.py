import functools

import numpy as np
import pytest

from tests.ensembles.falls import FALL, random_starts, with_wild_neighbours
from twolink.ensembles import marching
from twolink.ensembles.compiled import System
from twolink.ensembles.lane_rows import LAST, LEFT, ROWS, STEPS, Rows
from twolink.ensembles.marching import Begun, marched
from twolink.ensembles.step import compiled_step
from twolink.simulation.smooth.equations import EQUATIONS

DURATION = 0.5


@functools.cache
def step():
    return compiled_step(System(FALL.moving_chain, FALL.effects, ()))


def begun(q, u, duration=DURATION, longest=0.1):
    p = EQUATIONS["momenta"].from_speeds(FALL.chain, tuple(q), tuple(u))
    count = q.shape[1]
    parameters = np.zeros((6, count))
    parameters[:2] = [[1e-12], [longest]]
    return Begun(np.array([*q, *p]), parameters, duration)


@pytest.mark.parametrize("count", [1, 7, 8, 20])
def test_all_runs_reach_their_ends(count, random):
    found = marched(step(), begun(*random_starts(random, count)))
    assert found.shape == (ROWS, count)
    assert (found[LEFT] == 0).all()
    assert (found[LAST] == 0).all()
    assert (found[STEPS] >= 5).all()


def test_no_runs():
    assert marched(step(), begun(np.zeros((2, 0)), np.zeros((2, 0)))).shape == (ROWS, 0)


def test_rows_of_the_start_do_not_depend_on_the_number_of_runs(random):
    q, u = random_starts(random, 200)
    wide = begun(q, u, longest=1e3).rows(step())
    assert wide.shape == (ROWS, 200)
    alone = [begun(q[:, [k]], u[:, [k]], longest=1e3).rows(step()) for k in range(200)]
    assert np.array_equal(np.hstack(alone), wide)


def test_lanes_are_given_to_the_next_runs_with_the_same_bits(random, monkeypatch):
    q, u = random_starts(random, 60)
    wide = marched(step(), begun(q, u))
    monkeypatch.setattr(marching, "_LANES", 16)
    order = random.permutation(60)
    assert np.array_equal(marched(step(), begun(q[:, order], u[:, order])), wide[:, order])
    alone = np.hstack([marched(step(), begun(q[:, [k]], u[:, [k]])) for k in (3, 41)])
    assert np.array_equal(alone, wide[:, [3, 41]])


def test_bits_do_not_depend_on_the_neighbours(random):
    q, u = random_starts(random, 24)
    one, other = (marched(step(), begun(*pair)) for pair in ((q, u), with_wild_neighbours(q, u)))
    assert np.array_equal(one[:, 1::2], other[:, 1::2])
    assert (other[STEPS, ::2] > 3 * one[STEPS, ::2]).all()


def test_runs_that_are_not_finite_are_lost_alone(random):
    q, u = random_starts(random, 20)
    u[:, 4] = 1e200
    q[0, 11] = np.nan
    rows = Rows.of(marched(step(), begun(q, u)))
    lost = ~np.isfinite(rows.state).all(axis=0)
    assert np.flatnonzero(lost).tolist() == [4, 11]
    others = np.setdiff1d(np.arange(20), [4, 11])
    alone = Rows.of(marched(step(), begun(q[:, others], u[:, others])))
    assert np.array_equal(alone.state, rows.state[:, others])


def test_a_run_whose_terms_overflow_is_lost_at_once(monkeypatch):
    calls = []

    def counted(*arguments, **more):
        calls.append(1)
        return step()(*arguments, **more)

    found = marched(counted, begun(np.zeros((2, 1)), np.array([[1e30], [0.0]])))
    assert np.isnan(found).all()
    assert len(calls) < 20


@pytest.mark.parametrize(("angle", "speed"), [(2e9, 1.0), (1e15, 1.0), (0.5, 1e20), (0.5, 1e100)])
def test_huge_angles_are_lost_and_change_no_bits_of_others(angle, speed, random):
    q, u = random_starts(random, 16)
    plain = marched(step(), begun(q, u))
    q[0, 5], u[0, 5] = angle, speed
    found = marched(step(), begun(q, u))
    assert np.isnan(found[:, 5]).all()
    others = np.setdiff1d(np.arange(16), [5])
    assert np.array_equal(found[:, others], plain[:, others])


def test_runs_of_too_many_steps_have_no_end(random, monkeypatch):
    monkeypatch.setattr(marching, "MOST_STEPS", 20)
    q, u = with_wild_neighbours(*random_starts(random, 8))
    found = marched(step(), begun(q, u))
    assert np.isnan(found[:, ::2]).all()
    assert (found[LEFT, 1::2] == 0).all()


def test_the_first_step_of_a_chain_in_equilibrium_is_that_of_its_oscillation():
    hanging = np.full((2, 1), np.pi / 2)
    runs = begun(hanging, np.zeros((2, 1)), duration=1e3)
    runs.parameters[1] = 1e3
    rows = Rows.of(runs.rows(step()))
    assert rows.frequency[0] > 1.0
    assert rows.left[0] == 1e3
    assert rows.steps[0] == 0
