import math
from fractions import Fraction

import numpy as np
import pytest

from tests.campaign.dice import Dice
from tests.campaign.draw import draw_chain, draw_start
from tests.campaign.draw_forces import smooth_effects
from tests.ensembles.cases import starts
from tests.ensembles.falls import DURATION, FALL, check_bounds, random_starts
from twolink.chain import Chain
from twolink.effects import Gravity, JointDamping, JointTorque
from twolink.ensembles import carried
from twolink.ensembles.alone import shares_round_off
from twolink.ensembles.carried import carried_ends, tolerances
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.compiled import System
from twolink.ensembles.lane_rows import Rows
from twolink.ensembles.marching import marched
from twolink.ensembles.quantity import Accumulator
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.motion import has_events

SYSTEM = System(FALL.moving_chain, FALL.effects, ())


def carried_of(q, u, accuracy, system=SYSTEM, duration=DURATION, tolerance=None, **more):
    numbers = np.zeros((0, q.shape[1]))
    lanes = system.lanes(numbers, q, u, duration)
    tolerance = tolerance or tolerances(accuracy)[0]
    return carried_ends(system, lanes, numbers, tolerance, accuracy, **more)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("accuracy", [0.1, 1e-4, 1e-7, 1e-9])
def test_the_bound_holds_and_is_not_far_above_the_error(accuracy, random):
    q, u = random_starts(random, 41)
    found = carried_of(q, u, accuracy)
    assert not found.lost.any()
    assert found.steps > 41 * 10
    check_bounds(found.ends, q, u)


def test_tolerances_fall_to_the_least():
    assert tolerances(1e-6) == [pytest.approx(1e-12), 1e-15]
    assert tolerances(1e-10) == [1e-15]


def test_shorter_steps_improve_runs_that_are_inaccurate_by_truncation(random):
    q, u = random_starts(random, 40)
    # Steps of a tolerance of 1e-8 for an accuracy of 1e-10.
    found = carried_of(q, u, 1e-10, tolerance=1e-8)
    finer = carried_of(q, u, 1e-10, tolerance=1e-15)
    assert found.improvable.sum() > 5
    assert (finer.bounds < found.bounds)[found.improvable].all()
    assert (found.bounds > 1e-10)[found.improvable].all()
    # Round-off that has grown stays.
    assert not finer.improvable.any()


def test_runs_without_a_finite_start_or_end_are_lost(random):
    q, u = random_starts(random, 9)
    u[0, 3] = math.inf
    q[1, 5] = math.nan
    found = carried_of(q, u, 1e-6)
    assert np.flatnonzero(found.lost).tolist() == [3, 5]
    assert np.isnan(found.ends.errors[found.lost]).all()
    assert np.isfinite(found.ends.errors[~found.lost]).all()


def test_large_errors_are_unknown_and_leave_the_state():
    # The unstable poses multiply errors over 60 s without a bound.
    q, u = np.array([[-1.4, 1.6], [3.0, 1.5]]), np.zeros((2, 2))
    found = carried_of(q, u, 1e-6, duration=60.0)
    assert found.ends.errors[0] == math.inf
    assert found.ends.errors[1] < 1e-6
    assert found.improvable.tolist() == [True, False]
    assert not found.lost.any()
    assert np.isfinite(found.ends.q).all()


@pytest.mark.parametrize("part", ["centre", "shape"])
def test_a_region_that_is_not_a_number_is_unknown(part, random, monkeypatch):
    """Its largest size so far does not show it."""

    def spoilt(step, runs):
        found = marched(step, runs)
        getattr(Rows.of(found), part)[1, 2] = math.nan
        return found

    monkeypatch.setattr(carried, "marched", spoilt)
    found = carried_of(*random_starts(random, 5), 1e-9)
    assert np.isinf(found.ends.errors).tolist() == [False, False, True, False, False]
    assert not found.lost.any()
    assert np.isfinite(found.ends.q).all()


def test_a_chain_at_rest_in_equilibrium_stays_there():
    hanging = np.full((2, 1), math.pi / 2)
    ends = carried_of(hanging, np.zeros((2, 1)), 0.1, duration=1000.0).ends
    assert np.abs(ends.q - math.pi / 2).max() < 1e-12
    assert ends.errors[0] < 1e-9


def test_roundings_of_a_steady_spin_do_not_add_up():
    """A torque against a damper: 8/3 u + c q1 = τ t + 8/3 u(0), with u = τ/c at the end."""
    torque, duration = 1.4546, 1000.0
    effects = (JointDamping((1.0, 1.0)), JointTorque((torque, 0.0)))
    system = System(FALL.moving_chain, effects, ())
    still = np.zeros((2, 1))
    ends = carried_of(still, still, 1e-9, system, duration).ends
    exact = Fraction(torque) * (Fraction(duration) - Fraction(8, 3))
    error = abs(Fraction(float(ends.q[0, 0])) - exact)
    # 1454 rad have roundings of 1e-13.
    assert error < 3e-13
    assert error < ends.errors[0]


@pytest.mark.parametrize(
    ("g", "mass", "q", "u", "duration", "accuracy"),
    [
        (
            6.608212099043481, 0.11432726018159851, (-0.34049655447313, -0.248589610642159),
            (-0.5625085149348533, -0.5338774694412396), 0.1582773422670891, 1e-3,
        ),
        (
            17.647272734727004, 0.10042263706958039, (2.9181065298819098, 2.63077505820071),
            (0.5077346219976098, -0.2702120013903009), 0.16030284104442605, 0.1,
        ),
        (
            5.619824909201586, 1.488116908348296, (2.6495736902502527, -1.9550732584526953),
            (0.2710418290951873, 0.154323061309663), 0.43755078885834264, 0.1,
        ),
    ],
)  # fmt: skip
def test_a_bound_holds_where_the_last_defect_is_small_by_chance(g, mass, q, u, duration, accuracy):
    scene = Scene(Chain.uniform_bars((1.0, mass)), q, u, duration, (Gravity(g),))
    system = System(scene.moving_chain, scene.effects, ())
    found = carried_of(np.array([q]).T, np.array([u]).T, accuracy, system, duration)
    assert found.steps == 3
    truth = simulate(scene, accuracy=1e-15, samples=2)
    ends = np.concatenate([found.ends.q, found.ends.u])[:, 0]
    error = np.abs(ends - np.concatenate([truth.q[:, -1], truth.u[:, -1]])).max()
    assert 1e-13 < error < found.ends.errors[0]


class _Ending(Accumulator):
    """An accumulator that asks for no step, and needs no more of half of the runs."""

    def add(self, block):
        raise AssertionError

    def values(self, ends):
        return {}

    def known(self):
        return np.arange(8) < 4


def test_brief_runs_end_where_nothing_more_is_needed(random):
    q, u = random_starts(random, 8)
    whole = carried_of(q, u, 1e-6, accumulators=[_Ending()])
    brief = carried_of(q, u, 1e-6, accumulators=[_Ending()], brief=True)
    assert not brief.lost.any()
    assert brief.steps < whole.steps
    assert np.array_equal(brief.ends.q[:, 4:], whole.ends.q[:, 4:])
    assert np.array_equal(brief.bounds[4:], whole.bounds[4:])
    # The last step of a run that ends early counts by its tolerance.
    tolerance = tolerances(1e-6)[0]
    assert (brief.bounds >= tolerance)[:4].all()
    assert (brief.bounds <= whole.bounds + 1.01 * tolerance)[:4].all()


def test_compiled_rates_that_are_not_those_of_the_formulas_are_noticed(random):
    heavier = System(FALL.moving_chain.convert(lambda x: 1.01 * float(x)), FALL.effects, ())
    q, u = random_starts(random, 3)
    none = np.zeros((0, 3))
    with pytest.raises(SimulationError, match="must be those of the formulas; got others"):
        carried_ends(SYSTEM, heavier.lanes(none, q, u, 1.0), none, 1e-12, 1e-6)


def test_errors_are_measured_where_nothing_is_kept():
    bare, kept = (
        rows_of(starts(3, runs={"accuracy": 1e-8, "duration": 5.0}, keep=keep), 0, 9).arrays
        for keep in ({}, {"final": True})
    )
    assert np.array_equal(bare["error"], kept["error"])
    assert np.isfinite(bare["error"]).all()


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
    found = carried_of(q, u, accuracy, system, scene.duration)
    ends, lost = found.ends, found.lost
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
