from dataclasses import replace
from fractions import Fraction
from math import comb

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.ensembles.cases import UNCOUPLED, axis, ensemble, starts, torques
from tests.variations.cases import STIFFNESS, J
from twolink.ensembles import extreme_speeds
from twolink.ensembles.blocks import Block, Ends
from twolink.ensembles.chunk import goes_in_lanes, rows_of
from twolink.ensembles.extreme_speeds import ExtremeSpeeds, _reversed
from twolink.ensembles.single import single
from twolink.ensembles.speeds import Speeds
from twolink.limits import DEFAULT_LIMITS
from twolink.simulation import simulate
from twolink.simulation.hybrid.differences import impacts_beside
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.smooth.equations import EQUATIONS

KEEP = {"extreme_speeds": True}
NAMES = [
    f"{which}_speed{suffix}"
    for which in ("smallest", "largest")
    for suffix in ("", "_bound", "_time", "_time_bound")
]
RELATIVE = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 1.0]])


def refined(scene):
    """Return the extremes of u1, u2, u2 − u1 and their times, by DOP853 and roots of du/dt."""

    def rates(t, y):
        first, second = EQUATIONS["kane"].rates(
            scene.moving_chain, scene.effects, tuple(y[:2]), tuple(y[2:]), t
        )
        return np.array([*first, *second])

    run = solve_ivp(
        rates, (0, scene.duration), [*scene.q, *scene.u],
        method="DOP853", rtol=3e-14, atol=1e-15, dense_output=True,
    )  # fmt: skip
    t = np.linspace(0, scene.duration, 5001)
    speeds = RELATIVE @ run.sol(t)[2:]
    found = {}
    for which, sign in (("smallest", -1.0), ("largest", 1.0)):
        for k, weights in enumerate(RELATIVE):
            place = int(np.argmax(sign * speeds[k]))
            moment = t[place]
            low, high = t[max(place - 1, 0)], t[min(place + 1, len(t) - 1)]

            def rate(x, weights=weights):
                return weights @ rates(x, run.sol(x))[2:]

            if rate(low) * rate(high) < 0:
                moment = brentq(rate, low, high, xtol=1e-15)
            found[which, k] = weights @ run.sol(moment)[2:], moment
    return found


# Of DOP853 and its dense output, which is of order 7.
OF_REFERENCE, OF_ITS_TIMES = 1e-10, 1e-8


def check(arrays, run, scene):
    for (which, k), (value, moment) in refined(scene).items():
        name = f"{which}_speed"
        bound, of_time = arrays[f"{name}_bound"][run, k], arrays[f"{name}_time_bound"][run, k]
        assert abs(arrays[name][run, k] - value) <= bound + OF_REFERENCE
        assert abs(arrays[f"{name}_time"][run, k] - moment) <= of_time + OF_ITS_TIMES
        assert bound < 100 * max(arrays["error"][run], 1e-13)
        assert of_time < 1e-2 * scene.duration


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [1e-5, 1e-9])
def test_extremes_of_falls_in_lanes_are_those_of_dop853(accuracy):
    asked = starts(3, keep=KEEP, runs={"accuracy": accuracy, "duration": 3.0})
    assert goes_in_lanes(asked)
    rows = rows_of(asked, 0, 9).arrays
    for run in (0, 3, 5, 7):
        check(rows, run, asked.family.scene(asked.values(run, run + 1)[0]))


@pytest.mark.slow_but_first
@pytest.mark.parametrize("accuracy", [1e-6, 1e-12])
def test_extremes_of_a_run_by_itself_are_those_of_dop853(accuracy):
    """The direction of gravity is no parameter, so that these runs are not in lanes."""
    asked = ensemble(
        axes=[axis("effects.gravity.direction.0", 0.1, 0.3)],
        runs={"accuracy": accuracy, "duration": 2.0},
        keep=KEEP,
    )
    assert not goes_in_lanes(asked)
    rows = rows_of(asked, 0, 2).arrays
    for run in (0, 1):
        check(rows, run, asked.family.scene(asked.values(run, run + 1)[0]))


def test_an_extreme_at_the_start_or_the_end_is_at_its_time():
    # u2 = 2 − 2 torque t, from 2 rad/s; link 1 turns by the reaction.
    rows = rows_of(torques(0.35, 0.6, keep=KEEP, u2=-2.0), 0, 2).arrays
    end = -2.0 + 2 * np.array([0.35, 0.6]) * 4.0
    assert np.abs(rows["largest_speed"][:, 1] - end).max() < 1e-12
    assert np.abs(rows["smallest_speed"][:, 1] + 2.0).max() < 1e-12
    assert (rows["largest_speed_time"][:, 1] == 4.0).all()
    assert (rows["smallest_speed_time"][:, 1] == 0.0).all()
    assert (rows["largest_speed_time_bound"][:, 1] < 1e-9).all()


def swing(duration):
    """Return the ensemble of a spring's oscillation, started at rest, of so many seconds."""
    scene = {
        **UNCOUPLED,
        "start": {"q": [0.5, 0.0]},
        "run": {"duration": duration},
        "effects": {"joint_spring": {"stiffness": [STIFFNESS, 0.0]}},
    }
    return ensemble(scene=scene, axes=[axis("q1", 0.5, 0.6)], keep=KEEP)


def test_a_peak_that_comes_again_is_at_an_unknown_one_of_their_times():
    period = 2 * np.pi * np.sqrt(J / STIFFNESS)
    rows = rows_of(swing(3.1 * period), 0, 2).arrays
    amplitude = np.array([0.5, 0.6]) * np.sqrt(STIFFNESS / J)
    off = np.abs(rows["largest_speed"][:, 0] - amplitude)
    assert (off <= rows["largest_speed_bound"][:, 0]).all()
    time, bound = rows["largest_speed_time"][:, 0], rows["largest_speed_time_bound"][:, 0]
    peaks = (np.arange(3) + 0.75) * period
    assert (np.abs(time[:, None] - peaks) < 1e-4).any(axis=1).all()
    # All three may be the largest one, and none is elsewhere.
    assert (time - bound < peaks[0]).all()
    assert (time + bound > peaks[2]).all()
    assert (bound <= 2 * period + 1e-3).all()


def test_more_places_than_are_kept_apart_give_the_same_value_and_no_smaller_bound(monkeypatch):
    period = 2 * np.pi * np.sqrt(J / STIFFNESS)
    asked = swing(6.1 * period)
    own = rows_of(asked, 0, 2).arrays
    monkeypatch.setattr(extreme_speeds, "_MOST_PLACES", 1)
    merged = rows_of(asked, 0, 2).arrays
    for name in NAMES:
        if name.endswith("time_bound"):
            assert (merged[name] >= own[name]).all()
            assert (merged[name] <= asked.duration * (1 + 1e-14)).all()
        else:
            assert np.array_equal(merged[name], own[name])
    # The number of places of a lane decides alone, not that of its neighbours.
    alone = rows_of(asked, 1, 2).arrays
    assert all(np.array_equal(alone[name], merged[name][1:]) for name in NAMES)


@pytest.mark.slow
def test_values_before_and_after_impacts_count():
    asked = ensemble(scene="drop", axes=[axis("effects.surface.friction", 0.1, 0.4)], keep=KEEP)
    rows = rows_of(asked, 0, 2).arrays
    for run, value in enumerate((0.1, 0.4)):
        scene = asked.family.scene([value])
        times = np.linspace(0.0, scene.duration, 20_001)
        truth = hybrid_run(scene, times, formulation="kane", precision="quadruple")
        sides = [pair for impact in truth.impacts for pair in impact.u]
        known = RELATIVE @ np.concatenate([truth.u.astype(float), np.array(sides).T], axis=1)
        for which, sign in (("smallest", -1.0), ("largest", 1.0)):
            found, bound = (rows[f"{which}_speed{x}"][run] for x in ("", "_bound"))
            best = (sign * known).max(axis=1)
            # No speed is beyond; one is near: at an impact, or within 50 µs of the peak.
            assert (best <= sign * found + bound).all()
            assert (sign * found - bound <= best + 1e-6).all()
            at_impact = (sign * known[:, -len(sides) :]).max(axis=1) == best
            assert at_impact.any()
            assert (np.abs(sign * found - best)[at_impact] <= bound[at_impact]).all()
            moments = np.repeat([impact.time for impact in truth.impacts], 2)
            k = int(np.flatnonzero(at_impact)[0])
            moment = moments[int(np.argmax(sign * known[k, -len(sides) :]))]
            time, of_time = (rows[f"{which}_speed{x}"][run, k] for x in ("_time", "_time_bound"))
            assert abs(time - moment) <= of_time
            assert of_time < 1e-6


def test_states_between_impacts_at_one_time_count():
    """Of three impacts, the speeds between them are the extremes: rational numbers."""
    rows = rows_of(ensemble(scene="elbow_and_tip", keep=KEEP), 0, 1).arrays
    assert rows["largest_speed"][0] == pytest.approx([3.6, 2.64, 4.8], abs=1e-13)
    assert rows["smallest_speed"][0] == pytest.approx([-2.16, -6.0, -9.6], abs=1e-13)
    struck = np.pi / 2 - 0.5
    for which in ("smallest", "largest"):
        assert rows[f"{which}_speed_time"][0] == pytest.approx([struck / 2] * 3, abs=1e-13)
        assert (rows[f"{which}_speed_bound"][0] < 1e-11).all()
        assert (rows[f"{which}_speed_time_bound"][0] < 1e-13).all()


def test_the_errors_of_impacts_are_those_of_their_speeds(monkeypatch):
    def worse(*runs):
        times, speeds, bounds = impacts_beside(*runs)
        return times, speeds, bounds + 1e-3

    monkeypatch.setattr("twolink.ensembles.single.impacts_beside", worse)
    rows = rows_of(ensemble(scene="drop", keep=KEEP), 0, 1).arrays
    # At the first impact, and long after the last one.
    assert rows["largest_speed_bound"][0, 0] == pytest.approx(1e-3, rel=1e-3)
    assert rows["largest_speed_time"][0, 2] > 1.0
    assert rows["largest_speed_bound"][0, 2] < 1e-8


@pytest.mark.slow
def test_through_corners_of_a_sampled_torque():
    asked = ensemble(scene="sampled_torque", axes=[axis("q1", 1.2, 1.5)], keep=KEEP)
    rows = rows_of(asked, 0, 2).arrays
    for run, value in enumerate((1.2, 1.5)):
        truth = simulate(asked.family.scene([value]), samples=100_001, accuracy=1e-11)
        speeds = RELATIVE @ truth.u
        assert (speeds.max(axis=1) <= rows["largest_speed"][run] + 1e-11).all()
        assert (rows["largest_speed"][run] <= speeds.max(axis=1) + 1e-7).all()
        assert (speeds.min(axis=1) >= rows["smallest_speed"][run] - 1e-11).all()
        assert (rows["smallest_speed"][run] >= speeds.min(axis=1) - 1e-7).all()


def test_a_run_by_itself_agrees_with_the_one_in_lanes():
    asked = starts(2, keep=KEEP, runs={"accuracy": 1e-8, "duration": 3.0})
    rows = rows_of(asked, 0, 4).arrays
    for run in range(4):
        scene = asked.family.scene(asked.values(run, run + 1)[0])
        alone = single(scene, asked.kept, 1e-8, False, DEFAULT_LIMITS).values
        for which in ("smallest", "largest"):
            for of, slack in ((f"{which}_speed", 0.0), (f"{which}_speed_time", 0.0)):
                allowed = rows[f"{of}_bound"][run] + alone[f"{of}_bound"] + slack
                assert (np.abs(rows[of][run] - alone[of]) <= allowed).all()


def accumulated(*steps, errors=(), shifts=(), duration=10.0, function=0):
    """Return the values of one lane of polynomials of u1, given as (start, length, u1).

    They are those of u1, or of another function: u2, which is zero, or u2 − u1.
    """
    count, terms = len(steps), max(len(rows) for *_, rows in steps)
    coefficients, clocks = np.zeros((count, 2, terms, 1)), np.zeros((count, terms, 1))
    for k, (_, length, rows) in enumerate(steps):
        coefficients[k, 0, : len(rows), 0], clocks[k, 1, 0] = rows, length
    given = [np.array(x or [0.0] * count)[:, None] for x in (errors, shifts)]
    starts = np.array([[float(start)] for start, *_ in steps])
    counts = np.ones((count, 1), bool)
    cuts = np.zeros((count, 2, 1))
    speeds = Speeds(starts, clocks, coefficients, cuts, *given, counts)
    scene = replace(swing(1.0).family.scene([0.5]), duration=duration)
    lanes = extreme_speeds.Lanes(
        scene.chain, scene.effects, np.zeros((2, 1)), np.zeros((2, 1)), duration
    )
    accumulator = ExtremeSpeeds().accumulator(lanes)
    nothing = np.zeros((0, 1))
    accumulator.add(Block(nothing, nothing, np.zeros((0, 2, 1, 1)), nothing, speeds=lambda: speeds))
    values = accumulator.values(Ends(np.zeros((2, 1)), np.zeros((2, 1)), np.zeros(1)))
    return {name: values[name][0, function] for name in NAMES}


LINE = [0.0, 1.0, 0.0]


def test_a_state_between_two_impacts_at_one_time_counts():
    found = accumulated((0.0, 2.0, LINE), (2.0, 0.0, [7.0, 0, 0]), (2.0, 1.0, [0.5, -1.0, 0.0]))
    assert found["largest_speed"] == 7.0
    assert found["largest_speed_time"] == 2.0
    assert found["largest_speed_time_bound"] < 1e-14
    assert found["smallest_speed"] == -0.5
    assert found["smallest_speed_time"] == 3.0


@pytest.mark.parametrize(
    "steps",
    [
        [(0.0, 2.0, LINE), (2.0, 2.0, [-1.0, 0.0, 0.0])],
        [(0.0, 2.0, [-1.0, 0.0, 0.0]), (2.0, 2.0, [1.0, -1.0, 0.0])],
    ],
)
def test_a_jump_that_may_be_early_or_late_widens_the_bound_of_the_time(steps):
    found = accumulated(*steps, errors=[1e-6] * 2, shifts=[1e-4] * 2)
    # A line that is within 2e-6 of its end for 2e-6 of its length.
    assert found["largest_speed_time_bound"] == pytest.approx(1e-4 + 2 * 2e-6, rel=1e-3)
    assert found["largest_speed_bound"] == pytest.approx(1e-6, rel=1e-3)


def test_the_error_of_the_speed_of_the_elbow_is_that_of_both_links():
    found = accumulated((0.0, 2.0, LINE), errors=[1e-6], function=2)
    assert found["smallest_speed"] == -1.0
    assert found["smallest_speed_bound"] == pytest.approx(2e-6, rel=1e-3)


def test_errors_that_grow_let_a_lower_peak_be_the_largest_one():
    steps = (0.0, 2.0, [0.0, 4.0, -4.0]), (2.0, 2.0, [0.0, 3.6, -3.6])
    apart = accumulated(*steps, errors=[1e-3, 1e-2])
    assert apart["largest_speed"] == 1.0
    assert apart["largest_speed_bound"] == pytest.approx(1e-3, rel=1e-3)
    assert apart["largest_speed_time"] == pytest.approx(1.0, abs=1e-5)
    assert apart["largest_speed_time_bound"] < 0.1
    together = accumulated(*steps, errors=[1e-3, 0.2])
    # At most 0.9 + 0.2, at 3 s or later.
    assert together["largest_speed_bound"] == pytest.approx(0.1, rel=1e-3)
    assert 2.0 < together["largest_speed_time_bound"] < 3.0


def test_an_unknown_error_leaves_extremes_unknown():
    steps = (0.0, 2.0, [0.0, 4.0, -4.0]), (2.0, 2.0, [0.0, 1.0, 0.0])
    found = accumulated(*steps, errors=[1e-3, np.inf])
    assert found["largest_speed"] == pytest.approx(1.0)
    assert found["largest_speed_bound"] == np.inf
    assert found["largest_speed_time_bound"] >= 3.0 - 1e-5


def test_reversed_polynomials_are_exact_within_their_slack(random):
    rows = random.normal(size=(22, 5)) / 3.0 ** np.arange(22)[:, None]
    found, slack = _reversed(rows)
    for column in range(5):
        exact = [
            (-1) ** k * sum(comb(j, k) * Fraction(rows[j, column]) for j in range(k, 22))
            for k in range(22)
        ]
        off = sum(abs(Fraction(x) - y) for x, y in zip(found[:, column], exact, strict=True))
        assert off <= slack[column]
    assert slack.max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("duration", [20.0, 25.0])
def test_times_of_extremes_are_unknown_where_the_error_is(duration):
    """A fall from 4 rad is chaotic, and has more peaks than are kept one by one."""
    runs = {"duration": duration, "accuracy": 1e-6}
    fall = ensemble(axes=[axis("q1", 4.0)], runs=runs, keep=KEEP)
    arrays = rows_of(fall, 0, 1).arrays
    assert np.isinf(arrays["error"]).all()
    for which in ("smallest", "largest"):
        assert np.isinf(arrays[f"{which}_speed_bound"]).all()
        assert (arrays[f"{which}_speed_time_bound"] > 1.0).all()
