import math
import sys
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects import Effect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.motor_inertia import MotorInertia
from twolink.effects.pd_control import PdControl
from twolink.errors import IntegrationError, SimulationError
from twolink.integration.methods import METHODS, NUMERIC_METHODS
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.numeric import numeric_run
from twolink.simulation.smooth.taylor import taylor_run

FALL = Scene.load(data_path("scenes") / "free_fall.toml")
SHORT = Scene(chain=GENERAL, q=(0.3, -0.4), u=(1.1, -0.7), duration=1.0, effects=(Gravity(),))
FIXED_STEP = [name for name, method in NUMERIC_METHODS.items() if method.parameter == "step"]
SCIPY = [name for name, method in NUMERIC_METHODS.items() if method.parameter == "tolerance"]

TIMES = np.linspace(0, 1, 11)


@pytest.fixture(scope="module")
def truth():
    return taylor_run(SHORT, TIMES, formulation="momenta", precision="quadruple")


def error_of(run, truth) -> float:
    q, u = truth.q.astype(float), truth.u.astype(float)
    return float(max(np.abs(run.q - q).max(), np.abs(run.u - u).max()))


@pytest.mark.slow_but_first
@pytest.mark.parametrize("formulation", EQUATIONS)
@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_taylor_series_are_accurate_to_round_off(formulation, precision, truth):
    run = taylor_run(SHORT, TIMES, formulation=formulation, precision=precision)
    difference = np.abs(run.q.astype(truth.q.dtype) - truth.q) if precision == "quadruple" else None
    if difference is not None:
        assert float(difference.max()) < 1e-29
    else:
        assert error_of(run, truth) < 1e-13


@pytest.mark.slow
@pytest.mark.parametrize("formulation", EQUATIONS)
@pytest.mark.parametrize("method", FIXED_STEP)
def test_fixed_step_methods_have_their_order(method, formulation, truth):
    """The measured slope, over two halvings in the asymptotic range."""
    finest = {1: 1 / 4000, 2: 1 / 800, 4: 1 / 200, 6: 1 / 320}[NUMERIC_METHODS[method].order]
    errors = [
        error_of(
            numeric_run(SHORT, TIMES, method=method, formulation=formulation, setting=h), truth
        )
        for h in (4 * finest, 2 * finest, finest)
    ]
    slope = math.log2(errors[0] / errors[2]) / 2
    assert slope == pytest.approx(NUMERIC_METHODS[method].order, abs=0.2)


@pytest.mark.parametrize("formulation", EQUATIONS)
@pytest.mark.parametrize("method", SCIPY)
def test_scipys_methods_reach_the_same_trajectory(method, formulation, truth):
    run = numeric_run(SHORT, TIMES, method=method, formulation=formulation, setting=1e-10)
    assert error_of(run, truth) < 2e-7


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_every_method_meets_the_required_accuracy(method, truth):
    accuracy = 1e-3 if method == "semi-implicit-euler" else 1e-6
    trajectory = simulate(SHORT, accuracy=accuracy, method=method, samples=11)
    assert trajectory.error <= accuracy
    assert trajectory.notes == ()
    assert error_of(trajectory, truth) <= accuracy


@pytest.mark.slow
@pytest.mark.parametrize("formulation", EQUATIONS)
@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_start_at_zero_and_at_rest_meets_every_accuracy(formulation, accuracy):
    """From q = 0 at rest a series has every fourth coefficient only: a trap for step control."""
    exact = simulate(FALL, accuracy=1e-15)
    trajectory = simulate(FALL, accuracy=accuracy, formulation=formulation)
    assert np.abs(trajectory.q - exact.q).max() <= accuracy
    assert np.abs(trajectory.u - exact.u).max() <= accuracy


CASES = [
    (Chain.uniform_bars(), (Gravity(),)),
    (GENERAL, (Gravity(), JointDamping((0.2, 0.1)))),
    (Chain.point_masses((1.0, 0.3), (0.7, 1.1)), (Gravity(),)),
    (GENERAL, (JointSpring((9.0, 5.0)), JointTorque((0.0, 0.0), (2.0, 1.0), (3.0, 2.0)))),
]


@pytest.mark.slow
@pytest.mark.parametrize("case", range(len(CASES)))
def test_the_required_accuracy_is_met_by_random_scenes(case, random):
    """25 random starts of each case, against a 113-bit run: never worse than was asked."""
    chain, effects = CASES[case]
    for _ in range(25):
        q, u = random.uniform(-3, 3, (2, 2)).tolist()
        scene = Scene(
            chain=chain,
            q=tuple(q),
            u=tuple(u),
            duration=float(random.uniform(1, 10)),
            effects=effects,
        )
        accuracy = 10 ** float(random.uniform(-12, -3))
        trajectory = simulate(scene, accuracy=accuracy, samples=101)
        exact = taylor_run(scene, trajectory.t, formulation="lagrange", precision="quadruple")
        assert error_of(trajectory, exact) <= accuracy
        assert trajectory.error <= accuracy


@pytest.mark.slow
def test_an_unattainable_accuracy_is_reported():
    trajectory = simulate(FALL, accuracy=1e-17)
    assert trajectory.precision == "quadruple"
    assert trajectory.holds_until == 0
    assert trajectory.error > 1e-17
    assert "holds until 0 s" in trajectory.notes[0]


@pytest.mark.slow
def test_coarse_methods_report_the_time_until_which_they_hold():
    trajectory = simulate(replace(FALL, duration=1.0), accuracy=1e-9, method="semi-implicit-euler")
    assert 0 <= trajectory.holds_until < 1.0
    assert trajectory.notes


def test_dense_output_is_as_accurate_as_the_samples():
    trajectory = simulate(SHORT, accuracy=1e-10)
    times = np.array([0.0, 0.123456, 0.5, 0.987, 1.0])
    exact = taylor_run(SHORT, times, formulation="lagrange", precision="long double")
    q, u = trajectory.at(times)
    assert np.abs(q - exact.q.astype(float)).max() <= 1e-10
    assert np.abs(u - exact.u.astype(float)).max() <= 1e-10
    q, u = trajectory.at(trajectory.t)
    assert q == pytest.approx(trajectory.q, abs=1e-13)


def test_the_error_includes_the_rounding_of_larger_values_between_samples():
    """With one sample or two, at which speeds are small, and larger values between them."""
    times = np.linspace(0, 1, 400)
    for q, u in (((0.3, -0.4), (0.1, 0.2)), ((-0.5, -0.5), (0.0, 0.0))):
        start = Scene(Chain.uniform_bars(), q, u, 1.0, (Gravity(),))
        exact = taylor_run(start, times, formulation="kane", precision="quadruple")
        found = simulate(start, accuracy=1e-14, samples=2)
        for known, true in zip(found.at(times), (exact.q, exact.u), strict=True):
            assert abs(known.astype(true.dtype) - true).max() <= found.error


@pytest.mark.parametrize("moved", [(0.0, 0.0), (1e-4, 0.0), (0.0, 1e-4)])
def test_an_accuracy_near_the_rounding_of_floats_is_met(moved):
    """The rounding of values is a part of the error with which the run is selected."""
    q = (0.3 + moved[0], -0.4 + moved[1])
    start = Scene(Chain.uniform_bars(), q, (0.1, 0.2), 1.0, (Gravity(),))
    for accuracy in (3e-14, 1e-14, 5e-15, 3e-15):
        assert simulate(start, accuracy=accuracy, samples=2).met


def test_a_trajectory_cannot_be_written_to():
    trajectory = simulate(SHORT)
    for array in (trajectory.t, trajectory.q, trajectory.u):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_a_compiled_scene_is_kept():
    scene = replace(SHORT, q=(0.5, 0.6))
    simulate(scene, accuracy=1e-6)
    assert simulate(replace(scene, q=(0.1, 0.2)), accuracy=1e-6).statistics.compile_seconds < 0.01


def test_absent_effects_add_no_operations():
    """Each effect adds operations to the series, and none are left when it is left out."""
    plain = taylor_run(SHORT, TIMES, formulation="momenta").operations
    gravity_free = taylor_run(replace(SHORT, effects=()), TIMES, formulation="momenta").operations
    assert gravity_free < plain
    for effect in (JointDamping((0.2, 0.1)), JointSpring((9.0, 5.0))):
        with_effect = replace(SHORT, effects=(*SHORT.effects, effect))
        assert taylor_run(with_effect, TIMES, formulation="momenta").operations > plain
    again = taylor_run(replace(SHORT, effects=(Gravity(),)), TIMES, formulation="momenta")
    assert again.operations == plain


class Wind(Effect):
    """An effect of a user's own: a constant force on D."""

    def loads(self, chain, q, u, t=0.0):
        from twolink.loads import Force

        return (Force(chain.D, (1.5, 0.0)),)


def test_a_custom_effect_acts():
    ours = simulate(replace(SHORT, effects=(Gravity(), Wind())))
    known = simulate(replace(SHORT, effects=(Gravity(), Gravity(0.0))))
    assert ours.effects == ("Gravity", "Wind")
    assert np.abs(ours.q - known.q).max() > 0.1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"accuracy": 0.0}, "accuracy must be positive and finite; got 0.0"),
        ({"accuracy": math.nan}, "accuracy must be positive and finite; got nan"),
        ({"method": "euler"}, "method must be one of taylor"),
        ({"method": "DOP85"}, r"got 'DOP85' \(did you mean 'DOP853'\?\)"),
        ({"formulation": "newton"}, "formulation must be one of momenta"),
    ],
)
def test_wrong_options_are_refused(options, words):
    with pytest.raises(SimulationError, match=words):
        simulate(SHORT, **options)


@pytest.mark.parametrize("times", [[-0.1], [1.1], [math.nan]])
def test_times_outside_the_run_are_refused(times):
    with pytest.raises(SimulationError, match="times must be 0 to 1 s; got"):
        simulate(SHORT).at(times)


def cheapest(scene, times, accuracy, exact) -> int:
    """The cost of the cheapest setting that meets an accuracy, in terms of a series."""
    for precision, orders in (("double", range(7, 23, 2)), ("long double", range(15, 25, 2))):
        for order in orders:
            run = taylor_run(scene, times, formulation="momenta", precision=precision, order=order)
            if error_of(run, exact) <= accuracy:
                return run.steps * run.order * run.operations
    raise AssertionError("no setting meets the accuracy")


@pytest.mark.slow
def test_the_cost_is_near_that_of_the_cheapest_setting(random):
    """In terms of series computed: within 8 times it always, within 4 nearly always."""
    ratios = []
    for number in range(40):
        chain, effects = CASES[number % len(CASES)]
        q, u = random.uniform(-3, 3, (2, 2)).tolist()
        scene = Scene(
            chain=chain,
            q=tuple(q),
            u=tuple(u),
            duration=float(random.uniform(1, 10)),
            effects=effects,
        )
        accuracy = 10 ** float(random.uniform(-12, -3))
        trajectory = simulate(scene, accuracy=accuracy, samples=101)
        exact = taylor_run(scene, trajectory.t, formulation="lagrange", precision="quadruple")
        best = cheapest(scene, trajectory.t, accuracy, exact)
        ratios.append(trajectory.statistics.evaluations / best)
    print(sorted(ratios))
    assert max(ratios) <= 8
    assert np.mean(np.array(ratios) <= 4.2) >= 0.75


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [1e-8, 1e-12])
def test_errors_that_decay_within_a_few_steps_are_seen(accuracy):
    """Strong control: truncation errors decay between the few samples, at which they are small."""
    control = PdControl((0.5, -1.0), (3000.0, 800.0), (60.0, 12.0))
    start = Scene(Chain.uniform_bars(), (1.0, -2.0), (0.5, 1.0), 10.0, (Gravity(), control))
    found = simulate(start, accuracy=accuracy, samples=2)
    times = np.linspace(0, 10, 5000)
    exact = taylor_run(start, times, formulation="kane", precision="quadruple")
    q, u = found.at(times)
    assert abs(q.astype(exact.q.dtype) - exact.q).max() <= found.error
    assert abs(u.astype(exact.q.dtype) - exact.u).max() <= found.error


@pytest.mark.parametrize("method", ["taylor", "DOP853"])
def test_a_chain_of_fractions_moves_as_that_of_their_values(method):
    """Quarters and eighths are float64 numbers as well."""
    bars = Chain((1.25, 0.5), (0.75, 0.5), ((0.25, 0.125), (0.25, 0.0)), (0.125, 0.0625))
    fields = ("mass", "length", "centre", "inertia")
    exact = Chain(*(as_fractions(getattr(bars, name)) for name in fields))
    motors = MotorInertia((0.25, 0.5), (1.5, 0.25))
    exact_motors = MotorInertia(as_fractions(motors.inertia), as_fractions(motors.ratio))
    plain = replace(SHORT, chain=bars, effects=(Gravity(), motors), accuracy=1e-6, method=method)
    found = simulate(replace(plain, chain=exact, effects=(Gravity(), exact_motors)))
    expected = simulate(plain)
    np.testing.assert_array_equal(found.q, expected.q)
    np.testing.assert_array_equal(found.energy, expected.energy)
    assert found.energy.dtype == float


def as_fractions(numbers):
    """Return nested tuples of floats as fractions."""
    return tuple(as_fractions(x) if isinstance(x, tuple) else Fraction(x) for x in numbers)


UPRIGHT = Scene(
    Chain.uniform_bars((1.0, 0.7), (1.0, 0.8)),
    (-math.pi / 2, -math.pi / 2),
    (0.0, 0.0),
    6.0,
    (Gravity(),),
    1e-6,
)


def controlled(gain):
    """Uniform bars under PD control with equal gains (N m/rad and N m s/rad)."""
    control = PdControl((0.0, 0.0), (gain, gain), (gain, gain))
    chain = Chain.uniform_bars()
    return Scene(chain, (0.3, -0.2), (0.0, 0.0), 0.1, effects=(Gravity(), control))


FAST = JointTorque((0.0, 0.0), (100.0, 0.0), (2 * math.pi * 400, 0.0))


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("method", "scene"),
    [
        ("RK45", UPRIGHT),
        ("LSODA", UPRIGHT),
        ("rk4", UPRIGHT),
        ("DOP853", replace(UPRIGHT, duration=4.0)),
        ("Radau", replace(UPRIGHT, q=(1e-10 - math.pi / 2, -math.pi / 2), duration=4.0)),
        ("rk4", replace(UPRIGHT, q=(1.5, 1.5), duration=1.0, effects=(Gravity(), FAST))),
    ],
)
def test_other_methods_are_measured_by_taylor_series(method, scene):
    """Two runs of one method may agree: both stay upright, or miss what the loads do in a step."""
    exact, found = simulate(scene, samples=11), simulate(scene, samples=11, method=method)
    assert error_of(found, exact) <= found.error + exact.error
    assert found.met == (found.error <= scene.accuracy)


def test_the_error_of_another_method_is_an_estimate_without_taylor_series(monkeypatch):
    module = sys.modules["twolink.simulation.simulate"]
    monkeypatch.setattr(module, "heyoka_is_here", lambda: False)
    for options in ({}, {"method": "RK45"}):
        found = simulate(SHORT, samples=11, accuracy=1e-6, **options)
        assert found.notes[-1].startswith("The error is an estimate")


@pytest.mark.parametrize("name", ["drop", "stick_slip", "joint_stops"])
def test_friction_and_contact_are_refused_without_taylor_series(monkeypatch, name):
    """The method that takes their place would leave them out."""
    module = sys.modules["twolink.simulation.simulate"]
    monkeypatch.setattr(module, "heyoka_is_here", lambda: False)
    with pytest.raises(SimulationError, match="heyoka is not installed, which a scene with dry"):
        simulate(Scene.load(name), samples=11)


def test_the_error_of_a_motion_too_stiff_for_taylor_series_is_an_estimate():
    """Creep between dampers of 1e8 N m s/rad: Taylor series would take 1e9 steps."""
    scene = replace(SHORT, u=(0.0, 0.0), effects=(Gravity(), JointDamping((1e8, 1e8))))
    found = simulate(scene, samples=11, accuracy=1e-6, method="Radau")
    assert found.notes[-1].startswith("The error is an estimate")


@pytest.mark.parametrize(
    ("method", "gain", "samples"),
    [
        ("gauss-legendre-6", 1500.0, 11),
        ("gauss-legendre-6", 1500.0, 51),
        ("semi-implicit-euler", 200.0, 2),
        ("rk4", 1e4, 11),
    ],
)
def test_a_run_that_fails_is_refined(method, gain, samples):
    """The first step is too long for the iteration, or for stability."""
    scene = controlled(gain)
    times = np.linspace(0, scene.duration, samples)
    first = NUMERIC_METHODS[method].coarsest(1e-3, scene.duration, times[1])
    with pytest.raises(IntegrationError):
        numeric_run(scene, times, method=method, formulation="momenta", setting=first)
    found = simulate(scene, method=method, accuracy=1e-3, samples=samples)
    assert found.met


@pytest.mark.parametrize("method", ["gauss-legendre-6", "semi-implicit-euler"])
def test_a_method_that_fails_with_every_step_is_refused_with_another(method):
    sentence = (
        rf"^{method} fails with every step down to \S+ s \(the iteration of an implicit step did"
        r" not converge\): the motion must stay finite, and a stiff one needs a method such as"
        r" Radau$"
    )
    with pytest.raises(IntegrationError, match=sentence):
        simulate(controlled(1e9), method=method, accuracy=1e-3, samples=2)


def test_a_method_for_stiff_motions_that_fails_is_not_advised(monkeypatch):
    def fails(*given, **options):
        raise IntegrationError("it fails")

    monkeypatch.setattr("twolink.simulation.smooth.numeric.numeric_run", fails)
    with pytest.raises(IntegrationError, match=r"down to 1e-13 \(it fails\): .* such as LSODA$"):
        simulate(SHORT, method="Radau", accuracy=1e-3)


def test_the_error_under_an_effect_without_an_expression_of_heyoka_is_an_estimate(monkeypatch):
    def refused(*given):
        raise TypeError("must be real number, not expression")

    monkeypatch.setattr("twolink.simulation.smooth.stiffness.steps_of_series", refused)
    found = simulate(SHORT, samples=11, accuracy=1e-6, method="DOP853")
    assert found.met
    assert found.notes[-1].startswith("The error is an estimate")


@pytest.mark.parametrize("name", ["general", "stick_slip", "drop"])
@pytest.mark.parametrize("accuracy", [1e-6, 1e-9, 1e-12])
def test_the_error_is_that_of_joint_angles_and_speeds_too(name, accuracy):
    """The angle of joint B is a difference, with up to twice the error of either angle."""
    text = Scene.load(name).to_toml()
    joints = "[chain]\njoint_sign = [1, -1]\njoint_offset = [0.0, 0.5]"
    scene = Scene.parse(text.replace("[chain]", joints, 1))
    scene = replace(scene, duration=min(scene.duration, 3.0))
    exact, found = simulate(scene, accuracy=1e-14), simulate(scene, accuracy=accuracy)
    clear = np.ones(len(found.t), bool)
    for impact in exact.impacts:
        clear &= np.abs(found.t - impact.time) > 1e-5
    for ours, theirs in ((found.theta, exact.theta), (found.omega, exact.omega)):
        assert np.abs(ours - theirs)[:, clear].max() <= found.error + exact.error
    assert found.met


@pytest.mark.slow
def test_values_between_samples_are_rounded_within_the_error():
    """The speed is 0 at both samples, and thousands of rad/s between them."""
    strong = 1e6
    effects = Gravity(9.81 * strong), JointFriction((5.0 * strong, 2.0 * strong))
    scene = Scene(Chain.uniform_bars(), (0.0, 0.0), (0.0, 0.0), 0.01, effects, 1e-11)
    found, finer = simulate(scene, samples=2), simulate(scene, accuracy=1e-14, formulation="kane")
    times = np.linspace(0.0, 0.01, 997)
    off = np.abs(np.concatenate(found.at(times)) - np.concatenate(finer.at(times)))
    assert np.abs(found.u).max() < 1e-3 * np.abs(finer.u).max()
    assert off.max() <= found.error + finer.error
    assert found.error > 1e-13
