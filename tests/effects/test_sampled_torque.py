"""Sampled torques: the chosen interpolation between samples, and no step over a kink."""

import math
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import heyoka
import mpmath
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tests.verification.chains import GENERAL
from twolink.accuracy.reference import reference
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.errors import ParameterError
from twolink.integration.methods import METHODS
from twolink.loads import Torque
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.smooth.numeric import numeric_run

BALANCED = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (2.0, 0.5))
"""Both mass centres on the joints: each link turns on its own, and M = diag(3, 0.5)."""

TIMES = (0.5, 1.0, 1.3, 2.0, 2.2)
A = (0.3, -1.0, 2.0, 0.7, 0.1)
B = (-0.2, 0.4, 0.0, 1.1, -0.6)


def scene(*effects, chain=BALANCED, **options):
    values = {"q": (0.0, 0.0), "u": (0.0, 0.0), "duration": 3.0, "accuracy": 1e-11}
    return Scene(chain=chain, effects=effects, **{**values, **options})


def torque_at_A(effect, t):
    loads = effect.loads(BALANCED, (0.0, 0.0), (0.0, 0.0), t)
    return sum(load.moment for load in loads if isinstance(load, Torque))


@pytest.mark.parametrize(
    ("times", "samples", "interpolation", "words"),
    [
        ((0.0, 1e-300, 0.5, 1.0), (0.0, 1e100, 0.0, 0.0), "linear", "others after 0.0 s"),
        ((0.0, 1e-300, 0.5, 1.0), (0.0, 1e100, 0.0, 0.0), "cubic", "others after 0.0 s"),
        ((0.0, 0.25, 0.5, 1.0), (-1.7e308, 1.7e308, 0.0, 0.0), "cubic", "others after 0.0 s"),
        ((0.0, 1e-200, 2e-200, 1.0), (0.0, 1.0, 0.0, 1.0), "cubic", "others after 0.0 s"),
        ((-1.6e308, 0.0, 0.5, 1.6e308), (0.0, 1.0, 0.0, 0.0), "cubic", "must be less uneven"),
    ],
)
def test_slopes_that_float64_does_not_hold_are_refused(times, samples, interpolation, words):
    """SciPy raised errors of its own."""
    with pytest.raises(ParameterError, match=words):
        SampledTorque(times, samples, (0.0,) * 4, interpolation)


def test_splines_through_uneven_times_have_all_digits_in_float64():
    """SciPy's were wrong by 3e-4."""
    effect = SampledTorque((0.0, 1e-12, 2e-12, 1.0), (0.3, 0.1, -0.2, 1.0), (0.0,) * 4, "cubic")
    for t in (0.4e-12, 1.5e-12, 0.3, 0.9):
        exact = torque_at_A(effect.piece_at(t), Fraction(t))
        assert torque_at_A(effect, np.array([t]))[0] == pytest.approx(float(exact), rel=1e-12)


@pytest.mark.parametrize("interpolation", ["hold", "linear", "cubic"])
def test_the_interpolation_is_the_chosen_one(interpolation):
    effect = SampledTorque(TIMES, A, B, interpolation)
    t = np.linspace(0, 3, 301)
    inside = np.clip(t, TIMES[0], TIMES[-1])
    expected = {
        "hold": np.array(A)[np.clip(np.searchsorted(TIMES, t, side="right") - 1, 0, None)],
        "linear": np.interp(t, TIMES, A),
        "cubic": CubicSpline(TIMES, A)(inside),
    }[interpolation]
    assert torque_at_A(effect, t) == pytest.approx(expected, abs=1e-14)
    for moment, value in zip(t[::37], expected[::37], strict=True):
        assert torque_at_A(effect, float(moment)) == pytest.approx(value, abs=1e-14)
        assert torque_at_A(effect.piece_at(float(moment)), float(moment)) == pytest.approx(
            value, abs=1e-14
        )


@pytest.mark.parametrize("interpolation", ["hold", "linear", "cubic"])
def test_slopes_of_a_piece_are_the_torques_of_the_slopes_of_samples(interpolation):
    effect = SampledTorque(TIMES, A, B, interpolation)
    along = (0.0,) * 5, (0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, -2.0, 0.0)
    for t in (0.0, 0.7, 1.0, 1.5, 2.5):
        piece, slopes = effect.piece_at(t), effect.slopes_of(sum(along, ()))(t)
        moved = SampledTorque(
            TIMES, *(tuple(np.add(a, b)) for a, b in zip((A, B), along[1:], strict=True)),
            interpolation,
        ).piece_at(t)  # fmt: skip
        assert slopes[0] == 0.0
        assert np.add(piece.numbers, slopes) == pytest.approx(moved.numbers, abs=1e-13)


def polynomial(piece, joint):
    """Return the start and the exact coefficients of a piece for the joint A (0) or B (1)."""
    start, *rest = map(Fraction, piece.numbers)
    half = len(rest) // 2
    return start, rest[:half] if joint == 0 else rest[half:]


@pytest.mark.parametrize("joint", [0, 1])
def test_a_line_passes_through_its_samples_exactly(joint):
    effect, samples = SampledTorque(TIMES, A, B, "linear"), list(map(Fraction, (A, B)[joint]))
    for k, (begins, ends) in enumerate(pairwise(map(Fraction, TIMES))):
        start, (value, slope) = polynomial(effect.piece_at(TIMES[k]), joint)
        assert (start, value) == (begins, samples[k])
        assert value + slope * (ends - start) == samples[k + 1]


# A spline with steps of 2 s and of 1 ms.
GRADED = (0.0, 0.1, 0.101, 0.3, 2.3, 2.301, 2.7)


@pytest.mark.parametrize("joint", [0, 1])
def test_a_spline_is_smooth_to_seventy_digits(joint):
    """Values and two derivatives meet at each sample, and the third at the second and last but one.

    These are all its conditions.
    """
    samples = ((0.3, -1.0, 2.0, 0.7, 0.1, 0.4, 1.3), (-0.2, 0.4, 0.0, 1.1, -0.6, 1.7, 0.9))
    effect = SampledTorque(GRADED, *samples, "cubic")
    rows = [polynomial(effect.piece_at(t), joint)[1] for t in GRADED[:-1]]
    scale = max(abs(c) for row in rows for c in row)
    for k, (begins, ends) in enumerate(pairwise(map(Fraction, GRADED))):
        h, (a, b, c, d) = ends - begins, rows[k]
        assert a == Fraction(samples[joint][k])
        left = [a + b * h + c * h**2 + d * h**3, b + 2 * c * h + 3 * d * h**2, 2 * (c + 3 * d * h)]
        if k + 2 == len(GRADED):
            right = [Fraction(samples[joint][-1])]
        else:
            a, b, c, third = rows[k + 1]
            right = [a, b, 2 * c]
            if k in (0, len(GRADED) - 3):
                left, right = [*left, d], [*right, third]
        for one, other in zip(left, right, strict=False):
            assert abs(one - other) < scale / Fraction(10) ** 70


def test_pieces_have_the_digits_of_a_run():
    effect = SampledTorque((0.0, 0.3, 0.7), (0.1, 0.7, -0.9), (0.2, 0.1, 0.3), "linear")
    piece, t = effect.piece_at(0.4), 0.4
    loads = piece.loads(GENERAL.convert(heyoka.real128), None, None, heyoka.real128(t))
    (moment,) = (load.moment for load in loads if load.link == 2)
    with mpmath.workdps(40):
        share = (mpmath.mpf(t) - mpmath.mpf(0.3)) / (mpmath.mpf(0.7) - mpmath.mpf(0.3))
        exact = mpmath.mpf(0.1) + share * (mpmath.mpf(0.3) - mpmath.mpf(0.1))
        assert abs(mpmath.mpf(str(moment)) - exact) < 1e-33
    assert [type(c) for row in piece.coefficients for c in row] == [float] * 4


@pytest.mark.slow_but_first
@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_a_reference_integrates_the_interpolation_of_the_samples(interpolation):
    """3 du/dt = τ: the speed is the integral of a polynomial with rational coefficients."""
    effect = SampledTorque(TIMES, A, (0.0,) * 5, interpolation)
    found = reference(scene(effect, duration=2.5), 25)
    speed = Fraction(TIMES[0]) * Fraction(A[0])
    for begins, ends in pairwise((*TIMES, 2.5)):
        start, row = polynomial(effect.piece_at(begins), 0)
        h = Fraction(ends) - start
        speed += sum(c * h ** (k + 1) / (k + 1) for k, c in enumerate(row))
    assert abs(Fraction(found.states[0][2]) - speed / 3) <= Fraction(1, 10 ** found.digits[0])
    assert found.digits[0] == 25


def test_a_held_torque_gives_parabolas_to_rounding():
    """3 du/dt = τ, piece by piece: speed is the integral of a staircase."""
    trajectory = simulate(
        scene(SampledTorque((0.0, 1.0, 2.0), (3.0, -6.0, 3.0), (0.0,) * 3, "hold"))
    )
    t = trajectory.t
    expected = np.minimum(t, 1) - 2 * np.clip(t - 1, 0, 1) + np.clip(t - 2, 0, 1)
    assert trajectory.u[0] == pytest.approx(expected, abs=1e-14)
    assert trajectory.error < 1e-14
    assert trajectory.events == ()


@pytest.mark.slow
@pytest.mark.parametrize("interpolation", ["hold", "linear", "cubic"])
@pytest.mark.parametrize("method", METHODS)
def test_every_method_keeps_its_accuracy_over_kinks(method, interpolation):
    accuracy = {"semi-implicit-euler": 3e-2, "implicit-midpoint": 1e-4}.get(method, 1e-7)
    effects = Gravity(), SampledTorque(TIMES, A, B, interpolation)
    start = scene(*effects, chain=GENERAL, q=(0.3, -0.4), accuracy=accuracy)
    exact = hybrid_run(start, np.linspace(0, 3, 31), precision="long double")
    trajectory = simulate(start, method=method, samples=31)
    assert trajectory.error <= accuracy
    assert np.abs(trajectory.q - exact.q.astype(float)).max() <= accuracy
    assert np.abs(trajectory.u - exact.u.astype(float)).max() <= accuracy


def test_runge_kutta_keeps_its_order_over_jumps():
    effects = Gravity(), SampledTorque(TIMES, A, B, "hold")
    start = scene(*effects, chain=GENERAL, q=(0.3, -0.4))
    times = np.linspace(0, 3, 11)
    exact = hybrid_run(start, times, precision="long double").q.astype(float)
    errors = [
        np.abs(run.q - exact).max()
        for h in (0.005, 0.0025, 0.00125)
        for run in [numeric_run(start, times, method="rk4", formulation="kane", setting=h)]
    ]
    assert math.log2(errors[0] / errors[2]) / 2 == pytest.approx(4, abs=0.2)


@pytest.mark.slow
def test_samples_of_a_sine_come_near_the_sine():
    sine = scene(Gravity(), JointTorque((0.0, 0.0), (2.0, 0.0), (3.0, 0.0)), chain=GENERAL)
    exact = simulate(sine)
    differences = []
    for count in (121, 241):
        times = tuple(np.linspace(0, 3, count).tolist())
        torque = tuple((2 * np.sin(3 * np.array(times))).tolist())
        sampled = SampledTorque(times, torque, (0.0,) * count, "cubic")
        moved = simulate(replace(sine, effects=(Gravity(), sampled)))
        differences.append(np.abs(moved.q - exact.q).max())
    assert 10 < differences[0] / differences[1] < 25


def test_a_jump_breaks_a_stuck_joint_loose_at_its_instant():
    effects = JointFriction((2.0, 0.0)), SampledTorque((0.0, 1.25), (1.0, 5.0), (0.0, 0.0), "hold")
    trajectory = simulate(scene(*effects))
    assert [(e.time, str(e.mode)) for e in trajectory.events] == [
        (0.0, "A sticks"),
        (1.25, "A slips forward"),
    ]
    t = np.clip(trajectory.t - 1.25, 0, None)
    assert trajectory.q[0] == pytest.approx(t * t / 2, abs=1e-14)


def test_work_closes_the_balance_over_jumps():
    effects = Gravity(), SampledTorque(TIMES, A, B, "hold")
    trajectory = simulate(scene(*effects, chain=GENERAL), samples=17)
    works, T = trajectory.work(), trajectory.kinetic_energy
    assert sum(works.values()) == pytest.approx(T - T[0], abs=1e-10)


def test_a_scene_file_may_have_samples():
    text = """
    [chain]
    mass = [1, 1]
    length = [1, 1]
    [start]
    q = [0, 0]
    [run]
    duration = 1
    [effects.sampled_torque]
    times = [0.0, 0.5]
    A = [1.0, 2.0]
    B = [0.0, 0.0]
    interpolation = "linear"
    """
    assert Scene.parse(text).effects == (
        SampledTorque((0.0, 0.5), (1.0, 2.0), (0.0, 0.0), "linear"),
    )


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ((TIMES, A, B, "spline"), "must be one of hold, linear, cubic; got 'spline'"),
        ((TIMES, A[:-1], B, "hold"), "A must have as many entries as times, 5; got 4"),
        (((0.0, 0.0), (1.0, 1.0), (1.0, 1.0), "hold"), "must increase; got 0.0 s after 0.0 s"),
        (((0.0,), (1.0,), (1.0,), "linear"), "times must have 2 or more entries for linear; got 1"),
        (((0.0, 1.0), (1.0, math.nan), (1.0, 1.0), "hold"), "A must be .*; got nan"),
    ],
)
def test_bad_samples_are_refused(values, words):
    with pytest.raises(ParameterError, match=words):
        SampledTorque(*values)
