"""First times of uncoupled links, whose motions are known in closed form."""

import math

import mpmath
import numpy as np
import pytest
from scipy.optimize import brentq

from tests.ensembles.cases import UNCOUPLED, axis, ensemble, starts, torques
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.first_time import HAPPENS, NEVER, UNDECIDED, FirstTime, first_descent
from twolink.errors import ParameterError

NAMES = ("q1", "q2", "either")
LEVEL = {"name": "x", "of": "q2", "level": 1.0}


def rows(asked):
    return rows_of(asked, 0, asked.runs.count).arrays


def test_a_crossing_is_at_its_time_within_the_bound():
    # q2 = t + α t²/2 with α = 2 torque.
    alphas = np.array([0.5, 1.0, 3.0])
    found = rows(torques(*(alphas / 2), keep={"first": [LEVEL]}, u2=1.0))
    truth = (np.sqrt(1 + 2 * alphas) - 1) / alphas
    assert (found["x_verdict"] == HAPPENS).all()
    assert (np.abs(found["x_time"] - truth) <= found["x_bound"]).all()
    assert (found["x_bound"] < 1e-9).all()


@pytest.mark.parametrize(
    ("above", "verdict"),
    [(1e-3, HAPPENS), (1e-5, HAPPENS), (0.0, UNDECIDED), (-1e-5, NEVER), (-1e-3, NEVER)],
)
def test_a_top_near_the_level_is_crossed_missed_or_undecided(above, verdict):
    # q2 = 2 t − t²/2 (α = −1), whose top is 2 at 2 s.
    level = {"name": "x", "of": "q2", "level": 2.0 - above}
    found = rows(torques(-0.5, keep={"first": [level]}, u2=2.0))
    assert found["x_verdict"][0] == verdict
    if verdict == HAPPENS:
        truth = 2 - math.sqrt(2 * above)
        assert abs(found["x_time"][0] - truth) <= found["x_bound"][0]


def test_a_level_at_the_start_is_undecided_or_crossed_at_once():
    level = {"name": "x", "of": "q2", "level": 0.0}
    found = rows(torques(0.0, keep={"first": [level]}, u2=1.0))
    # The start is on the level, so that its side is unknown.
    assert found["x_verdict"][0] in (UNDECIDED, HAPPENS)
    if found["x_verdict"][0] == HAPPENS:
        assert found["x_time"][0] <= found["x_bound"][0]


@pytest.mark.parametrize(
    ("q", "u", "condition"),
    [
        # q2 - q1 is below the level by 1.1e-16 rad, and falls.
        ((0.001, 1.7), (0.0, -1.0), {"of": "elbow", "level": 1.7 - 0.001}),
        ((1e-17, 1.0), (0.0, -0.5), {"of": "elbow", "level": 1.0}),
        # The floats are below 3.5 π and 1.5 π, and q1 falls.
        ((10.995574287564276, 0.518763931453941), (-0.3, 0.0), {"of": "q1"}),
        ((4.71238898038469, 0.36075401274724817), (-2.0, 1.0), {"of": "q1"}),
    ],
)
def test_a_start_at_an_end_but_for_rounding_is_undecided(q, u, condition):
    scene = {
        "chain": {"mass": [1.0, 1.0], "length": [1.0, 1.0]},
        "start": {"q": list(q), "u": list(u)},
        "run": {"duration": 0.05},
        "effects": {"gravity": {"g": 9.81}},
    }
    found = rows(ensemble(scene=scene, axes=[], keep={"first": [{"name": "x", **condition}]}))
    assert found["x_verdict"].tolist() == [UNDECIDED]


def test_levels_are_crossed_from_both_sides():
    falling = {"name": "x", "of": "q2", "level": -1.0}
    found = rows(torques(-0.5, keep={"first": [falling, {**LEVEL, "name": "y"}]}))
    assert abs(found["x_time"][0] - math.sqrt(2)) <= found["x_bound"][0]
    assert found["y_verdict"][0] == NEVER
    assert np.isnan(found["y_time"][0])
    elbow = {"name": "x", "of": "elbow", "level": 1.0}
    found = rows(torques(0.5, keep={"first": [elbow]}))
    # The reaction −½ N m turns link 1, of 4/3 kg m²: q2 − q1 = (1 + 3/8) t²/2.
    assert abs(found["x_time"][0] - math.sqrt(2 / 1.375)) <= found["x_bound"][0]


def pendulum(*speeds, keep, duration=4.0):
    """Return an ensemble of pendulums: link 1 from the horizontal, q1 down at π/2."""
    scene = {**UNCOUPLED, "run": {"duration": duration}, "effects": {"gravity": {}}}
    return ensemble(scene=scene, axes=[axis("start.u.0", *speeds)], keep=keep)


def time_to_the_top(speed, down=math.pi / 2):
    """Return the time (s) in which q1 falls from the horizontal through `down` to the top."""
    # (4/3) q1″ = −(½ + 1) g sin(q1 − down).
    rate = mpmath.mpf(1.5) * mpmath.mpf(9.81) / (mpmath.mpf(4) / 3)
    squared = lambda x: speed**2 + 2 * rate * mpmath.cos(x)  # noqa: E731
    return float(mpmath.quad(lambda x: 1 / mpmath.sqrt(squared(x)), [-math.pi / 2, 0, math.pi]))


def test_flips_of_a_pendulum():
    # At the top its speed would be the root of ω² − 2 · 11.04.
    limit = math.sqrt(2 * 1.5 * 9.81 / (4 / 3))
    speeds = limit + np.array([-1.0, -1e-3, 1e-3, 1.0, 5.0])
    found = rows(pendulum(*speeds, keep={"first": [{"name": "flip", "of": "q1"}]}))
    assert found["flip_verdict"].tolist() == [NEVER, NEVER, HAPPENS, HAPPENS, HAPPENS]
    for speed, time, bound in zip(
        speeds[2:], found["flip_time"][2:], found["flip_bound"][2:], strict=True
    ):
        assert abs(time - time_to_the_top(speed)) <= bound
        assert bound < 1e-4


def test_the_first_flip_is_the_earlier_one_of_both_links():
    keep = {"first": [{"name": name, "of": name} for name in NAMES]}
    scene = {
        "chain": {"mass": [1.0, 1.0], "length": [1.0, 1.0]},
        "start": {"q": [-1.5, 0.0], "u": [0.0, 0.0]},
        "run": {"duration": 8.0},
        "effects": {"gravity": {}},
    }
    grid = {"first": -1.5, "last": 4.6, "count": 24}
    found = rows(ensemble(scene=scene, axes=[axis("start.q.1", grid=grid)], keep=keep))
    decided = (found["q1_verdict"] > 0) & (found["q2_verdict"] > 0)
    assert decided.sum() > 12
    times = [np.where(found[f"{n}_verdict"] == HAPPENS, found[f"{n}_time"], 99) for n in NAMES]
    first = np.minimum(times[0], times[1])
    assert len(set(times[0] < times[1])) == 2
    assert np.abs(first - times[2])[decided].max() < 1e-6


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("gravity", "of", "verdict"),
    [({"direction": [0.0, -1.0]}, "q2", HAPPENS), ({"g": -9.81}, "q2", HAPPENS), ({}, "q2", NEVER)],
)
def test_upright_is_against_gravity_whatever_its_direction(gravity, of, verdict):
    # Link 2 is heavy and starts a little from where gravity of the usual direction hangs it.
    scene = {
        "chain": {"mass": [1.0, 1.0], "length": [1.0, 1.0]},
        "start": {"q": [1.57, 1.4], "u": [0.0, 2.5]},
        "run": {"duration": 1.0},
        "effects": {"gravity": gravity},
    }
    found = rows(ensemble(scene=scene, keep={"first": [{"of": of}]}))
    assert found["flip_verdict"][0] == verdict


@pytest.mark.slow
def test_flips_without_gravity_are_undecided():
    found = rows(
        ensemble(axes=[axis("effects.gravity.g", 0.0, 9.81)], keep={"first": [{"of": "q1"}]})
    )
    assert found["flip_verdict"][0] == UNDECIDED
    assert found["flip_verdict"][1] != UNDECIDED


def test_a_time_with_a_large_bound_is_undecided():
    keep = {"first": [{**LEVEL, "within": 1e-18}]}
    assert rows(torques(0.5, keep=keep))["x_verdict"][0] == UNDECIDED


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        (
            {"name": "a b"},
            "name must be letters, digits and underscores, with no digit first; got 'a b'",
        ),
        (
            {"name": "1a"},
            "name must be letters, digits and underscores, with no digit first; got '1a'",
        ),
        ({"of": "q3"}, "of must be one of q1, q2, elbow, either; got 'q3'"),
        ({"level": math.nan}, "level must be a finite real number; got nan"),
        ({"within": 0.0}, "within must be a positive number; got 0.0"),
        ({"of": "elbow"}, "level must be given for the elbow"),
        ({"of": "either", "level": 1.0}, "of must be one angle where a level is given"),
    ],
)
def test_conditions_that_make_no_sense_are_refused(fields, sentence):
    with pytest.raises(ParameterError, match=f"keep.first: {sentence}"):
        FirstTime(**fields)


def flips_of_a_grid(count, duration):
    """Return the flips of either link from a grid of poses that is its own mirror image."""
    hanging = math.pi / 2
    grid = {"first": hanging - 3.0, "last": hanging + 3.0, "count": count}
    axes = [axis(f"start.q.{k}", grid=grid) for k in (0, 1)]
    keep = {"energy": True, "first": [{"name": "flip", "of": "either"}]}
    return rows(ensemble(axes=axes, keep=keep, runs={"accuracy": 1e-7, "duration": duration}))


def test_a_flip_that_energy_forbids_never_happens():
    found = flips_of_a_grid(9, 6.0)
    # T + V is least where link 2 is upright and link 1 hangs: V = g (−1/2 − 1 + 1/2).
    forbidden = found["energy_start"] < -9.81
    assert 10 < forbidden.sum() < 70
    assert (found["flip_verdict"][forbidden] == NEVER).all()
    assert (found["flip_verdict"][~forbidden] == HAPPENS).sum() > 20


def test_the_mirror_image_of_a_run_flips_at_the_same_time():
    found = flips_of_a_grid(8, 3.0)
    one, other = found["flip_time"], found["flip_time"][::-1]
    assert (found["flip_verdict"] == found["flip_verdict"][::-1]).all()
    happens = found["flip_verdict"] == HAPPENS
    bounds = found["flip_bound"] + found["flip_bound"][::-1]
    # The starts are mirror images within a rounding of each angle, which grows like an error.
    assert (np.abs(one - other) <= bounds + 1e-9)[happens].all()


def test_descents_are_at_the_first_roots_of_known_polynomials():
    # (x − 0.3) (x − 0.6) (x − 0.9) falls twice; −x does so at its start, and x nowhere.
    twice = -np.poly([0.3, 0.6, 0.9])[::-1]
    rows = np.array([twice, -twice, [0, -1, 0, 0], [0, 1, 0, 0], [1, -0.5, 0, 0]]).T
    found = first_descent(rows, np.array([0.0, 0.0, 0.0, -1e-3, 0.0]))
    assert found[:4] == pytest.approx([0.3, 0.0, 0.0, np.inf], abs=1e-13)
    assert found[4] == np.inf


@pytest.mark.parametrize("above", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_descent_that_ends_above_the_level_is_none(above):
    rows = np.array([[0.25, -1.0, 1.0]]).T
    assert first_descent(rows, np.array([-above])) == [np.inf]
    assert first_descent(rows, np.array([above])) == pytest.approx(
        0.5 - math.sqrt(above), abs=1e-14 / math.sqrt(above)
    )


def test_no_sample_before_a_descent_is_below_the_level(random):
    rows = random.normal(size=(14, 400)) * 0.7 ** np.arange(14.0)[:, None]
    levels = random.normal(size=400) - 1
    found = first_descent(rows, levels)
    x = np.linspace(0, 1, 2001)
    for column, level, place in zip(rows.T, levels, found, strict=True):
        values = np.polynomial.polynomial.polyval(x, column)
        assert (values[x < place] > level - 1e-14).all()
        if 0 < place < np.inf:
            reached = np.polynomial.polynomial.polyval(place, column)
            assert reached == pytest.approx(level, abs=1e-12)
    assert 100 < np.isinf(found).sum() < 350


def test_bits_of_a_descent_do_not_depend_on_its_neighbours(random):
    rows, levels = random.normal(size=(14, 100)), random.normal(size=100) - 1
    alone = [first_descent(rows[:, k : k + 1], levels[k : k + 1])[0] for k in range(100)]
    assert np.array_equal(first_descent(rows, levels), alone)


@pytest.mark.parametrize("duration", [4.1, 40.0])
@pytest.mark.parametrize(("above", "verdict"), [(1e-3, HAPPENS), (1e-5, HAPPENS), (-1e-5, NEVER)])
def test_a_crossing_and_return_between_two_places_is_found(duration, above, verdict):
    # The top of q2 = 2 t - t²/2, at 2 s, is far from the 32 places, where q2 is below the level.
    level = {"name": "x", "of": "q2", "level": 2.0 - above}
    found = rows(torques(-0.5, keep={"first": [level]}, u2=2.0, duration=duration))
    assert found["x_verdict"][0] == verdict
    if verdict == HAPPENS:
        assert abs(found["x_time"][0] - (2 - math.sqrt(2 * above))) <= found["x_bound"][0]


def test_a_crossing_in_many_short_steps_comes_before_those_of_later_intervals():
    # q2 = v t + a (1 - cos ω t), ω = 200: some 250 steps between two places, 40 turns each way.
    # Each top is above the last one by little, so that the angle crosses a level, and returns, once
    # in every turn, from the end of an interval between places to the next one and beyond.
    v, a, omega = 0.02, 1.0, 200.0
    shift = math.asin(v / (a * omega)) / omega

    def above(time, level=0.0):
        return v * time + a * (1 - math.cos(omega * time)) - level

    truth, levels = [], []
    for turn in range(2, 80, 3):
        top = (2 * turn + 1) * math.pi / omega + shift
        # Between the last top and this one.
        level = above(top) - 0.3 * v * math.tau / omega
        levels.append(level)
        truth.append(brentq(above, top - math.pi / omega, top, args=(level,), xtol=1e-15))
    effect = {"torque": [0.0, 0.0], "amplitude": [0.0, a * omega**2 / 2]}
    effect |= {"frequency": [0.0, omega], "phase": [0.0, math.pi / 2]}
    scene = {
        **UNCOUPLED,
        "start": {"q": [0.0, 0.0], "u": [0.0, v]},
        "run": {"duration": 40.0},
        "effects": {"joint_torque": effect},
    }
    first = [{"name": f"x{k}", "of": "q2", "level": level} for k, level in enumerate(levels)]
    found = rows(ensemble(scene=scene, keep={"first": first}))
    for k, time in enumerate(truth):
        assert found[f"x{k}_verdict"][0] == HAPPENS
        assert abs(found[f"x{k}_time"][0] - time) <= found[f"x{k}_bound"][0]


@pytest.mark.parametrize("others", [{"final": True}, {"extremes": True}])
def test_verdicts_are_those_of_runs_that_do_not_end_early(others):
    first = [{"name": "flip", "of": "either"}, {"name": "x", "of": "elbow", "level": 1.0}]
    runs = {"accuracy": 1e-7, "duration": 8.0}
    one, other = (
        rows(starts(9, keep={"first": first, **more}, runs=runs)) for more in ({}, others)
    )
    for name in ("flip", "x"):
        verdicts = one[f"{name}_verdict"]
        assert np.array_equal(verdicts, other[f"{name}_verdict"])
        assert len(set(verdicts)) == 2
        times, bounds = ([each[f"{name}_{k}"] for each in (one, other)] for k in ("time", "bound"))
        apart = np.abs(times[0] - times[1])
        assert (apart <= bounds[0] + bounds[1])[verdicts == HAPPENS].all()


def test_bits_of_first_times_do_not_depend_on_chunks():
    asked = starts(7, keep={"first": [{"of": "either"}]}, runs={"accuracy": 1e-8, "duration": 6.0})
    whole = rows(asked)
    for first in range(0, 49, 5):
        last = min(first + 5, 49)
        for name, part in rows_of(asked, first, last).arrays.items():
            assert np.array_equal(part, whole[name][first:last], equal_nan=part.dtype.kind == "f")


@pytest.mark.slow
def test_a_run_of_unknown_error_is_never_without_a_flip():
    # Chaotic motions over a minute, from near the upright poses.
    around = {"first": -1.6, "last": -1.5, "count": 6}
    axes = [axis("start.q.0", grid=around), axis("start.q.1", -1.4)]
    level = {"name": "x", "of": "q1", "level": 300.0}
    runs = {"duration": 60.0, "accuracy": 1e-3}
    found = rows(ensemble(axes=axes, keep={"first": [level]}, runs=runs))
    assert np.isinf(found["error"]).any()
    assert (found["x_verdict"][np.isinf(found["error"])] == UNDECIDED).all()
