"""The estimated errors of the lanes of a bundle, against more precise runs."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from benchmarks.certainty import random_scene
from twolink import lagrange
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.pd_control import PdControl
from twolink.scene import Scene
from twolink.simulation.smooth.bundle_plan import BundlePlan, growth_of, missed_by_step
from twolink.simulation.smooth.bundled import bundled, can_be_compared, start_of
from twolink.simulation.smooth.bundles import FIRST, LONGEST, MOVED, RATIOS, SECOND
from twolink.simulation.smooth.judging import truncation
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.simulation.smooth.taylor import taylor_run

GRAVITY = (Gravity(),)
BARS = Chain.uniform_bars()
CALM = Scene(BARS, (0.3, -0.4), (0.1, 0.2), 10.0, GRAVITY)
WHIP = Scene(Chain.point_masses((1e-3, 1.0), (1.0, 1.0)), (0.3, 2.5), (0.0, 0.0), 4.0, GRAVITY)
UP = -math.pi / 2

HARD = {
    "every fourth coefficient": Scene(BARS, (0.0, 0.0), (0.0, 0.0), 10.0, GRAVITY),
    "stretched, at rest": Scene(BARS, (0.4, 0.4), (0.0, 0.0), 10.0, GRAVITY),
    "upright, nearly at rest": Scene(BARS, (UP, UP), (0.0, 1e-3), 10.0, GRAVITY),
    "hanging, nearly at rest": Scene(BARS, (-UP, -UP), (0.0, 1e-6), 10.0, GRAVITY),
    "no forces": Scene(BARS, (0.3, 1.0), (2.0, -1.0), 10.0, ()),
    "whip": WHIP,
    "a part of a step": Scene(BARS, (0.3, -0.4), (0.1, 0.2), 0.01, GRAVITY),
}


def times_of(scene):
    return np.linspace(0.0, scene.duration, 41)


def lanes_of(scene, order=15, size=30.0, visit=()):
    return bundled(
        scene, times_of(scene), BundlePlan(order, size), formulation="momenta",
        longest_step=default_longest_step(scene), visit=np.array(visit, float),
    )  # fmt: skip


def exact_of(scene, precision="quadruple"):
    found = taylor_run(scene, times_of(scene), formulation="kane", precision=precision)
    return np.concatenate([found.q, found.u])


def true_error(run, exact):
    """Return the largest error; the exact run has longer numbers."""
    states = np.concatenate([run.q, run.u]).astype(exact.dtype)
    return float(np.abs(states - exact).max().astype(float))


def assert_bounded(found, exact):
    """Return whether the errors are known; they must be bounded then."""
    if found.bounds is None:
        return False
    first, second = found.bounds
    assert true_error(found.first, exact) <= first + 1e-14
    assert true_error(found.second, exact) <= second + 1e-14
    return True


@pytest.mark.parametrize("order", [9, 11, 13, 15, 17, 19])
def test_the_errors_are_bounded(order):
    exact = exact_of(CALM)
    for size in (20.0, 60.0, 200.0):
        known = assert_bounded(lanes_of(CALM, order, size), exact)
        assert known or order < 15


@pytest.mark.parametrize("name", HARD)
def test_the_errors_are_bounded_where_series_or_steps_are_special(name):
    exact = exact_of(HARD[name])
    for order, size in ((9, 10.0), (13, 100.0), (15, 30.0)):
        assert_bounded(lanes_of(HARD[name], order, size), exact)
    assert assert_bounded(lanes_of(HARD[name], 19, 100.0), exact)


@pytest.mark.slow
@pytest.mark.parametrize("order", [11, 15, 19])
def test_the_errors_of_random_motions_are_bounded(order, random):
    compared = 0
    for _ in range(60):
        scene = random_scene(random, events=False)
        exact = exact_of(scene, "long double")
        largest = max(1.0, float(np.abs(exact).max().astype(float)))
        compared += assert_bounded(lanes_of(scene, order, 5.0 * largest), exact)
    assert compared > {11: 5, 15: 20, 19: 40}[order]


def test_the_estimate_is_the_largest_of_two():
    found = lanes_of(CALM)
    coarser = slice(SECOND, LONGEST + 1)
    apart = np.abs(found.found.motions - found.found.motions[FIRST]).max(axis=(1, 2))
    by_lane = apart[coarser] / RATIOS[coarser]
    assert found.estimate == pytest.approx(by_lane.max())
    assert by_lane.max() > 1.2 * by_lane.min()


def test_the_estimate_is_at_least_what_the_growth_from_the_start_lets_expect():
    """It may vanish in both lanes by chance."""
    usual = lanes_of(CALM)
    motions = usual.found.motions.copy()
    motions[[SECOND, LONGEST]] = motions[FIRST]
    vanished = replace(usual.lanes, found=usual.found._replace(motions=motions))
    found = replace(usual, lanes=vanished)
    part = 30.0 / found.largest * truncation(15)
    from_start = np.abs(motions[MOVED] - motions[FIRST]).max()
    assert found.estimate == pytest.approx(12 * part * from_start / found.moved)
    assert found.estimate > usual.estimate / 100
    assert found.growth == pytest.approx(4 * from_start / found.moved)


def test_the_growth_of_an_error_across_is_that_of_the_third_lane():
    """Beyond its truncation errors, which have a ratio to those of the second one."""
    usual = lanes_of(CALM)
    motions = usual.found.motions.copy()
    motions[LONGEST] = motions[FIRST] + 3.0 * (motions[SECOND] - motions[FIRST])
    plain = replace(usual, lanes=replace(usual.lanes, found=usual.found._replace(motions=motions)))
    at_end = np.array([CALM.duration])
    from_start = np.abs(motions[MOVED] - motions[FIRST]).max() / usual.moved
    assert plain.round_off_growth_at(at_end).from_start == pytest.approx([from_start])
    more = motions.copy()
    more[LONGEST, 0, -1] += 1e-2
    found = replace(usual, lanes=replace(usual.lanes, found=usual.found._replace(motions=more)))
    distance = np.abs(more[LONGEST] - more[FIRST]).max()
    second = np.abs(more[SECOND] - more[FIRST]).max()
    expected = (distance - 1.2 * 3.0 * second) / usual.moved
    assert expected > 10 * from_start
    assert found.round_off_growth_at(at_end).from_start == pytest.approx([expected])


def test_at_the_cap_the_estimate_is_that_of_the_lanes():
    """Steps are far shorter there than those of the order."""
    short = replace(CALM, duration=1e-3)
    found = lanes_of(short)
    apart = np.abs(found.found.motions - found.found.motions[FIRST]).max(axis=(1, 2))
    assert found.estimate <= apart.max() / RATIOS[SECOND]


def test_the_growth_is_at_least_that_of_an_error_of_the_start():
    """Links that spin folded stay so in all lanes of the same start, but for round-off."""
    spin = Scene(Chain.point_masses(), (1.0, 1.0 + math.pi), (2.0, 2.0), 12.0, ())
    found = lanes_of(spin, 17, 30.0)
    moved = spin.q[0] + found.moved * spin.q[1], spin.q[1] - 0.7 * found.moved * spin.q[1]
    assert found.found.motions[MOVED, :2, 0] == pytest.approx(moved, rel=1e-15)
    from_start = np.abs(found.found.motions[MOVED] - found.found.motions[FIRST]).max()
    assert found.growth == pytest.approx(4 * from_start / found.moved)
    assert found.growth > 1e6
    assert_bounded(found, exact_of(spin))
    # As the lanes show it, the growth is far too small.
    assert growth_of(found.estimate, 30.0 / found.largest * truncation(17)) <= found.growth / 5


def test_the_error_of_the_second_lane_is_its_distance_from_the_first():
    found = lanes_of(CALM)
    exact = exact_of(CALM)
    true = true_error(found.second, exact)
    apart = np.concatenate([found.second.q - found.first.q, found.second.u - found.first.u])
    assert true == pytest.approx(np.abs(apart).max(), rel=0.05)
    # It is larger between the samples.
    assert true < found.distance < 4 * true
    assert true_error(found.first, exact) < true / 50


def test_an_error_that_decays_at_once_is_bounded_where_steps_end():
    """Between two ends of steps, where lanes are compared, it is a part of that at the ends."""
    chain = Chain.uniform_bars((1.0, 1.07), (1.0, 0.42))
    control = PdControl((0.5, -1.0), (2873.0, 150.0), (5.0, 18.0))
    stiff = Scene(chain, (1.0, -0.5), (0.0, 0.0), 1.0, (Gravity(), control))
    found = lanes_of(stiff, 15, 90.0, np.linspace(0.0, 1.0, 161))
    run = found.second
    ends = np.array([0.0, *run.ends[: run.steps]])
    times = np.unique([*ends, *(ends[:-1] + 0.98 * np.diff(ends))])
    q, u = run.dense()(times)
    exact = taylor_run(stiff, times, formulation="kane", precision="long double")
    true = np.abs(np.concatenate([q - exact.q, u - exact.u])).max()
    assert 2 * found.distance + 20 * found.estimate < true <= found.bounds.second


def test_the_start_shows_the_largest_variable_and_the_speed_of_a_step():
    heavy = replace(CALM, chain=Chain.uniform_bars((1e6, 1e6), (1.0, 1.0)), u=(2.0, 3.0))
    start = start_of(heavy, "momenta", 0.5)
    momenta = lagrange.momenta(heavy.chain, heavy.q, heavy.u)
    assert start.largest == pytest.approx(np.abs(momenta).max())
    assert start.speed < 1e-4
    tiny = replace(CALM, chain=Chain.uniform_bars((1e-6, 1e-6), (1.0, 1.0)))
    assert start_of(tiny, "momenta", 0.5).speed == 200.0
    assert start_of(tiny, "lagrange", 0.5) == (1.0, 1.0)


@pytest.mark.parametrize("mass", [1e-8, 1e8])
def test_bounds_do_not_depend_on_the_unit_of_mass(mass):
    """Momenta are small, and so are their errors, or large, and those of angles are not."""
    scaled = replace(CALM, chain=Chain.uniform_bars((mass, mass), (1.0, 1.0)))
    usual, size = lanes_of(CALM), 30.0
    if mass > 1:
        # The size is that of the momenta.
        size = 3 * start_of(replace(scaled, u=(5.0, 8.0)), "momenta", 0.3).largest
    found = lanes_of(scaled, size=size)
    assert found.bounds.second < 10 * usual.bounds.second
    assert_bounded(found, exact_of(scaled))


def test_a_motion_that_becomes_slow_is_compared_at_few_times():
    """Even times for the speed at its start would be many more than steps."""
    fast = Scene(BARS, (0.3, 2.9), (0.0, 225.0), 3.0,
                 (Gravity(), JointDamping((0.0, 0.3))))  # fmt: skip
    found = lanes_of(fast)
    assert found.grid.size < 1200
    assert lanes_of(fast, visit=found.lanes.places).lanes.is_resolved


def test_the_growth_is_that_of_a_truncation_error():
    found = lanes_of(CALM)
    grown = found.grown_at(times_of(CALM))
    assert np.all(np.diff(grown) >= 0)
    assert grown[-1] == found.growth
    part = 30.0 / found.largest * truncation(15)
    assert found.growth == pytest.approx(growth_of(found.estimate, part))
    finer = lanes_of(CALM, 17)
    assert found.growth / 20 < finer.growth < found.growth * 20


def test_the_error_is_unknown_where_a_variable_exceeds_the_size():
    """The steps of all lanes are then nearly equal, and so are the lanes."""
    spinning = Scene(BARS, (0.3, -0.4), (500.0, 500.0), 10.0, ())
    found = lanes_of(spinning, 15, 5.0)
    assert found.largest > 4000.0
    assert found.growth is None
    assert np.all(np.isinf(found.estimates))
    assert lanes_of(spinning, 15, 2 * found.largest).growth is not None


def test_a_step_misses_more_where_a_variable_exceeds_the_size():
    """The size of the state is then that of the variable."""
    spinning = Scene(BARS, (0.3, -0.4), (30.0, 30.0), 2.0, ())
    largest = lanes_of(spinning, 19, 1e4).largest
    inside, outside = (lanes_of(spinning, 19, part * largest) for part in (1.0, 0.5))
    assert outside.growth is not None
    for found in (inside, outside):
        assert found.bounds.first >= 0.99 * missed_by_step(19, largest)
        assert_bounded(found, exact_of(spinning))


def test_errors_that_are_too_large_to_grow_in_proportion_bound_nothing():
    coarse = lanes_of(CALM, 9, 200.0)
    assert coarse.growth is not None
    assert not coarse.is_linear
    assert coarse.bounds is None
    assert coarse.known.growth == 4 * coarse.growth
    assert lanes_of(CALM, 15).is_linear


def test_a_plan_of_smaller_truncation_errors_is_finer():
    found = lanes_of(CALM, 15, 30.0)
    assert found.is_coarser_than(BundlePlan(17, 30.0))
    assert found.is_coarser_than(BundlePlan(15, 15.0))
    for other in (BundlePlan(15, 30.0), BundlePlan(13, 30.0), BundlePlan(17, 30.0 * math.exp(5))):
        assert not found.is_coarser_than(other)
    spinning = Scene(BARS, (0.3, -0.4), (500.0, 500.0), 10.0, ())
    assert lanes_of(spinning, 15, 5.0).is_coarser_than(BundlePlan(15, 1e5))


def test_a_plan_does_not_see_truncation_errors_as_growth_of_round_off():
    """Those of the third lane may exceed their ratio to the second one's by some times."""
    coarse, fine = lanes_of(CALM, 11, 30.0), lanes_of(CALM, 19, 30.0)
    assert coarse.of_round_off > 5 * fine.of_round_off
    assert coarse.known.of_round_off < 3 * fine.of_round_off


def test_a_fast_turn_is_resolved_by_more_times():
    """The speed of the tip of a whip peaks within a thousandth of a swing."""
    first = lanes_of(WHIP, 15, 30.0)
    assert not first.lanes.is_resolved
    again = lanes_of(WHIP, 15, 30.0, first.lanes.places)
    assert again.lanes.is_resolved
    seen, peak = (np.abs(found.found.motions[0, 2:]).max() for found in (first, again))
    assert peak > 3 * seen
    assert again.estimate > 10 * first.estimate


@pytest.mark.parametrize("scene", [CALM, WHIP])
def test_lanes_are_compared_in_each_step_of_the_last_one(scene):
    found = lanes_of(scene, visit=lanes_of(scene).lanes.places)
    assert found.lanes.is_resolved
    ends = np.array([0.0, *found.found.ends[LONGEST, : found.found.steps[LONGEST]]])
    for begin, end in pairwise(ends):
        assert np.any((found.grid > begin) & (found.grid <= end))


def test_a_long_motion_is_resolved():
    """Lanes wait for each other at the ends of its parts, and so have equal times there."""
    chain = Chain.uniform_bars()
    long = Scene(chain, (1.5, 1.4), (0.1, 0.0), 700.0, GRAVITY)
    assert long.duration > 2 * 500 * default_longest_step(long)
    found = lanes_of(long, 15, 30.0)
    again = lanes_of(long, 15, 30.0, found.lanes.places)
    assert again.lanes.is_resolved
    repeated = np.diff(again.found.ends[LONGEST]) == 0
    assert np.count_nonzero(repeated) > 2


@pytest.mark.parametrize(("order", "size"), [(15, 30.0), (19, 100.0), (19, 3e3)])
def test_places_of_a_bundle_resolve_a_later_one(order, size):
    """Its steps are shorter, or longer, and its motion is another one where errors are large."""
    coarse = lanes_of(WHIP, 13, 300.0)
    assert not coarse.lanes.is_resolved
    later = lanes_of(WHIP, order, size, coarse.lanes.places)
    assert later.lanes.is_resolved
    # No times are compared that the motion does not need.
    assert len(later.grid) <= len(coarse.lanes.places) + len(times_of(WHIP))


def test_comparison_at_more_times_leaves_the_motion_as_it_is():
    few, many = lanes_of(WHIP), lanes_of(WHIP, visit=np.linspace(0.0, 4.0, 999))
    for name in ("first", "second"):
        assert np.array_equal(getattr(few, name).q, getattr(many, name).q)
    assert few.found.steps == many.found.steps


@pytest.mark.parametrize(
    ("duration", "count", "possible"),
    [(10.0, 501, True), (1e3, 501, True), (1e4, 501, False), (10.0, 30_000, False)],
)
def test_motions_are_compared_at_a_bounded_number_of_times(duration, count, possible):
    assert can_be_compared(duration, 1.0, count) == possible


def test_a_chain_that_stays_at_rest_has_no_error():
    assert lanes_of(Scene(BARS, (0.3, 1.0), (0.0, 0.0), 10.0, ())).bounds == (0.0, 0.0)


def test_a_short_motion_has_differences():
    short = lanes_of(replace(CALM, duration=1e-3), 9, 10.0)
    assert min(short.found.steps) >= 8
    assert 0 < short.estimate < 1e-13
