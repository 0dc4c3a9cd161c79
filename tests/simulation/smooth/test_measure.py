"""The measured error of smooth motions, against more precise runs, and where it is hardest."""

import math
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
import pytest

from twolink.accuracy.reference import reference
from twolink.arithmetic import exp, tanh
from twolink.chain import Chain
from twolink.effects import Effect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.errors import IntegrationError
from twolink.integration.precisions import PRECISIONS
from twolink.loads import motor_loads
from twolink.scene import Scene
from twolink.simulation.smooth import measure, prediction
from twolink.simulation.smooth import runs as runs_module
from twolink.simulation.smooth.bundle_plan import BundlePlan
from twolink.simulation.smooth.bundle_search import BundleSearch
from twolink.simulation.smooth.corrected import CorrectedRun
from twolink.simulation.smooth.judging import (
    MARGIN_OF_JUDGES,
    MORE_ORDERS,
    apart,
    difference,
    truncation,
)
from twolink.simulation.smooth.lane_run import LaneRun
from twolink.simulation.smooth.longest_step import pace_of
from twolink.simulation.smooth.measure import measured_run
from twolink.simulation.smooth.round_off import MOST_ROUND_OFF, sums
from twolink.simulation.smooth.runs import Runs
from twolink.simulation.smooth.taylor import TaylorRun, taylor_run
from twolink.simulation.smooth.visited import Common

TIMES = np.linspace(0, 10, 41)
GENERAL = Chain((1.3, 0.8), (1.1, 0.7), ((0.6, 0.1), (0.3, -0.08)), (0.12, 0.03))
UP = -math.pi / 2


GRAVITY = (Gravity(),)


def scene(q, u, chain=GENERAL, effects=GRAVITY):
    return Scene(chain, q, u, 10.0, effects)


HARD = {
    "chaotic": scene((2.5, -2.0), (1.0, -2.5)),
    "reference": scene((0.3, -0.4), (0.1, 0.2), Chain.uniform_bars()),
    "every fourth coefficient": scene((0.0, 0.0), (0.0, 0.0)),
    "stretched, at rest": scene((0.4, 0.4), (0.0, 0.0)),
    "upright, nearly at rest": scene((UP, UP), (0.0, 1e-3)),
    "hanging, nearly at rest": scene((-UP, -UP), (0.0, 1e-6)),
    "no forces": scene((0.3, 1.0), (2.0, -1.0), effects=()),
    "one mass is 400 times the other": scene(
        (1.0, -2.0), (0.5, 0.0), Chain.uniform_bars((20.0, 0.05), (1.0, 0.3))
    ),
    "calm": scene((1.2, 1.4), (0.0, 0.0)),
    "damped": scene((1.0, -2.0), (0.5, 0.0), effects=(Gravity(), JointDamping((0.3, 0.2)))),
}


def quiet(name):
    return lambda share: None


def measured(scene, accuracy, times=TIMES, correct=True, formulation="momenta"):
    return measured_run(
        scene, times, accuracy, formulation, quiet, correct=correct, pace=pace_of(scene)
    )


def true_errors(found, exact):
    """Return the largest error up to each time; the exact run has numbers as long or longer."""
    (own,) = (each for each in PRECISIONS.values() if np.dtype(each.number) == exact.q.dtype)
    pairs = ((found.q, exact.q), (found.u, exact.u))
    miss = [np.abs((own.lengthened(np.asarray(x)) - y).astype(float)) for x, y in pairs]
    return np.maximum.accumulate(np.concatenate(miss).max(axis=0))


def assert_measured(scene, accuracy, times, exact):
    """Return the measured run, after a check that it is accurate, and its errors bounds."""
    found = measured(scene, accuracy, times)
    assert found.worst <= accuracy
    assert np.all(true_errors(found.kept, exact) <= found.errors)
    return found


def test_runs_of_little_truncation_error_share_the_rounding_of_their_first_momenta():
    chain = Chain.uniform_bars((0.05, 20.0), (1.0, 0.3))  # M is ill-conditioned.
    slow = Scene(chain, (0.0, 0.0), (0.0021110036158929466, 0.0023093577244611804), 1.0, ())
    times = np.linspace(0, 1, 61)
    found = measured(slow, 1e-8, times, correct=False)
    exact = taylor_run(slow, times, formulation="kane", precision="quadruple")
    true = true_errors(found.kept, exact).max()
    assert true < found.worst < 1e-13


@pytest.mark.slow
@pytest.mark.parametrize("name", HARD)
def test_the_error_is_bounded_at_all_times_at_all_accuracies(name):
    """The reference has other equations, another order, and quadruple precision."""
    exact = taylor_run(HARD[name], TIMES, formulation="kane", precision="quadruple")
    for digits in range(3, 14):
        for correct in (True, False):
            found = measured(HARD[name], 10.0**-digits, correct=correct)
            assert found.worst <= 10.0**-digits
            assert np.all(true_errors(found.kept, exact) <= found.errors)


@pytest.mark.slow
@pytest.mark.parametrize("order", [7, 9, 11, 13, 15])
def test_four_more_orders_measure_the_error(order, random):
    """r, the error of the judge over that of the run: below 1/2, where the margin is 2."""
    for hard in HARD.values():
        q, u = random.uniform(-3, 3, (2, 2)).tolist()
        start = Scene(hard.chain, tuple(q), tuple(u), 10.0, hard.effects)
        exact = taylor_run(start, TIMES, formulation="kane", precision="long double")
        run, judge = (
            taylor_run(start, TIMES, formulation="momenta", order=p, visit=TIMES)
            for p in (order, order + MORE_ORDERS)
        )
        apart = difference(run, judge)
        known = 2 * apart + sums(run, TIMES)
        assert np.all(true_errors(run, exact) <= known)
        grown = MOST_ROUND_OFF * 1.1e-16 * apart / truncation(order)
        known = MARGIN_OF_JUDGES * apart + sums(judge, TIMES) + grown
        assert np.all(true_errors(judge, exact) <= known)


WHIP = Scene(Chain.point_masses((1e-3, 1.0), (1.0, 1.0)), (0.3, 2.5), (0.0, 0.0), 4.0, GRAVITY)
"""The first link, nearly without mass, turns back within a thousandth of a swing, at 500 rad/s."""


@dataclass(frozen=True)
class Wall(Effect):
    """A torque that grows by e within two thousandths of a radian."""

    def loads(self, chain, q, u, t=0.0):
        s = chain.scalar
        return motor_loads(-s(10.0) * exp((q[0] - s(2.0)) / s(2e-3)), 0.0)


WALL = Scene(Chain.uniform_bars(), (0.3, 0.2), (0.0, 0.0), 3.0, (Gravity(), Wall()))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("start", "samples", "all_digits"),
    [(WHIP, 2, (3, 5, 7, 9, 11)), (WHIP, 101, (3, 7, 11)), (WALL, 2, (3, 7))],
    ids=["whip", "whip, 101 samples", "wall"],
)
def test_an_error_that_peaks_between_all_samples_is_measured(start, samples, all_digits):
    """The true error was up to 57 times the reported one while runs were compared at samples."""
    times = np.linspace(0.0, start.duration, samples)
    ends = measured(start, 10.0 ** -all_digits[-1], times).kept
    finest = ends.raw if isinstance(ends, CorrectedRun) else ends
    steps = finest.visited.ends
    shortest = np.argsort(np.diff(steps))[:60]
    places = np.unique([*steps[shortest], *(steps[shortest] + steps[shortest + 1]) / 2])
    places = np.unique([0.0, *places, start.duration])
    exact = taylor_run(start, places, formulation="kane", precision="quadruple", longest_step=0.05)
    for digits in all_digits:
        found = measured(start, 10.0**-digits, times)
        q, u = found.kept.dense()(places)
        true = max(apart(q, exact.q).max(), apart(u, exact.u).max())
        assert found.worst <= 10.0**-digits
        assert true <= found.worst


def folded(mass, length, angle, speed, duration):
    """Return links that spin folded without loads, on which only round-off acts."""
    chain = Chain.point_masses(mass, length)
    return Scene(chain, (angle, angle + math.pi), (speed, speed), duration, ())


def wheel(q, u, duration, torque):
    """Return a driven pendulum with a small wheel, whose speed at the start is the fastest."""
    chain = Chain((1.0, 0.05), (1.0, 0.05), ((0.5, 0.0), (0.0, 0.0)), (1 / 12, 1e-4))
    driven = JointTorque(amplitude=(torque, 0.0), frequency=(3.0, 0.0))
    return Scene(chain, q, u, duration, (Gravity(), JointDamping((0.0, 1e-4)), driven))


@pytest.mark.parametrize(
    ("start", "accuracy"),
    [
        (folded((1.0, 1.0), (1.0, 1.0), 1.0, 2.0, 12.0), 1e-6),
        (folded((0.5, 1.0), (1.0, 2.0), -2.6, 3.0, 7.0), 1e-7),
        pytest.param(folded((1.0, 1.0), (1.0, 1.5), -2.1, 2.0, 18.0), 1e-3, marks=pytest.mark.slow),
        pytest.param(wheel((-1.0, 0.0), (-1.0, -27.0), 50.0, 2.1), 1e-5, marks=pytest.mark.slow),
        pytest.param(wheel((-1.0, 0.0), (-1.0, -30.0), 50.0, 2.1), 1e-3, marks=pytest.mark.slow),
        pytest.param(wheel((1.0, 0.0), (0.0, 30.0), 45.0, 2.0), 1e-7, marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("formulation", ["momenta", "lagrange"])
def test_round_off_that_truncation_errors_do_not_show_is_in_the_error(start, accuracy, formulation):
    """Lanes that differ by round-off alone had up to 323 times the reported error.

    Truncation errors keep links folded, and are tiny in steps that are short for another link.
    """
    times = np.linspace(0.0, start.duration, 11)
    found = measured(start, accuracy, times, formulation=formulation)
    exact = taylor_run(start, times, formulation="kane", precision="quadruple")
    assert found.worst <= accuracy
    assert np.all(true_errors(found.kept, exact) <= found.errors)


@pytest.mark.slow
def test_runs_of_the_longest_numbers_that_differ_by_round_off_are_not_trusted():
    """Equal pendulums swing together, and leave that by round-off alone."""
    angle = -2.6764157857100614
    chain = Chain((0.5, 1.0), (2.0, 1.0), ((0.5, 0.0), (0.5, 0.0)), (0.25, 0.0))
    start = Scene(chain, (angle, angle + math.pi), (1.0, 1.0), 13.0, GRAVITY)
    times = np.linspace(0.0, 13.0, 5)
    found = measured(start, 1e-10, times)
    exact = reference(start, 16, tuple(times[1:]))
    states = np.array(exact.states, dtype=object)
    kept = np.concatenate([found.kept.q, found.kept.u])[:, 1:].T
    true = max(
        abs(float(Decimal(str(x)) - Decimal(y)))
        for x, y in zip(kept.flat, states.flat, strict=True)
    )
    assert 1e-12 < true <= found.worst


def test_an_error_that_peaks_between_two_comparisons_is_bounded():
    """The tip turns between even times, and its error there is 1.7 times that of all others."""
    chain = Chain.point_masses((0.15215912741281493, 1.0), (1.0, 1.2661816670339068))
    q, u = (-1.1081687191620766, -0.3792470439816913), (-4.603042684757414, 1.391905247504983)
    start = Scene(chain, q, u, 1.908051380612616, GRAVITY)
    found = measured(start, 1.42, np.array([0.0, start.duration]))
    places = np.array([0.0, *np.linspace(1.52, 1.54, 200)])
    exact = taylor_run(start, places, formulation="kane", precision="long double")
    q, u = found.kept.dense()(places)
    true = max(apart(q, exact.q).max(), apart(u, exact.u).max())
    assert 0.3 * found.worst < true <= found.worst


def test_the_round_off_of_values_between_all_samples_counts():
    """The fastest turn is between them."""
    found = measured(WHIP, 1e-11, np.array([0.0, 4.0]))
    assert np.abs(found.kept.u.astype(float)).max() < 100.0
    assert found.errors[-1] > 400.0 * np.finfo(float).eps


def test_a_judge_is_the_result_if_only_it_has_the_accuracy():
    """The difference bounds its error as well, so that no third run is made."""
    hard = HARD["no forces"]
    found = measured(hard, 1e-8, correct=False)
    # Two others show the growth of round-off.
    run, judge, _, _ = found.runs
    assert found.kept is judge
    exact = taylor_run(hard, TIMES, formulation="kane", precision="quadruple")
    assert true_errors(run, exact).max() > 1e-8
    assert true_errors(judge, exact).max() < found.worst < 1e-8


@pytest.mark.parametrize("speed", [1.5, 2.0, 2.5, 3.0])
def test_two_runs_do_not_share_the_round_off_of_the_start(speed):
    """Folded links leave that by it: the error was 1e10 times the reported one."""
    start = folded((1.0, 1.0), (1.0, 0.6), 1.0, speed, 8.0)
    times = np.linspace(0.0, 8.0, 11)
    exact = taylor_run(start, times, formulation="kane", precision="quadruple")
    for accuracy in (1e-4, 1e-7):
        found = measured(start, accuracy, times, correct=False)
        assert found.worst <= accuracy
        assert np.all(true_errors(found.kept, exact) <= found.errors)


def spun_up(stiffness, damping, speed, duration):
    """Return a folded arm, on a level, that a torque spins up until it opens."""
    chain = Chain.uniform_bars((1.0, 1.0), (1.0, 1.5))
    effects = (
        JointSpring((0.0, stiffness), (0.0, math.pi)),
        JointDamping((0.0, damping)),
        JointTorque((0.8, 0.0)),
    )
    return Scene(chain, (0.0, math.pi), (speed, speed), duration, effects)


@pytest.mark.parametrize(
    ("start", "accuracy", "formulation"),
    [
        (spun_up(20.0, 6.0, 1.0, 8.0), 1e-8, "lagrange"),
        (spun_up(20.0, 6.0, 1.0, 9.0), 1e-2, "lagrange"),
        (spun_up(20.0, 6.0, 1.0, 9.0), 1e-2, "momenta"),
        (spun_up(40.0, 10.0, 2.0, 9.0), 1e-6, "momenta"),
    ],
)
def test_round_off_grows_where_damping_has_taken_errors_of_the_start_away(
    start, accuracy, formulation
):
    """The error was up to 95 times the reported one: a start nearby is forgotten at first."""
    times = np.linspace(0.0, start.duration, 11)
    exact = taylor_run(start, times, formulation="kane", precision="quadruple")
    for correct in (True, False):
        found = measured(start, accuracy, times, formulation=formulation, correct=correct)
        assert found.worst <= accuracy
        assert np.all(true_errors(found.kept, exact) <= found.errors)


def test_strong_damping_does_not_leave_an_error_unknown():
    """The chain stays straight, as its numbers are exact, and is not stable in the end.

    A factor for all that damping takes away would leave an error of 3e10 in 113 bits: flows along
    a run tell the growth.
    """
    chain, rate = Chain.uniform_bars((3.0, 3.0), (1.0, 1.0)), -2.625
    torque = JointTorque(amplitude=(8 * rate, 2.5 * rate), frequency=(0.75, 0.75))
    effects = (JointSpring((0.0, -60.0)), JointDamping((0.0, 4.0)), torque)
    start = Scene(chain, (0.7, 0.7), (8.0, 8.0), 4.5, effects)
    times = np.linspace(0.0, 4.5, 11)
    found = measured(start, 1e-11, times)
    exact = taylor_run(start, times, formulation="kane", precision="quadruple")
    assert found.worst <= 1e-11
    assert np.all(true_errors(found.kept, exact) <= found.errors)


@dataclass(frozen=True)
class HeldUntil(Effect):
    """A control that holds the chain upright, and is switched off smoothly at a time (s)."""

    until: float
    width: float

    def loads(self, chain, q, u, t=0.0):
        part = (1 - tanh((t - chain.scalar(self.until)) / chain.scalar(self.width))) / 2
        first, second = q[0] - chain.scalar(UP), q[1] - q[0]
        return motor_loads(
            -part * (80 * first + 12 * u[0]), -part * (80 * second + 12 * (u[1] - u[0]))
        )


@pytest.mark.parametrize("accuracy", [1e-2, 1e-6, 1e-10])
def test_a_control_that_lets_go_leaves_the_round_off_of_its_balance(accuracy):
    """Two runs share it: the error was 3e5 times the reported one."""
    chain = Chain.uniform_bars((1.3, 0.7), (0.9, 1.1))
    start = Scene(chain, (UP, UP), (0.0, 0.0), 8.0, (Gravity(), HeldUntil(4.0, 0.01)))
    times = np.linspace(0.0, 8.0, 11)
    found = measured(start, accuracy, times)
    exact = taylor_run(start, times, formulation="kane", precision="quadruple", longest_step=0.01)
    assert found.worst <= accuracy
    assert np.all(true_errors(found.kept, exact) <= found.errors)


def test_the_error_is_unknown_where_round_off_has_grown_beyond_proportion():
    """The distance of a moved start ends at the size of the motion, and shows no growth then."""
    start = folded((9.6, 5.8), (1.9, 0.355), -0.32, 1.88, 7.9)
    times = np.linspace(0.0, 7.9, 11)
    exact = taylor_run(start, times, formulation="kane", precision="quadruple")
    found = measured(start, 0.5, times, correct=False)
    assert found.kept.precision != "double"
    assert np.all(true_errors(found.kept, exact) <= found.errors)
    runs = Runs(start, times, "momenta", quiet, 1.0)
    runs.pair("double", (11, 15))
    grown = runs.grown_from_start("double", 11)
    assert np.isfinite(grown[0])
    assert np.isinf(grown[-1])
    search = measure._Search(runs, 0.5, False, False)
    assert np.isinf(next(search._judged_by_order("double")).errors[-1])


def test_a_growth_that_lanes_have_shown_takes_no_run():
    made = Runs(HARD["reference"], TIMES, "momenta", quiet, 1.0)
    search = measure._Search(made, 1e-6, True, False)
    lanes = BundleSearch(made, search.pairs, 1e-6, search.prediction)
    assert lanes.lane_of(made.bundle(BundlePlan(13, 30.0))) is None
    count = len(made.made)
    next(search._judged_by_order("double"))
    assert len(made.made) == count + 2


def test_a_failed_bundle_leaves_the_motion_to_other_runs(monkeypatch):
    def fails(*given, **options):
        raise IntegrationError("lanes")

    monkeypatch.setattr(runs_module, "bundled", fails)
    found = measured(HARD["reference"], 1e-6)
    assert found.worst <= 1e-6
    assert found.runs


def test_a_run_well_above_round_off_is_judged_in_its_own_precision():
    """By lanes side by side, or, where steps are wanted that are those of one run, by two runs."""
    (bundle,) = measured(HARD["no forces"], 1e-6).runs
    assert isinstance(bundle, LaneRun)
    found = measured(HARD["no forces"], 1e-6, correct=False)
    assert [run.precision for run in found.runs] == ["double"] * 4
    assert found.runs[1].order == found.kept.order + MORE_ORDERS


def test_own_effects_are_judged_by_two_runs():
    """A bundle does not show whether its steps pass a change of their loads."""
    found = measured(WALL, 1e-5, np.linspace(0.0, 3.0, 21))
    assert found.worst <= 1e-5
    assert not any(isinstance(run, LaneRun) for run in found.runs)
    # A run that has passed the wall unseen would take 1.6 million steps deep inside it.
    assert max(run.steps for run in found.runs) < 2000


def test_near_round_off_a_run_is_judged_by_its_own_defect():
    """Double precision ends near 1e-9 here: it does for 1e-8, and no longer for 1e-12."""
    near, beyond = (measured(HARD["reference"], accuracy) for accuracy in (1e-8, 1e-12))
    assert near.kept.precision == "double"
    assert [run.precision for run in near.runs] == ["double"] * len(near.runs)
    assert beyond.kept.precision == "long double"
    assert [run.precision for run in beyond.runs].count("long double") == 1
    assert all(run.precision != "quadruple" for run in beyond.runs)


def test_round_off_ends_the_runs_of_a_precision():
    """A higher order does not help where round-off makes the error: a longer precision does.

    A bundle of a low order shows the growth of errors.
    """
    found = measured(HARD["chaotic"], 1e-12)
    first, *others = found.runs
    assert isinstance(first, LaneRun)
    assert [run.precision for run in others] == ["long double"]
    assert found.worst <= 1e-12


def test_no_runs_are_compared_that_may_share_too_much_round_off():
    """At 1e-11 they are for a calm motion only."""
    calm, chaotic = (measured(HARD[name], 1e-11) for name in ("calm", "chaotic"))
    assert isinstance(calm.kept, LaneRun)
    assert isinstance(chaotic.kept, CorrectedRun)
    pair = measured(HARD["calm"], 1e-11, correct=False)
    assert [run.order for run in pair.runs] == [11, 15, 11, 11, 19]


def test_a_pair_of_low_orders_shows_the_growth_where_truncation_errors_cancel():
    """Orders 15 and 19 alone are too alike: 2.8e-10 would be reported, and 4.7e-10 is true.

    Twelve roundings times the growth: the most of 229 random motions beside which they are so.
    """
    chain = Chain(
        (0.6542807515103323, 1.3854436678704778),
        (2.1477204684002658, 1.6285049504869331),
        ((0.2406289423837117, -0.42041826919406877), (1.1544547078950342, 0.3707302854833426)),
        (0.45122709286139867, 0.6721024903910539),
    )
    cancelling = scene(
        (-0.04979406350001492, -2.6426707049428675),
        (-1.7516168242157228, -2.497991534642364),
        chain,
    )
    times = np.linspace(0, 10, 61)
    exact = taylor_run(cancelling, times, formulation="kane", precision="long double")
    for accuracy in (1e-9, 3e-10):
        for correct in (True, False):
            found = measured(cancelling, accuracy, times, correct)
            assert correct or found.runs[0].order <= 11
            assert np.all(true_errors(found.kept, exact) <= found.errors)


@pytest.mark.slow
def test_a_correction_takes_the_place_of_a_longer_precision():
    """Without it, the run is in long doubles, whose steps take ten times as long."""
    found, raw = (measured(HARD["reference"], 3e-11, correct=each) for each in (True, False))
    assert isinstance(found.kept, CorrectedRun)
    assert (found.kept.precision, raw.kept.precision) == ("double", "long double")
    exact = taylor_run(HARD["reference"], TIMES, formulation="kane", precision="quadruple")
    for each in (found, raw):
        assert each.worst <= 3e-11
        assert np.all(true_errors(each.kept, exact) <= each.errors)


def test_an_accuracy_that_a_raw_run_has_needs_no_correction():
    for digits in (4, 6, 7, 9):
        kept = measured(HARD["reference"], 10.0**-digits).kept
        assert isinstance(kept, LaneRun if digits < 7 else LaneRun | TaylorRun)


def test_the_round_off_that_two_runs_share_is_in_the_error(monkeypatch):
    """Two runs that are equal by chance, or by symmetry, still have the round-off of their sums."""
    monkeypatch.setattr(Common, "until", lambda common, times: np.zeros(len(times)))
    found = measured(HARD["reference"], 1e-9, correct=False)
    assert 2e-16 < found.errors[0] < 1e-14
    assert 1e-13 < found.errors[-1] < 1e-10
    assert np.all(np.diff(found.errors) >= 0)


def test_the_growth_bounds_round_off_that_two_runs_share(monkeypatch):
    """The growth is that of a lower order: two runs that are equal say nothing."""
    made = Runs(HARD["reference"], TIMES, "momenta", quiet, 1.0)
    search = measure._Search(made, 1e-8, True, False)
    next(search._judged_by_order("double"))
    monkeypatch.setattr(Common, "until", lambda common, times: np.zeros(len(times)))
    equal = search._judged(search._pair("double", (15, 19)), 2.0)
    monkeypatch.undo()
    exact = taylor_run(HARD["reference"], TIMES, formulation="kane", precision="long double")
    assert np.all(true_errors(made.run("double", 19), exact) <= equal)


def test_the_first_pair_selects_the_order(monkeypatch):
    """A growth above the assumed one leads to a higher order at once, not step by step."""
    monkeypatch.setattr(prediction, "GROWTH", 1.0)
    found = measured(HARD["reference"], 1e-7, correct=False)
    assert len(found.runs) <= 5
    assert found.worst <= 1e-7
