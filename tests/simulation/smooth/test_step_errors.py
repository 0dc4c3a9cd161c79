"""The error that the defects of a run's steps give, against more precise runs."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.simulation.smooth.test_measure import (
    HARD,
    TIMES,
    assert_measured,
    measured,
    scene,
    true_errors,
)
from twolink.arithmetic import sqrt
from twolink.chain import Chain
from twolink.effects import Effect
from twolink.effects.end_drag import EndDrag
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.integration.precisions import PRECISIONS, longer_than
from twolink.loads import motor_loads
from twolink.scene import Scene
from twolink.simulation.smooth import step_errors, taylor
from twolink.simulation.smooth.corrected import corrected_run
from twolink.simulation.smooth.longest_step import pace_of
from twolink.simulation.smooth.measure import measured_run
from twolink.simulation.smooth.step_errors import StepErrors
from twolink.simulation.smooth.steps import Steps
from twolink.simulation.smooth.taylor import taylor_run

STIFF = {
    "stiff springs": (Gravity(), JointSpring((300.0, 500.0))),
    "strong damping": (Gravity(), JointDamping((40.0, 30.0))),
}
# The values of a run have the round-off of the output, which is no part of the defect.
OUTPUT = 8


def observed(
    scene, order, formulation="momenta", precision="double", evaluated_in=None, longest_step=None
):
    """Return a run and the errors that its steps give."""
    errors = StepErrors(scene, formulation, precision, evaluated_in)
    run = taylor_run(
        scene, TIMES, formulation=formulation, precision=precision, order=order,
        longest_step=longest_step, observe=errors,
    )  # fmt: skip
    return run, errors


def missed(scene, run, errors):
    """Return the true error over the bound, the larger of it and of the output, at each time."""
    finest = longer_than(run.precision)
    exact = taylor_run(scene, TIMES, formulation="kane", precision=finest)
    true = true_errors(run, exact)
    sizes = np.abs(np.concatenate([run.q, run.u]).astype(float)).max()
    output = OUTPUT * PRECISIONS[run.precision].rounding * sizes
    return true, errors.at(TIMES) + output


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["momenta", "lagrange", "kane"])
@pytest.mark.parametrize("name", HARD)
def test_the_error_is_bounded_at_all_times(name, formulation):
    for order in (11, 13, 15, 17, 19, 21):
        run, errors = observed(HARD[name], order, formulation)
        for each in (errors, errors.again("long double")):
            true, bound = missed(HARD[name], run, each)
            assert np.all(true <= bound)


def test_the_error_is_bounded_by_little_more_than_itself():
    hard = HARD["reference"]
    run, errors = observed(hard, 15)
    true, bound = missed(hard, run, errors)
    assert np.all(true <= bound)
    assert np.all(bound[5:21] < 2 * true[5:21])


def test_a_longer_precision_bounds_the_error_more_closely():
    """At round-off, the round-off of the estimate is as large as the error itself."""
    hard = HARD["reference"]
    run, errors = observed(hard, 21)
    again = errors.again("long double")
    for each in (errors, again):
        true, bound = missed(hard, run, each)
        assert np.all(true <= bound)
    assert again.round_off_at(TIMES)[-1] < 1e-2 * errors.round_off_at(TIMES)[-1]
    assert again.at(TIMES)[-1] < errors.at(TIMES)[-1] / 2
    _, directly = observed(hard, 21, evaluated_in="long double")
    assert again.at(TIMES) == pytest.approx(directly.at(TIMES))


@pytest.mark.slow
@pytest.mark.parametrize("name", STIFF)
def test_steps_over_which_errors_change_much(name):
    stiff = scene((1.0, -2.0), (0.5, 0.0), effects=STIFF[name])
    for order in (15, 21):
        run, errors = observed(stiff, order)
        if errors.longest_step < run.longest_step:
            run, errors = observed(stiff, order, longest_step=errors.longest_step)
        true, bound = missed(stiff, run, errors)
        assert np.all(true <= bound)
    assert bound[-1] < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("name", ["reference", "chaotic", "damped"])
def test_long_doubles(name):
    for order in (15, 19, 23):
        run, errors = observed(HARD[name], order, precision="long double")
        true, bound = missed(HARD[name], run, errors)
        assert np.all(true <= bound)
    assert bound[-1] < 1e-11


@pytest.mark.slow
def test_random_starts(random):
    """Of 3 × 30 runs none has an error above its bound; the median is well above a hundredth."""
    shares = []
    for hard in HARD.values():
        q, u = random.uniform(-3, 3, (2, 2)).tolist()
        start = scene(tuple(q), tuple(u), hard.chain, hard.effects)
        for order in (13, 17, 21):
            true, bound = missed(start, *observed(start, order))
            shares.append((true / bound).max())
    assert max(shares) <= 1
    assert np.median(shares) > 0.05


def parts_of(steps, *cuts):
    """Yield steps in parts that end at some of them."""
    for first, last in zip((0, *cuts), (*cuts, None), strict=True):
        cut = slice(first, last)
        end = steps.end if last is None else steps.coefficients[last, :, 0]
        yield Steps(
            steps.starts[cut], steps.rests[cut], steps.lengths[cut], steps.coefficients[cut], end
        )


def test_steps_that_come_in_parts_give_the_same():
    """To the stated round-off: that of a rate depends on its place in a SIMD register."""
    found = []
    hard = HARD["reference"]
    taylor_run(hard, TIMES, formulation="momenta", observe=found.append)
    (steps,) = found
    whole, parts = (StepErrors(hard, "momenta", "double") for _ in range(2))
    # Steps from 0 s begin anew.
    whole(steps)
    whole(steps)
    for part in parts_of(steps, 100, 101):
        parts(part)
    noise = whole.round_off_at(TIMES)
    assert parts.round_off_at(TIMES) == pytest.approx(noise, rel=1e-6)
    for each in ("at", "corrected_at", "left_at", "estimate_at"):
        one, other = (getattr(errors, each)(TIMES) for errors in (whole, parts))
        assert np.all(np.abs(other - one) <= noise)
    one, other = (each.correction().at(TIMES)[:2] for each in (whole, parts))
    assert np.all(np.abs(other - one).max(axis=0) <= noise)


def test_too_many_steps_are_not_kept(monkeypatch):
    monkeypatch.setattr(step_errors, "MOST_KEPT", 300)
    found = []
    hard = HARD["reference"]
    taylor_run(hard, TIMES, formulation="momenta", observe=found.append)
    (steps,) = found
    errors = StepErrors(hard, "momenta", "double")
    for part in parts_of(steps, 200, 400):
        errors(part)
    assert not errors.is_kept
    assert errors.again("long double") is None
    assert errors._parts == []
    monkeypatch.undo()
    whole = StepErrors(hard, "momenta", "double")
    whole(steps)
    assert whole.is_kept
    assert errors.at(TIMES) == pytest.approx(whole.at(TIMES), rel=1e-6)


def test_an_error_that_is_not_small_has_no_bound():
    """The motion is linearized: two chaotic motions far apart are not."""
    _, errors = observed(HARD["chaotic"], 7)
    for bounds in (errors.at(TIMES), errors.corrected_at(TIMES)):
        assert np.isfinite(bounds[0])
        assert np.isinf(bounds[-1])
        assert np.all(np.diff(bounds[np.isfinite(bounds)]) >= 0)


def test_a_correction_leaves_more_of_a_larger_error():
    """A hundredth of round-off, a twentieth of truncation, and up to three tenths of large errors.

    The linear motion ends there.
    """
    for order, least, most in ((21, 0.005, 0.012), (17, 0.03, 0.061), (13, 0.06, 0.3)):
        _, errors = observed(HARD["reference"], order)
        part = errors.left_at(TIMES)[-1] / errors.estimate_at(TIMES)[-1]
        assert least <= part <= most


@pytest.mark.parametrize("evaluated_in", ["double", "long double"])
def test_the_round_off_of_the_estimate_is_its_standard_deviation(evaluated_in):
    """The error less its estimate is that of the next precision; 3.5 deviations bound it."""
    shares = []
    for name in ("reference", "chaotic", "damped"):
        hard = HARD[name]
        for order in (17, 19, 21):
            _, errors = observed(hard, order, evaluated_in=evaluated_in)
            finer = errors.again(longer_than(evaluated_in))
            one, other = (each.correction().at(TIMES)[:2] for each in (errors, finer))
            apart = np.maximum.accumulate(np.abs(other - one).max(axis=0))[1:]
            shares.append((apart / errors.round_off_at(TIMES)[1:]).max())
    assert max(shares) < 2.5
    assert np.median(shares) > 0.1


@pytest.mark.slow
def test_the_round_off_of_the_time_is_in_the_bound():
    """A fast torque at 30 s: a rounding of the time changes it more than one of the state."""
    torque = JointTorque((2.7, 0.5), (14.3, 0.9), (9.3, 5.7), (1.5, -2.9))
    effects = (Gravity(), torque, JointSpring((3.9, 22.0), (2.0, -1.2)))
    chain = HARD["reference"].chain
    pushed = Scene(chain, (0.0, 0.0), (-4e-4, -2e-3), 30.0, effects)
    times = np.linspace(0, 30, 61)
    exact = taylor_run(pushed, times, formulation="kane", precision="quadruple")
    for order in (15, 17, 21):
        errors = StepErrors(pushed, "lagrange", "double")
        run = taylor_run(pushed, times, formulation="lagrange", order=order, observe=errors)
        found = corrected_run(run, times, errors.correction(), "double")
        output = OUTPUT * 2**-52 * np.abs(np.concatenate([run.q, run.u])).max()
        assert np.all(true_errors(run, exact) <= errors.at(times) + output)
        assert np.all(true_errors(found, exact) <= errors.corrected_at(times) + output)


def shares(scene, times, order, precision="double", evaluated_in="double", longest_step=None):
    """Return the true error over its bound, of a run and of the corrected one."""
    errors = StepErrors(scene, "momenta", precision, evaluated_in)
    run = taylor_run(
        scene, times, formulation="momenta", precision=precision, order=order,
        longest_step=longest_step, observe=errors,
    )  # fmt: skip
    found = corrected_run(run, times, errors.correction(), evaluated_in)
    exact = taylor_run(scene, times, formulation="kane", precision="quadruple")
    sizes = np.abs(np.concatenate([run.q, run.u]).astype(float)).max()
    output = OUTPUT * PRECISIONS[run.precision].rounding * sizes
    return tuple(
        float((true_errors(each, exact) / (bound + output)).max())
        for each, bound in ((run, errors.at(times)), (found, errors.corrected_at(times)))
    )


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["double", "long double"])
def test_round_off_that_is_the_same_on_all_steps_is_in_the_bound(precision):
    """The constants of a chain are rounded once: over 4500 steps their errors add up."""
    swing = Scene(
        Chain.uniform_bars(), (0.01, -0.02), (0.0, 0.0), 30.0, (JointSpring((300.0, 500.0)),)
    )
    times = np.linspace(0, 30, 101)
    assert max(shares(swing, times, 19, precision, precision)) < 1


TORQUES = JointTorque((0.0, 0.0), (2.0, 3.0), (14.3, 9.0), (1.5, -2.9))
PUSHED = Scene(
    Chain.uniform_bars(), (0.1, 0.2), (0.0, 0.0), 28.0,
    (Gravity(), JointDamping((0.5, 0.5)), TORQUES),
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("precision", "order", "steps"), [("double", 21, 19_000), ("long double", 23, 7901)]
)
def test_equal_steps_have_exact_times(precision, order, steps):
    """Sums of equal steps in long doubles would miss the times of torques by 1e-15 s."""
    times = np.linspace(0, 28, 57)
    assert max(shares(PUSHED, times, order, precision, "long double", 28 / steps)) < 1


def test_a_part_of_a_run_starts_at_its_exact_time(monkeypatch):
    """Rounded to float64, the start of a part would be 1e-16 s off: the torques' error is 1e-14."""
    fewer = replace(PRECISIONS["long double"], steps_at_once=50)
    monkeypatch.setattr(taylor, "PRECISIONS", {**PRECISIONS, "long double": fewer})
    times = np.linspace(0, 3, 13)
    short = Scene(PUSHED.chain, PUSHED.q, PUSHED.u, 3.0, PUSHED.effects)
    assert max(shares(short, times, 23, "long double", "quadruple")) < 1


@pytest.mark.slow
def test_loads_that_nearly_cancel_have_their_own_round_off():
    """Springs of 1000 N m/rad that torques balance: the sum of loads is a millionth of them."""
    balanced = Scene(
        Chain.uniform_bars(), (1e-6, -1e-6), (0.0, 0.0), 10.0,
        (JointSpring((1e3, 1e3), (1.1, 0.7)), JointTorque((-1100.0, -700.0))),
    )  # fmt: skip
    times = np.linspace(0, 10, 41)
    for evaluated_in in ("double", "long double"):
        assert max(shares(balanced, times, 21, evaluated_in=evaluated_in)) < 1


@pytest.mark.slow
def test_a_defect_that_is_constant_over_steps_decays_along_them():
    """Strong control under a fast torque: its rounding of t is a defect of whole steps.

    The product h J reaches 2.5, so that a defect is carried by exp(h J) over the rest of its step.
    """
    pushed = Scene(
        HARD["reference"].chain,
        (0.0, 0.0),
        (4.5e-5, -1.6e-3),
        30.0,
        (
            Gravity(),
            JointTorque((-2.4, -3.4), (55.0, 0.59), (6.7, 9.0), (1.4, 2.7)),
            PdControl((-0.14, 1.4), (1200.0, 1.7), (64.0, 0.19)),
        ),
    )
    times = np.linspace(0, 30, 3001)
    exact = taylor_run(pushed, times, formulation="kane", precision="quadruple")
    errors = StepErrors(pushed, "momenta", "double", "long double")
    run = taylor_run(pushed, times, formulation="momenta", order=17, observe=errors)
    found = corrected_run(run, times, errors.correction(), "long double")
    assert np.all(true_errors(run, exact) <= errors.at(times) + 2**-50)
    assert np.all(true_errors(found, exact) <= errors.corrected_at(times))
    assert errors.estimate_at(times)[-1] < 2 * true_errors(run, exact)[-1]


STRONGLY_DAMPED = Scene(
    Chain.uniform_bars(),
    (-2.2, 1.8),
    (0.0, 0.0),
    3.0,
    (Gravity(), JointDamping((5.0, 1.2)), EndDrag(1.9)),
)


def test_steps_in_which_the_links_turn_far_have_round_off_of_the_terms_of_their_sines():
    """Uncoupled links turn at a steady pace: their own series end, and steps are long."""
    torque = JointTorque((0.3, 0.1))
    chain = Chain((1.0, 0.5), (1.0, 1.0), ((0.0, 0.0),) * 2, (0.6, 1.0))
    spins = Scene(chain, (0.0, 0.0), (3.0, 1.0), 9.0, (torque,))
    end = np.array([9.0])
    _, usual = observed(spins, 15, "kane", longest_step=0.2)
    assert usual.round_off_at(end) < 1e-14
    _, longer = observed(spins, 15, "kane", longest_step=0.8)
    # Each of a dozen steps has e^x roundings of a change of some radians.
    turn = 0.8 * 4.0
    assert longer.round_off_at(end) > math.exp(turn) * 2.0**-53 * 3.0
    _, far = observed(spins, 15, "kane", longest_step=9.0)
    assert longer.at(end) < 1e-9 < far.at(end)


def test_steps_in_which_errors_decay_too_far_have_no_bound():
    """The series in h J do not serve there; a run of shorter steps has bounds."""
    times = np.linspace(0, 3, 61)
    exact = taylor_run(STRONGLY_DAMPED, times, formulation="kane", precision="quadruple")
    errors = StepErrors(STRONGLY_DAMPED, "momenta", "double", "long double")
    run = taylor_run(STRONGLY_DAMPED, times, formulation="momenta", order=19, observe=errors)
    assert np.isinf(errors.at(times)[-1])
    assert errors.longest_step < run.longest_step / 2
    again = StepErrors(STRONGLY_DAMPED, "momenta", "double", "long double")
    run = taylor_run(
        STRONGLY_DAMPED, times, formulation="momenta", order=19,
        longest_step=errors.longest_step, observe=again,
    )  # fmt: skip
    assert np.isinf(again.longest_step)
    found = corrected_run(run, times, again.correction(), "long double")
    assert np.all(true_errors(run, exact) <= again.at(times) + 2**-50)
    assert np.all(true_errors(found, exact) <= again.corrected_at(times))


@pytest.mark.parametrize("accuracy", [1e-11, 1e-13])
def test_a_strongly_damped_motion_has_its_accuracy(accuracy):
    times = np.linspace(0, 3, 61)
    exact = taylor_run(STRONGLY_DAMPED, times, formulation="kane", precision="quadruple")
    found = measured_run(
        STRONGLY_DAMPED,
        times,
        accuracy,
        "momenta",
        lambda name: lambda share: None,
        correct=True,
        pace=pace_of(STRONGLY_DAMPED),
    )
    assert found.worst <= accuracy
    assert np.all(true_errors(found.kept, exact) <= found.errors)
    assert found.kept.precision != "quadruple"


FREE = Scene(Chain.uniform_bars(), (0.0, 0.5), (3.0, 3.1), 40.0, ())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("q", "u", "duration", "accuracy"),
    [
        ((0.0, 0.5), (3.0, 3.1), 1000.0, 2e-9),
        ((0.0, 0.1), (3.0, 2.9), 3000.0, 1e-8),
        ((0.0, 0.1), (3.0, 2.9), 8000.0, 1e-6),
    ],
)
def test_a_free_spin_of_very_many_turns(q, u, duration, accuracy):
    """Errors of flows of 1e-6 add up over 24,000 steps, and hid half of the error."""
    spin = replace(FREE, q=q, u=u, duration=duration)
    times = np.linspace(0.0, duration, 21)
    exact = taylor_run(spin, times, formulation="momenta", precision="long double")
    assert_measured(spin, accuracy, times, exact)


@pytest.mark.parametrize(("exponent", "count"), [(0.0, 1), (1e-6, 1), (0.1, 2), (0.5, 4), (2.5, 8)])
def test_moments_that_are_left_out_are_a_thousandth_of_the_defect(exponent, count):
    assert 1 + step_errors._moments(np.array([0.0, exponent])) == count
    # The first one that is left out: x^k/k!, k = count + 1.
    left_out = exponent ** (count + 1) / math.factorial(count + 1)
    assert left_out <= 1e-3 or count == step_errors.MOMENTS


def test_moments_that_are_left_out_do_not_change_the_estimate(monkeypatch):
    found = []
    hard = HARD["damped"]
    taylor_run(hard, TIMES, formulation="momenta", order=11, observe=found.append)
    (steps,) = found
    some, every = (StepErrors(hard, "momenta", "double", "long double") for _ in range(2))
    some(steps)
    monkeypatch.setattr(step_errors, "_OF_MOMENTS", 0.0)
    every(steps)
    apart = np.abs(some.estimate_at(TIMES) - every.estimate_at(TIMES))
    assert apart.max() <= 1e-3 * every.estimate_at(TIMES).max()


# Torques accelerate the chain to 480 rad/s; then the error shrinks, while that of its direction
# does not.
ACCELERATED = Scene(
    Chain(
        (0.34910030884858356, 2.8958851230861513),
        (0.34224314698112474, 0.39068239455909487),
        (
            (0.09598646402224775, -0.014837721208942133),
            (0.29948950243128314, -0.08827439442305621),
        ),
        (0.0015086915775990568, 0.018033189170039685),
    ),
    (2.193777707115606, -0.705430928743068),
    (0.0, 0.0),
    20.0,
    (
        JointTorque(
            (-0.6686943162417298, -0.9851101730977172),
            (4.774953034354372, 5.007923348104755),
            (3.987912752699197, 0.5308528775120086),
        ),
    ),
)


@pytest.mark.slow
def test_errors_of_flows_grow_in_their_own_directions():
    """A correction left a third of the error here, where flows are wrong by one percent in all."""
    times = np.linspace(0.0, 20.0, 401)
    exact = taylor_run(ACCELERATED, times, formulation="kane", precision="long double")
    errors = StepErrors(ACCELERATED, "momenta", "double", "long double")
    run = taylor_run(ACCELERATED, times, formulation="momenta", order=21, observe=errors)
    found = corrected_run(run, times, errors.correction(), "long double")
    true = true_errors(found, exact)
    assert true[-1] > 0.2 * errors.estimate_at(times)[-1]
    output = OUTPUT * 2**-52 * np.maximum.accumulate(np.abs(run.u).max(axis=0))
    assert np.all(true <= errors.corrected_at(times) + output)
    assert np.all(true_errors(run, exact) <= errors.at(times) + output)


def test_errors_of_steps_that_cancel_are_known_less():
    """The motion stays straight, as its numbers are exact: defects within steps cancel."""
    chain, rate = Chain.uniform_bars((3.0, 3.0), (1.0, 1.0)), -2.625
    torque = JointTorque(amplitude=(8 * rate, 2.5 * rate), frequency=(0.75, 0.75))
    effects = (JointSpring((0.0, -40.0)), JointDamping((0.0, 0.5)), torque)
    straight = Scene(chain, (0.7, 0.7), (8.0, 8.0), 5.0, effects)
    times = np.linspace(0.0, 5.0, 41)
    errors = StepErrors(straight, "lagrange", "long double", "quadruple")
    run = taylor_run(
        straight, times, formulation="lagrange", precision="long double", order=23,
        longest_step=0.1011796571725747, observe=errors,
    )  # fmt: skip
    fixed = corrected_run(run, times, errors.correction(), "quadruple")
    turned = 0.7 + 8 * times + rate / 0.75 * (times - np.sin(0.75 * times) / 0.75)
    speed = 8 + rate / 0.75 * (1 - np.cos(0.75 * times))
    true = max(np.abs(fixed.q - turned).max(), np.abs(fixed.u - speed).max())
    assert errors.left_at(times)[-1] < true <= errors.corrected_at(times)[-1]


@dataclass(frozen=True)
class FineDrag(Effect):
    """A drag of joint B that grows with the speed v within a tiny range: c v √(v² + e²)."""

    coefficient: float
    range: float

    def loads(self, chain, q, u, t=0.0):
        c, e, v = chain.scalar(self.coefficient), chain.scalar(self.range), u[1] - u[0]
        return motor_loads(0.0, -c * v * sqrt(v * v + e * e))


@pytest.mark.parametrize("accuracy", [1e-6, 1e-8])
def test_errors_beyond_the_range_in_which_loads_change_are_unknown(accuracy):
    """The motion is straight; errors of a run bend it beyond the range of its own drag."""
    chain, rate = Chain.uniform_bars((3.0, 3.0), (1.0, 1.0)), -2.625
    torque = JointTorque(amplitude=(8 * rate, 2.5 * rate), frequency=(0.75, 0.75))
    effects = (JointSpring((0.0, -40.0)), FineDrag(1e7, 1e-7), torque)
    straight = Scene(chain, (0.0, 0.0), (8.0, 8.0), 5.0, effects)
    times = np.linspace(0.0, 5.0, 41)
    found = measured(straight, accuracy, times)
    turned = 8 * times + rate / 0.75 * (times - np.sin(0.75 * times) / 0.75)
    speed = 8 + rate / 0.75 * (1 - np.cos(0.75 * times))
    true = max(np.abs(found.kept.q - turned).max(), np.abs(found.kept.u - speed).max())
    assert true <= found.worst <= accuracy


def test_smooth_loads_of_ones_own_have_known_errors():
    """They change little within the errors of a run, and built-in ones are not looked at."""
    own = scene((1.0, -2.0), (0.5, 0.0), effects=(Gravity(), FineDrag(0.3, 1.0)))
    _, errors = observed(own, 15)
    assert 0.0 < errors._bent < 1e-6
    assert np.isfinite(errors.at(TIMES)).all()
    _, errors = observed(HARD["damped"], 15)
    assert errors._bent == 0.0
