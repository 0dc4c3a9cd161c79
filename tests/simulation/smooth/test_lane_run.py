"""The motion of one lane of a bundle, as a run."""

import pickle

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.scene import Scene
from twolink.simulation.motion import motion_run
from twolink.simulation.smooth.bundles import RATIOS
from twolink.simulation.smooth.lane_run import lanes
from twolink.simulation.smooth.taylor import taylor_run

TIMES = np.linspace(0.0, 10.0, 41)
CALM = Scene(Chain.uniform_bars(), (0.3, -0.4), (0.1, 0.2), 10.0, (Gravity(),))


def run_of(number):
    return lanes(CALM, TIMES, formulation="momenta", order=15, size=40.0).run(number, TIMES)


@pytest.fixture(scope="module", params=[0, 1])
def found(request):
    return run_of(request.param)


def test_values_at_any_time_are_those_of_the_same_steps(found):
    q, u = found.dense()(np.array([TIMES[7], 3.21, TIMES[3], TIMES[7]]))
    assert np.array_equal(q[:, [0, 2, 3]], found.q[:, [7, 3, 7]])
    assert np.array_equal(u[:, [0, 2, 3]], found.u[:, [7, 3, 7]])
    times = np.array([0.0, 3.21, 10.0])
    exact = taylor_run(CALM, times, formulation="kane", precision="long double")
    assert np.abs(q[:, 1] - exact.q[:, 1]).max() < 1e-5


def test_the_recipe_repeats_the_run(found):
    recipe = found.recipe
    again = motion_run(
        CALM, TIMES, formulation="momenta", order=recipe.order, longest_step=recipe.longest_step,
        lane=recipe.lane,
    )  # fmt: skip
    assert np.array_equal(again.q, found.q)
    assert np.array_equal(again.u, found.u)


def test_the_boundaries_of_the_steps_are_those_of_the_lane(found):
    times = found.step_times()
    assert len(times) == found.steps + 1 == found.lane_steps[found.lane.number] + 1
    assert times[0] == 0.0
    assert times[-1] == 10.0
    assert np.all(np.diff(times) > 0)


def test_a_stored_run_is_recompiled(found):
    stored = pickle.loads(pickle.dumps(found))
    assert stored.compiled is None
    assert np.array_equal(stored.dense()(TIMES)[0], found.q)


def test_all_lanes_count(found):
    assert found.lanes == len(RATIOS)
    assert found.evaluations == max(found.lane_steps) * found.order * found.operations
    alone = taylor_run(CALM, TIMES, formulation="momenta", order=15)
    of_a_step = alone.arithmetic.number / alone.steps
    # One variable more has a constant rate: one division for each order, and one operation.
    each = found.arithmetic.number / (max(found.lane_steps) * len(RATIOS))
    assert each == of_a_step + 16


def test_the_lanes_are_different_motions():
    first, second = run_of(0), run_of(1)
    assert first.steps > second.steps
    assert 1e-6 < np.abs(first.q - second.q).max() < 1e-3


def test_a_run_has_some_of_the_times_of_its_lanes():
    all_lanes = lanes(CALM, TIMES, formulation="momenta", order=15, size=40.0)
    some = all_lanes.run(1, TIMES[::8])
    assert np.array_equal(some.q, run_of(1).q[:, ::8])
    assert np.array_equal(some.visited.times, TIMES)
