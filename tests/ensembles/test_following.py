import math
from dataclasses import replace

import numpy as np
import pytest

from tests.ensembles.cases import starts
from tests.ensembles.falls import DURATION, FALL, check_bounds, random_starts, with_wild_neighbours
from twolink.chain import Chain
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.compiled import LANES, System
from twolink.ensembles.following import Follower, LostError
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation.smooth.taylor import taylor_run


def followed(q, u, order, scene=FALL, duration=DURATION, growths=None):
    """Return a follower of starts that has come to the end, and its blocks."""
    system = System(scene.moving_chain, scene.effects, ())
    none = np.zeros((0, LANES))
    follower = Follower(system, system.lanes(none, q, u, duration), none, order, growths)
    blocks = [tuple(np.copy(part) for part in block[:4]) for block in follower.blocks()]
    return follower, blocks


@pytest.mark.slow_but_first
@pytest.mark.parametrize("order", [7, 11, 15])
def test_the_bound_holds_and_is_not_far_above_the_error(order, random):
    q, u = random_starts(random, LANES)
    follower, _ = followed(q, u, order)
    check_bounds(follower.ends, q, u)


def test_bits_do_not_depend_on_the_neighbours_in_lanes(random):
    q, u = random_starts(random, LANES)
    one, blocks = followed(q, u, 11)
    other, others = followed(*with_wild_neighbours(q, u), 11)
    assert len(others) > len(blocks)
    assert np.array_equal(one.ends.q[:, 1::2], other.ends.q[:, 1::2])
    assert np.array_equal(one.ends.u[:, 1::2], other.ends.u[:, 1::2])
    assert np.array_equal(one.ends.errors[1::2], other.ends.errors[1::2])
    order = random.permutation(LANES)
    mixed, _ = followed(q[:, order], u[:, order], 11)
    assert np.array_equal(one.ends.u[:, order], mixed.ends.u)
    assert np.array_equal(one.ends.errors[order], mixed.ends.errors)


def test_steps_join_and_end_at_the_duration(random):
    _, blocks = followed(*random_starts(random, LANES), 11, duration=20.0)
    starts_of, lengths = (np.concatenate([block[k] for block in blocks]) for k in (0, 1))
    assert len(blocks) > 1
    assert (starts_of[0] == 0).all()
    ends = starts_of + lengths
    assert np.abs(ends[:-1] - starts_of[1:])[lengths[1:] > 0].max() < 1e-12
    assert np.abs(ends.max(axis=0) - 20.0).max() < 1e-12


def test_given_error_growths_enlarge_the_bound(random):
    q, u = random_starts(random, LANES)
    without, _ = followed(q, u, 15)
    grown = np.full_like(without.growths, 1e9)
    with_growths, _ = followed(q, u, 15, growths=grown)
    assert (with_growths.ends.errors >= 8 * 2.0**-52 * 1e9).all()
    assert (with_growths.ends.errors > without.ends.errors).all()


def test_an_error_that_is_too_large_to_be_known_is_infinite():
    # A chaotic motion over a minute: two runs have nothing in common.
    q, u = np.full((2, LANES), 2.8), np.zeros((2, LANES))
    q[0] += np.linspace(0, 0.1, LANES)
    q -= np.pi
    follower, _ = followed(q, u, 7, duration=40.0)
    assert np.isinf(follower.ends.errors).all()


def test_lanes_whose_start_is_not_finite_are_named(random):
    q, u = random_starts(random, LANES)
    u[0, [3, 5]] = 1e200
    with pytest.raises(LostError) as caught:
        followed(q, u, 11)
    assert np.flatnonzero(caught.value.lanes).tolist() == [3, 5]


def test_compiled_rates_that_are_not_those_of_the_formulas_are_noticed(random, monkeypatch):
    system = System(FALL.moving_chain, FALL.effects, ())
    none = np.zeros((0, LANES))
    heavier = System(FALL.moving_chain.convert(lambda x: 1.01 * float(x)), FALL.effects, ())
    lanes = heavier.lanes(none, *random_starts(random, LANES), 1.0)
    with pytest.raises(SimulationError, match="must be those of the formulas; got others"):
        list(Follower(system, lanes, none, 11).blocks())


@pytest.mark.slow
def test_bounds_hold_for_a_thousand_runs():
    """Pairs of runs judge those whose steps are followed; ends alone carry their errors."""
    runs = {"accuracy": 1e-6, "duration": 10.0}
    rows = rows_of(starts(32, runs=runs, keep={"final": True, "extremes": True}), 0, 1024).arrays
    truth = rows_of(starts(32, runs=runs, keep={"final": True}), 0, 1024).arrays
    apart = np.maximum(*(np.abs(rows[k] - truth[k]).max(axis=1) for k in "qu"))
    sure = truth["error"] < rows["error"] / 10
    assert sure.sum() > 200
    assert (apart <= rows["error"] + truth["error"])[sure].all()


@pytest.mark.parametrize("order", [11, 15])
def test_the_bound_holds_where_damping_takes_errors_of_the_start_away(order):
    """A folded arm is spun up until it opens, and leaves its balance by round-off alone."""
    chain, duration = Chain.uniform_bars((1.0, 1.0), (1.0, 1.5)), 9.0
    spring, torque = JointSpring((0.0, 20.0), (0.0, math.pi)), JointTorque((0.8, 0.0))
    arm = Scene(
        chain, (0.0, math.pi), (1.0, 1.0), duration, (spring, JointDamping((0.0, 6.0)), torque)
    )
    first = np.linspace(-1.0, 1.0, LANES)
    q, u = np.array([first, first + math.pi]), np.full((2, LANES), 1.0)
    follower, _ = followed(q, u, order, arm, duration)
    for k in range(LANES):
        start = replace(arm, q=tuple(q[:, k].tolist()))
        exact = taylor_run(start, [0.0, duration], formulation="kane", precision="quadruple")
        last = np.concatenate([exact.q, exact.u])[:, -1].astype(float)
        end = np.concatenate([follower.ends.q, follower.ends.u])[:, k]
        assert 1e-6 < np.abs(end - last).max() <= follower.ends.errors[k]


@pytest.mark.parametrize("order", [11, 15])
def test_the_bound_holds_where_truncation_errors_do_not_show_round_off(order):
    """Links that spin folded leave that by the round-off of the start, which all runs share."""
    chain, duration = Chain.point_masses((1.0, 1.0), (1.0, 0.6)), 8.0
    first = np.linspace(-3.0, 3.0, LANES)
    q, u = np.array([first, first + math.pi]), np.full((2, LANES), 2.0)
    spin = Scene(chain, (0.0, math.pi), (2.0, 2.0), duration, ())
    follower, _ = followed(q, u, order, spin, duration)
    for k in range(LANES):
        start = replace(spin, q=tuple(q[:, k].tolist()))
        ends = np.array([0.0, duration])
        exact = taylor_run(start, ends, formulation="kane", precision="quadruple")
        last = np.concatenate([exact.q, exact.u])[:, -1].astype(float)
        end = np.concatenate([follower.ends.q, follower.ends.u])[:, k]
        assert np.abs(end - last).max() <= follower.ends.errors[k]
