"""Pairs of runs: each bound is the sum of its parts, and the growth is measured once, or anew."""

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.integration.precisions import PRECISIONS
from twolink.scene import Scene
from twolink.simulation.smooth.growth_along import RoundOffGrowth
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.simulation.smooth.pairs import Pair, Pairs
from twolink.simulation.smooth.round_off import MOST_ROUND_OFF, sums
from twolink.simulation.smooth.runs import Runs

TIMES = np.linspace(0.0, 3.0, 7)
FALL = Scene(Chain.uniform_bars(), (0.3, -0.4), (0.1, 0.2), 3.0, (Gravity(),))
DAMPED = Scene(
    Chain.uniform_bars(), (0.3, -0.4), (0.1, 0.2), 3.0, (Gravity(), JointDamping((0.2, 0.1)))
)


def runs_of(scene):
    def quiet(name):
        return lambda share: None

    return Runs(scene, TIMES, "momenta", quiet, default_longest_step(scene))


def test_a_bound_is_the_sum_of_a_difference_and_of_shared_round_off():
    found = Pairs(runs_of(FALL)).pair("double", (11, 15))
    growth = RoundOffGrowth(np.full(7, 1e3), np.full(7, 5e3))
    known = found._replace(apart=np.full(7, 1e-6), shared=np.full(7, 1e-9), growth=growth)
    rounding = PRECISIONS["double"].rounding
    carried = MOST_ROUND_OFF * rounding * 5e3
    assert known.bound(2.0, 1e-10) == pytest.approx(2e-6 + 1e-9 + 1e-10 + carried, rel=1e-12)
    # Four times the growth from the start is more.
    more = known._replace(growth=RoundOffGrowth(np.full(7, 2e3), np.full(7, 5e3)))
    assert more.bound(0.0, 0.0) == pytest.approx(1e-9 + MOST_ROUND_OFF * rounding * 8e3, rel=1e-12)


@pytest.mark.parametrize("place", [0, 1])
def test_an_unknown_growth_leaves_the_error_unknown(place):
    found = Pairs(runs_of(FALL)).pair("double", (11, 15))
    growth = [np.ones(7), np.ones(7)]
    growth[place][4:] = np.inf
    bound = found._replace(growth=RoundOffGrowth(*growth)).bound(2.0, 0.0)
    assert np.isfinite(bound[:4]).all()
    assert np.isinf(bound[4:]).all()


def test_the_growth_from_the_start_takes_two_runs_for_all_pairs():
    runs = runs_of(FALL)
    pairs = Pairs(runs)
    first = pairs.pair("double", (9, 13))
    assert len(runs.made) == 4
    second = pairs.pair("double", (13, 17))
    assert len(runs.made) == 5
    assert second.growth.from_start is first.growth.from_start
    assert not second.growth.of_steps.any()


def test_later_errors_are_followed_along_each_run():
    pairs = Pairs(runs_of(DAMPED))
    first, second = pairs.pair("double", (9, 13)), pairs.pair("double", (13, 17))
    assert first.growth.of_steps[-1] > 1.0
    assert second.growth.of_steps is not first.growth.of_steps
    assert second.growth.of_steps == pytest.approx(first.growth.of_steps, rel=0.5)


def test_shared_round_off_has_that_of_as_many_sums_as_steps():
    pairs = Pairs(runs_of(FALL))
    found = pairs.pair("double", (9, 13))
    assert isinstance(found, Pair)
    most = max(found.kept, found.judge, key=lambda run: run.steps)
    assert np.all(found.shared >= sums(most, TIMES))
    grown = np.full(7, 1e9)
    assert np.all(pairs.shared(found.kept, grown) >= pairs.shared(found.kept, 0 * grown))
