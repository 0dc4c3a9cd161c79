"""The differences of runs that were tampered with."""

from dataclasses import replace

import numpy as np
import pytest

from tests.campaign.draw import draw_scene
from tests.simulation.hybrid import BOUNCE_TIMES as TIMES
from tests.simulation.hybrid import BOUNCES as SCENE
from tests.simulation.hybrid import tampered
from twolink.chain import Chain
from twolink.contact.impact_laws import Regime
from twolink.effects.gravity import Gravity
from twolink.effects.motor_inertia import MotorInertia
from twolink.effects.surface import Surface
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.differences import (
    _inside,
    _same,
    _within,
    differences,
    impacts_beside,
)
from twolink.simulation.hybrid.run import hybrid_run


def test_two_runs_of_one_motion_differ_by_rounding(run, judge):
    errors = differences(run, judge, TIMES, 1e-9)
    assert errors.shape == TIMES.shape
    assert errors.max() < 1e-12


@pytest.mark.parametrize("variable", [0, 1, 2, 3])
@pytest.mark.parametrize("by", [1e-3, -1e-7])
def test_a_wrong_step_is_seen_from_its_time_on(run, judge, variable, by):
    """And stated with a tenth more."""
    errors = differences(tampered(run, 1.5, variable, by), judge, TIMES, 1e-9)
    assert errors[TIMES < 1].max() < 1e-12
    assert errors[-1] == pytest.approx(abs(by), rel=1e-4)
    assert errors[TIMES > 1.6].min() == pytest.approx(errors[-1], rel=1e-9)


def test_impacts_of_a_burst_are_counted_where_runs_are_further_apart_than_they():
    """Bounces accumulate at 1 s; those of the other run come 1e-9 s later, and two more of them."""
    ours = 1.0 - 0.1 ** np.arange(12.0)
    theirs = 1.0 - 0.1 ** np.arange(14.0) + 1e-9
    assert np.array_equal(_same(ours, theirs, 1e-6), [ours, theirs[:12]])
    assert np.array_equal(_same(theirs, ours, 1e-6), [theirs[:12], ours])


def test_impacts_that_one_run_lacks_do_not_shift_the_others():
    """Nor do they where all impacts are close by a coarse accuracy."""
    ours = np.arange(1.0, 20.0)
    theirs = np.delete(ours, 4) + 1e-3
    for most in (1.0, 100.0):
        assert np.array_equal(_same(ours, theirs, most), [np.delete(ours, 4), theirs])
        assert np.array_equal(_same(theirs, ours, most), [theirs, np.delete(ours, 4)])
    assert _same(ours, theirs, 1e-4).shape == (2, 0)


@pytest.mark.slow
def test_bursts_of_two_contacts_leave_no_error_of_their_own():
    """C2 on one wall and B on another answer each other 63 times within 1e-9 s.

    Which impact of the other run is the same one was decided by its time: the error was 3e-3.
    """
    walls = (
        Surface(
            (0.3028674294584388, -0.46481069211516574),
            (-0.705992074427116, -0.7082197334486646),
            on=("C2",), restitution=0.95, name="s0",
        ),
        Surface(
            (0.26749882860204544, -0.9635581854267488),
            (0.9206901660111403, 0.3902942713010004),
            on=("C1", "B", "C2"), restitution=0.049, friction=1.4, static=1.5143913870560775,
            name="s1",
        ),
    )  # fmt: skip
    rotors = MotorInertia((4.983980064079744e-06, 0.0010197710718002082), (53.0, 31.0))
    chain, u = Chain.uniform_bars(), (0.2417630964047013, -0.0909171505243495)
    scene = Scene(chain, (-1.3, 1.5), u, 0.2, (Gravity(), rotors, *walls))
    motion = simulate(scene, accuracy=1e-9)
    assert len(motion.impacts) > 60
    assert motion.impacts[-1].time < 1e-9
    assert motion.met
    exact = hybrid_run(scene, motion.t, formulation="kane", precision="quadruple")
    off = np.abs(np.concatenate([motion.q - exact.q, motion.u - exact.u])[:, 1:]).max()
    assert float(off) <= motion.error


def test_the_error_never_falls(run, judge):
    errors = differences(tampered(run, 0.1, 0, 1e-5), judge, TIMES, 1e-9)
    assert np.all(np.diff(errors) >= 0)
    assert errors[-1] == pytest.approx(1e-5, rel=1e-4)


def moved_impact(run, by):
    """Return a run in which the first impact comes a little later, and with it all that follows."""
    starts = run.polynomials.starts.copy()
    instant = run.impacts[0].time
    starts[starts >= instant - 1e-12] += by
    strikes = tuple(s._replace(time=s.time + by) for s in run.strikes)
    return replace(run, polynomials=replace(run.polynomials, starts=starts), strikes=strikes)


def test_between_the_instants_of_an_impact_its_delay_counts_and_not_the_jump(run, judge):
    """The speed jumps by 3 rad/s; 1e-9 s later is an error of 1e-9 s, and of some times that in q
    and u after it."""
    errors = differences(moved_impact(run, 1e-9), judge, TIMES, 1e-9)
    assert 1e-9 < errors[-1] < 1e-8


def test_an_impact_that_only_one_run_has_counts_as_its_jump(run, judge):
    without = replace(judge, strikes=())
    errors = differences(moved_impact(run, 1e-3), without, TIMES, 1e-9)
    assert errors[-1] > 1e-3


@pytest.mark.parametrize(("seed", "number", "about"), [(9601, 30, 0.3322), (9701, 7, 0.1882)])
def test_a_run_that_ends_at_an_impact_has_the_error_of_the_speeds_after_it(seed, number, about):
    """Two runs have it at instants of which one is their end, and are not compared beyond."""
    scene = draw_scene(seed, number)
    exact = simulate(scene, accuracy=1e-14)
    time = min((each.time for each in exact.impacts), key=lambda t: abs(t - about))
    ended = simulate(replace(scene, duration=time), samples=3)
    off = np.abs(ended.u[:, -1] - exact.at([time])[1][:, 0]).max()
    assert off <= ended.error + exact.error


def test_runs_are_compared_inside_the_steps_of_both(run):
    """An error may be largest just before an impact that only the run that measures has."""
    short = hybrid_run(SCENE, TIMES, formulation="kane", precision="long double", longest_step=0.01)
    starts = short.polynomials.starts.astype(float)
    own = np.concatenate([TIMES, *_inside(run), run.polynomials.starts])
    # A step without any of the places of the result.
    step = next(
        k for k in range(20, 100) if not ((own >= starts[k]) & (own <= starts[k + 1])).any()
    )
    middle = (starts[step] + starts[step + 1]) / 2
    errors = differences(run, tampered(short, middle, 0, 1e-5), TIMES, 1e-9)
    # At 2.5 s rounding decides whether a run still has an impact.
    assert errors[TIMES < 2.4][-1] == pytest.approx(1e-5, rel=1e-4)


def with_impact(run, number, **changes):
    """Return a run one of whose impacts is another one."""
    strikes = list(run.strikes)
    strikes[number] = strikes[number]._replace(**changes)
    return replace(run, strikes=tuple(strikes))


def test_speeds_of_impacts_are_compared_at_their_own_instants(run, judge):
    later = with_impact(judge, 0, time=judge.strikes[0].time + 1e-8)
    times, speeds, bounds = impacts_beside(run, later, 1e-9)
    assert times == pytest.approx([1.0, 2.0], abs=1e-14)
    expected = np.array([[[-2.0, 0.0], [1.0, 0.0]], [[-1.0, 0.0], [0.5, 0.0]]])
    assert speeds == pytest.approx(expected, abs=1e-14)
    assert bounds.max() < 1e-13


@pytest.mark.parametrize("side", [0, 1])
def test_a_wrong_speed_of_an_impact_is_seen(run, judge, side):
    speeds = [list(pair) for pair in judge.strikes[1].u]
    speeds[side][1] += 1e-6
    other = with_impact(judge, 1, u=tuple(map(tuple, speeds)))
    bounds = impacts_beside(run, other, 1e-9)[2]
    assert bounds[0] < 1e-13
    assert bounds[1] == pytest.approx(3e-6)
    # The speed after the last bounce that is resolved is that of another run's next one.
    ends = other.strikes[1].impulse._replace(regime=Regime.BOUNCES_DIE_AWAY)
    bounds = impacts_beside(run, with_impact(other, 1, impulse=ends), 1e-9)[2]
    assert bounds[1] == pytest.approx(3e-6 * (side == 0), abs=1e-13)


def test_impacts_that_another_run_does_not_have_are_not_compared(run, judge):
    for strikes in ((), judge.strikes[1:]):
        times, speeds, bounds = impacts_beside(run, replace(judge, strikes=strikes), 1e-9)
        assert len(times) == len(speeds) == 2
        assert bounds.max() < 1e-13
    times, speeds, bounds = impacts_beside(replace(run, strikes=()), judge, 1e-9)
    assert (times.shape, speeds.shape, bounds.shape) == ((0,), (0, 2, 2), (0,))


def test_bounces_that_a_run_omits_are_those_between_its_last_bounce_and_its_rest():
    scene = replace(SCENE, duration=3.5)
    run = hybrid_run(scene, [0.0, 3.5])
    assert max(rest - float(arc.start.t) for arc, rest in zip(run.arcs, run.since, strict=True)) > 0
    starts = [float(arc.start.t) for arc in run.arcs]
    times = np.sort([*starts, *run.since, *np.linspace(0, 3.5, 99), *np.linspace(2.99, 3.01, 99)])
    expected = [
        any(start <= t <= rest for start, rest in zip(starts, run.since, strict=True))
        for t in times
    ]
    assert _within(run, times).tolist() == expected
    nothing = replace(run, arcs=(), since=())
    assert not _within(nothing, times).any()


def test_a_second_link_without_length_has_contacts_like_any_other():
    """D is at B: no error is divided by its length."""
    chain = Chain((1.0, 1.0), (0.5, 0.0), ((0.2, 0.0), (0.1, 0.05)), (0.1, 0.1))
    floor = Surface((0.0, 0.4), (0.0, -1.0), on=("B",), restitution=0.5)
    scene = Scene(chain, (0.3, -0.2), (0.0, 0.0), 0.5, (Gravity(), floor))
    runs = [
        hybrid_run(scene, TIMES[:6], precision=precision, formulation=formulation)
        for precision, formulation in (("double", "lagrange"), ("long double", "kane"))
    ]
    assert runs[0].impacts
    assert differences(*runs, TIMES[:6], 1e-9).max() < 1e-12
