import itertools
import json
import math
import random
import sys
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction

import flint
import mpmath
import numpy as np
import pytest
from flint import arb
from typer.testing import CliRunner

from tests.accuracy.test_study import END
from twolink import lagrange
from twolink.accuracy import enclosed_run as module
from twolink.accuracy.defect_bound import COARSE_BITS, Step
from twolink.accuracy.enclosed_run import Ended, ProvenRun
from twolink.accuracy.enclosure import Enclosure, enclosure
from twolink.accuracy.frames import Frame
from twolink.accuracy.interval import Interval
from twolink.accuracy.multiprecision import precise_motion
from twolink.accuracy.reference import has_events, reference
from twolink.arithmetic import Pair, exp, sin, sqrt
from twolink.chain import Chain
from twolink.cli import app
from twolink.data import data_path
from twolink.effects import Effect, smooth_loads
from twolink.effects.end_drag import EndDrag
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.motor_inertia import MotorInertia
from twolink.effects.pd_control import PdControl
from twolink.errors import ParameterError, SimulationError, TwolinkError
from twolink.loads import Torque
from twolink.scene import Scene
from twolink.simulation.motion import motion_run

SCENES = data_path("scenes")
GENERAL = Scene.load(SCENES / "general.toml")
SHORT = replace(GENERAL, duration=1.0)

# Two links of any kind, and every smooth effect there is.
OFFSET = Chain((1.25, 0.75), (0.75, 0.5), ((0.4, 0.1), (0.3, -0.05)), (0.06, 0.03))
EVERYTHING = Scene(
    OFFSET,
    (0.4, -1.1),
    (0.7, -0.3),
    0.5,
    (
        Gravity(9.81, (0.0, 1.0)),
        JointTorque((0.3, 0.0), (0.0, 0.8), (0.0, 5.5), (0.0, 0.2)),
        JointDamping((0.05, 0.1)),
        JointSpring((1.5, 0.5), (0.1, -0.2)),
        PdControl((0.5, 0.25), (2.0, 1.0), (0.1, 0.2)),
        EndDrag(0.3),
        MotorInertia((1e-3, 2e-3), (6.0, -6.0)),
    ),
)


def nearest(found, index=0):
    return tuple(Fraction(interval.centre) for interval in found.states[index])


def holds(found, digits, index=0):
    """Return whether decimals that are rounded to some digits may be in the intervals."""
    half = Fraction(1, 2 * 10 ** len(digits[0].split(".")[1]))
    return all(
        abs(Fraction(x) - Fraction(interval.centre)) <= Fraction(interval.radius) + half
        for x, interval in zip(digits, found.states[index], strict=True)
    )


def in_113_bits(scene):
    """Return the end of a scene by quadruple precision, in decimals."""
    times = np.array([0.0, scene.duration])
    run = motion_run(scene, times, formulation="kane", precision="quadruple")
    return tuple(str(x) for x in (*run.q[:, -1], *run.u[:, -1]))


@pytest.fixture(scope="module")
def short():
    return enclosure(SHORT, 30)


@pytest.mark.slow
def test_ten_seconds_of_the_free_chain():
    found = enclosure(GENERAL, 30)
    assert found.radius < 1e-30
    for x, published in zip(nearest(found), END, strict=True):
        unit = Fraction(10) ** Decimal(published).as_tuple().exponent
        assert abs(x - Fraction(published)) <= unit
    assert holds(found, reference(GENERAL, 60).states[0])
    # Quadruple precision errs by more than this interval is wide, and by less than that of a third.
    assert enclosure(GENERAL, 20).contains(0, in_113_bits(GENERAL))


@pytest.mark.slow
def test_an_enclosure_has_sixty_digits_and_contains_the_reference():
    scene = replace(GENERAL, duration=3.0)
    found = enclosure(scene, 60, (1.5, 3.0))
    assert found.radius < 1e-60
    verified = reference(scene, 60, (1.5, 3.0))
    assert all(holds(found, verified.states[index], index) for index in (0, 1))


@pytest.mark.slow
def test_an_enclosure_contains_the_references(short):
    assert short.radius < 1e-30
    many = reference(SHORT, 60).states[0]
    assert short.contains(0, many)
    assert enclosure(SHORT, 20).contains(0, in_113_bits(SHORT))


@pytest.mark.slow
def test_a_state_ten_radii_away_is_rejected(short):
    true = [Fraction(x) for x in reference(SHORT, 60).states[0]]
    assert short.contains(0, true)
    for index in range(4):
        for side in (-10, 10):
            other = list(true)
            other[index] += side * Fraction(short.states[0][index].radius)
            assert not short.contains(0, other)


@pytest.mark.parametrize(
    ("state", "sentence"),
    [
        (("a", 0, 0, 0), r"state\[0\] must be a finite real number, or one in decimal digits; got"),
        ((0, 0, math.nan, 0), r"state\[2\] must be a finite real number, or one in .* got nan"),
        # A state whose first number is outside is no state either.
        ((9, 0, 0), r"state must be four numbers: q1, q2, u1 and u2; got \(9, 0, 0\)"),
        ((0, 0, 0, 0, 0), "state must be four numbers"),
        ((9, "a", 0, 0), r"state\[1\] must be"),
        (5, "state must be four numbers: q1, q2, u1 and u2; got 5"),
        ("1234", "state must be four numbers"),
    ],
)
def test_an_enclosure_contains_states_alone(state, sentence):
    zero = (Interval("0", "1"),) * 4
    found = Enclosure(GENERAL, (0.0,), (zero,), bits=100, order=10, steps=1)
    assert found.contains(0, (0.5, "0.25", Fraction(1, 3), Decimal(1)))
    with pytest.raises(ParameterError, match=sentence):
        found.contains(0, state)


@pytest.mark.slow
def test_another_problem_is_rejected(short):
    """The next float64 to g, and to a start, make other motions."""
    gravity = (Gravity(math.nextafter(9.81, 10)),)
    started = (math.nextafter(SHORT.q[0], 1), SHORT.q[1])
    for scene in (replace(SHORT, effects=gravity), replace(SHORT, q=started)):
        assert not short.contains(0, reference(scene, 50).states[0])


def test_an_enclosure_contains_a_pendulum_by_elliptic_functions():
    """From the horizontal at rest: θ = 2 asin(k cd(ω t, k)) from straight down, k = sin(π/4)."""
    scene = Scene.load(SCENES / "published" / "iftomm_a01_pendulum.toml")
    times = (0.5, 1.0, scene.duration)
    found = enclosure(scene, 30, times)
    with mpmath.workdps(50):
        k = mpmath.sqrt(mpmath.mpf(1) / 2)
        for index, time in enumerate(times):
            z = mpmath.sqrt(mpmath.mpf(9.81)) * mpmath.mpf(time)
            q1 = mpmath.pi / 2 - 2 * mpmath.asin(k * mpmath.ellipfun("cd", z, k=k))
            exact = mpmath.nstr(q1, 48)
            assert exact in found.states[index][0], time
            assert 0 in found.states[index][1]


def test_an_enclosure_of_uniform_rotation_contains_the_exact_angles():
    """Without gravity, and link 2 balanced on the elbow, both angles grow evenly."""
    chain = Chain((1.0, 2.0), (1.0, 0.5), ((0.5, 0.0), (0.0, 0.0)), (0.1, 0.2))
    scene = Scene(chain, (0.1, -0.2), (0.7, -1.3), 3.0)
    found = enclosure(scene, 40, (0.0, 1.0, 3.0))
    for index, time in enumerate(found.times):
        q = [
            Fraction(a) + Fraction(b) * Fraction(time)
            for a, b in zip(scene.q, scene.u, strict=True)
        ]
        assert found.contains(index, (*q, *scene.u))
    assert all(interval.radius == "0" for interval in found.states[0])


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    "scene",
    [replace(SHORT, effects=()), EVERYTHING, replace(EVERYTHING, effects=())],
    ids=["without gravity", "everything", "general links alone"],
)
def test_other_chains_and_effects(scene):
    times = (scene.duration / 3, scene.duration)
    found = enclosure(scene, 25, times)
    verified = reference(scene, 40, times)
    for index in (0, 1):
        assert found.contains(index, verified.states[index])


@pytest.mark.slow
@pytest.mark.parametrize("turned", [100.0, -1e5])
def test_a_chain_that_has_turned_often_has_an_enclosure(turned):
    scene = replace(GENERAL, q=(turned + 0.5, turned - 0.25), duration=0.2)
    assert enclosure(scene, 10).contains(0, reference(scene, 40).states[0])


@pytest.mark.slow
def test_a_digit_is_proven_where_ten_are():
    """Errors leave the tube with few digits, and large angles take digits of the motion."""
    scene = replace(GENERAL, q=(10000.5, 9999.75), duration=1.0)
    verified = reference(scene, 40).states[0]
    assert all(enclosure(scene, digits).contains(0, verified) for digits in (1, 10))


@dataclass(frozen=True)
class Driven(Effect):
    """A torque of every function, with the time and the state in one product."""

    def loads(self, chain, q, u, t):
        return (Torque(1, t * q[0] * exp(-u[0]) - sqrt(2 + sin(t * q[1]))),)


def test_an_effect_of_one_s_own_has_an_enclosure():
    scene = replace(SHORT, duration=0.25, effects=(Gravity(), Driven()))
    found = enclosure(scene, 15)
    assert found.contains(0, reference(scene, 40).states[0])


@dataclass(frozen=True)
class Cubic(Effect):
    """A spring with powers of the state, as a user may write them."""

    stiffness: float

    def loads(self, chain, q, u, t):
        return (Torque(1, self.stiffness - self.stiffness * q[0] ** 3 + (+u[0]) ** 2 / 4),)


@pytest.mark.parametrize("stiffness", [0.1, Fraction(1, 3)])
def test_an_effect_with_powers_has_an_enclosure(stiffness):
    scene = replace(SHORT, duration=0.25, effects=(Gravity(), Cubic(stiffness)))
    assert enclosure(scene, 15).contains(0, reference(scene, 40).states[0])


@pytest.mark.slow
def test_an_error_of_the_approximate_motion_widens_the_enclosure(monkeypatch):
    """A wrong result of heyoka widens the interval; the exact motion stays in it."""
    scene = replace(SHORT, duration=0.25)
    true = reference(scene, 60).states[0]
    right = module.approximation
    error = arb(1e-19)

    def wrong(library, motion, target, now, longest):
        (q1, q2), length, arrived = right(library, motion, target, now, longest)
        q1[3] = (q1[3] + error).mid()
        return (q1, q2), length, arrived

    monkeypatch.setattr(module, "approximation", wrong)
    found = enclosure(scene, 12)
    assert found.contains(0, true)
    assert found.radius > 1e-20
    with pytest.raises(SimulationError, match="found no enclosure to 25 digits"):
        enclosure(scene, 25)
    error = arb(0.01)
    with pytest.raises(SimulationError, match="found no enclosure"):
        enclosure(scene, 5)


@pytest.mark.slow
def test_jumps_between_polynomials_are_added(monkeypatch):
    """Without gravity only the jump, and no defect, shows that a chain is turned as a whole."""
    scene = replace(SHORT, effects=(), u=(3.0, -2.0))
    true = reference(scene, 40).states[0]
    right = module.approximation
    turned = arb(1e-19)

    def wrong(library, motion, target, now, longest):
        (q1, q2), length, arrived = right(library, motion, target, now, longest)
        if now > 0.3:
            q1[0], q2[0] = (q1[0] + turned).mid(), (q2[0] + turned).mid()
        return (q1, q2), length, arrived

    monkeypatch.setattr(module, "approximation", wrong)
    found = enclosure(scene, 12)
    assert found.steps > 3
    assert found.contains(0, true)
    assert found.radius > 1e-19


def a_step(scene, seed, terms):
    """Return a step of a polynomial that is near a motion, and off by its few terms."""
    numbers = random.Random(seed)
    q = tuple(
        [a, b, *(numbers.uniform(-3, 3) for _ in range(4))]
        for a, b in zip(scene.q, scene.u, strict=True)
    )
    coefficients = tuple([arb(c) for c in row] for row in q)
    chain = scene.moving_chain.convert(arb)
    return q, Step(flint, chain, scene.effects, coefficients, arb(0.25), arb(0.05), 120, terms)


@pytest.mark.parametrize("terms", [2, 4, 40])
@pytest.mark.parametrize("scene", [SHORT, EVERYTHING], ids=["bars", "everything"])
def test_the_defect_is_bounded_tightly(scene, terms):
    q, step = a_step(scene, 1, terms)
    cap = flint.ctx.cap
    with flint.ctx.workprec(120):
        flint.ctx.cap = terms
        bounds = [float(bound) for bound in step._defect()]
        flint.ctx.cap = cap
    largest = [0.0, 0.0]
    for s in np.linspace(0.0, 0.05, 201):
        at, u, du = (
            tuple(float(np.polynomial.Polynomial(row).deriv(n)(s)) for row in q) for n in range(3)
        )
        loads = smooth_loads(scene.effects, scene.moving_chain, at, u, 0.25 + s)
        D: Pair = lagrange.inverse_dynamics(scene.moving_chain, at, u, du, loads)
        largest = [max(a, abs(b)) for a, b in zip(largest, D, strict=True)]
    for bound, seen in zip(bounds, largest, strict=True):
        assert seen <= bound
        assert terms < 40 or bound <= 4 * seen


@pytest.mark.slow_but_first
@pytest.mark.parametrize("wide", [1e-3, 1e-9])
@pytest.mark.parametrize("scene", [SHORT, EVERYTHING], ids=["bars", "everything"])
def test_the_jacobian_along_a_step_is_bounded(scene, wide):
    """At all times, and everywhere in the tube about the polynomials."""
    q, step = a_step(scene, 1, 40)
    with flint.ctx.workprec(COARSE_BITS):
        P, spread = step._jacobian(arb(wide), arb(0), step.length)

    def rates(t, *x):
        loads = smooth_loads(scene.effects, scene.moving_chain, x[:2], x[2:], 0.25 + t)
        return lagrange.forward_dynamics(scene.moving_chain, x[:2], x[2:], loads)

    numbers, close = random.Random(2), 0.0
    for _ in range(40):
        t = mpmath.mpf(numbers.choice([0.0, 0.05, numbers.uniform(0, 0.05)]))
        y = [mpmath.polyval(list(map(mpmath.mpf, row[::-1])), t) for row in q]
        y += [mpmath.diff(lambda s, row=row: mpmath.polyval(row[::-1], s), t) for row in q]
        at = [x + numbers.choice([-1, 1, numbers.random()]) * wide for x in y]
        for row, by in itertools.product((0, 1), range(4)):
            order = tuple(int(index == by) for index in range(4))
            slope = mpmath.diff(lambda *x, t=t, row=row: rates(t, *x)[row], at, order)
            known = sum(
                mpmath.mpf(part[row + 2, by].str(25, radius=False)) * t**i
                for i, part in enumerate(P)
            )
            bound = float(spread[row + 2, by].upper())
            assert abs(slope - known) <= bound + 1e-11
            close = max(close, float(abs(slope - known)) / (bound + 1e-11))
    assert wide < 1e-3 or close > 0.5


def test_a_step_that_is_too_long_for_one_bound_is_proven_in_pieces():
    """Errors near the width of the tube, where a bound on a whole step leaves it."""
    free = Scene.load("free_fall")
    scene = replace(free, q=(0.40, 1.50), u=(4.1, -4.96), duration=0.015)
    motion = precise_motion(scene, "momenta", 30)
    with module.balls(flint, motion.bits, 60):
        q, length, _ = module.approximation(flint, motion, 0.015, arb(0), motion.longest_step)
        chain = scene.moving_chain.convert(arb)
        step = Step(flint, chain, scene.effects, q, arb(0), length, motion.bits, 60)
        tube, error = arb(2.0**-24), 1e-8
        before = Frame.around(flint, [arb(error)] * 4)
        with flint.ctx.workprec(COARSE_BITS):
            assert step._over(1, length, before, step._defect(), tube) is None
        bounds = [float(bound) for bound in step.after(before, tube).frame.bounds()]
        end = [float(x.mid()) for x in step.state(length)]
        until = float(length.mid())
    assert max(bounds) < 2.2 * error
    for signs in itertools.product((-1, 1), repeat=4):
        moved = [x + sign * error for x, sign in zip((*scene.q, *scene.u), signs, strict=True)]
        other = replace(scene, q=tuple(moved[:2]), u=tuple(moved[2:]))
        run = motion_run(other, np.array([0.0, until]), formulation="kane")
        for x, y, bound in zip(end, (*run.q[:, -1], *run.u[:, -1]), bounds, strict=True):
            assert abs(x - y) <= bound + 1e-13


@pytest.mark.slow
def test_the_radius_grows_no_faster_than_ten_times_the_error():
    """The radius of the proof beside the error of its approximate motion, from 1 s to 10 s."""
    scene = replace(GENERAL, duration=10.0)
    times = (1.0, 10.0)
    found = module.proven_run(scene, times, 40, 1e-40, lambda share: None)
    true = reference(scene, 60, times)
    errors, radii = [], []
    for index in (0, 1):
        pairs = list(zip(true.states[index], found.states[index], strict=True))
        assert all(x in interval for x, interval in pairs)
        errors.append(max(float(abs(Fraction(x) - Fraction(y.centre))) for x, y in pairs))
        radii.append(max(float(interval.radius) for interval in found.states[index]))
    assert radii[1] / radii[0] < 10 * errors[1] / errors[0]


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("scene", "digits", "times", "sentence"),
    [
        (Scene.load(SCENES / "stick_slip.toml"), 30, None, "must have no events"),
        (Scene.load(SCENES / "sampled_torque.toml"), 30, None, "must have no events"),
        (GENERAL, 0, None, "digits must be a whole number from 1 to 400; got 0"),
        (GENERAL, 30, (11.0,), "times must increase from 0 to 10 s; got 11"),
        (
            replace(GENERAL, duration=20.0, effects=(Gravity(1e6),)),
            30,
            None,
            "must lose at most 400 digits; it loses more until 20 s",
        ),
    ],
)
def test_invalid_requests_are_rejected_with_one_sentence(scene, digits, times, sentence):
    with pytest.raises(TwolinkError, match=sentence):
        enclosure(scene, digits, times)


def test_without_python_flint_the_message_names_the_package(monkeypatch):
    monkeypatch.setitem(sys.modules, "flint", None)
    with pytest.raises(SimulationError, match=r"pip install \"twolink\[rigour\]\""):
        enclosure(SHORT, 20)


@pytest.mark.slow
def test_the_command_prints_and_writes_intervals(tmp_path):
    arguments = ["reference", str(SCENES / "general.toml"), "--times", "0.25,0.5", "--rigorous"]
    for kind in ("json", "csv"):
        file = tmp_path / f"r.{kind}"
        result = CliRunner().invoke(app, [*arguments, "--digits", "20", "--out", str(file)])
        assert result.exit_code == 0, result.output
    last = json.loads((tmp_path / "r.json").read_text())["states"][-1]
    assert f"{last['q1']['centre']} ± {last['q1']['radius']} rad" in result.output
    interval = Interval(**last["q1"])
    assert float(interval.radius) < 1e-20
    assert reference(GENERAL, 40, (0.5,)).states[0][0] in interval
    header, *rows = (tmp_path / "r.csv").read_text().splitlines()
    assert header == "t,q1,q1_radius,q2,q2_radius,u1,u1_radius,u2,u2_radius"
    assert rows[-1].split(",")[:3] == ["0.5", *interval]


def test_the_command_refuses_forces_of_contact():
    result = CliRunner().invoke(app, ["reference", str(SCENES / "hertz_bounce.toml"), "--rigorous"])
    assert result.exit_code == 2
    assert "must have no events but impacts: no dry friction" in result.output


@pytest.mark.slow
def test_the_command_prints_and_writes_impacts(tmp_path):
    file = tmp_path / "drop.json"
    arguments = ["reference", "drop", "--rigorous", "--digits", "5"]
    whole = CliRunner().invoke(app, [*arguments, "--times", "0.5", "--out", str(file)])
    assert whole.exit_code == 0, whole.output
    document = json.loads(file.read_text())
    (impact,) = document["impacts"]
    assert document["ended"] is None
    assert f"{impact['time']['centre']} ± {impact['time']['radius']} s" in whole.output
    assert "impact 1: D on floor, slides" in whole.output
    ended = CliRunner().invoke(app, arguments)
    assert ended.exit_code == 1
    assert "the proof ends at 0.80068" in ended.output
    assert "follow each other within 1e-05 s and accumulate" in ended.output


def committed():
    """Return the shipped scenes without events, and their committed references of ten seconds."""
    for file in sorted(data_path("references").glob("*.json")):
        document = json.loads(file.read_text())
        scene = Scene.parse(document["scene"])
        states = [state for state in document["states"] if float(state["t"]) <= 10]
        if states and not has_events(scene):
            yield pytest.param(scene, states, id=file.stem)


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "states"), list(committed()))
def test_an_enclosure_contains_the_committed_references(scene, states):
    """So those are not only verified, but proven, to all of their digits."""
    digits = states[0]["digits"]
    found = enclosure(scene, digits, tuple(float(state["t"]) for state in states))
    assert found.radius < 10.0**-digits
    for index, state in enumerate(states):
        assert holds(found, [state[name] for name in ("q1", "q2", "u1", "u2")], index)


@dataclass(frozen=True)
class Third(Effect):
    """A spring whose stiffness is 1/3, as a user may write it."""

    def loads(self, chain, q, u, t=0.0):
        return (Torque(1, -q[0] / 3.0),)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("effect", [Gravity(9.81, (3.0, 4.0)), Third()], ids=("tilted", "third"))
def test_an_enclosure_contains_a_reference_with_rounded_inputs_of_no_kind(effect):
    """Components of gravity, or a quotient, in float64 would be outside by 1e-17."""
    scene = Scene(Chain.uniform_bars(), (0.5, 0.2), (0.0, 0.0), 0.5, (effect,))
    (proven,) = enclosure(scene, 30).states
    (state,) = reference(scene, 45).states
    for interval, digits in zip(proven, state, strict=True):
        assert abs(Decimal(interval.centre) - Decimal(digits)) <= Decimal(interval.radius)


@pytest.mark.slow
def test_a_chain_of_long_doubles_has_the_enclosure_of_their_fractions():
    mass = np.longdouble(1) / 3
    found = [
        enclosure(replace(GENERAL, chain=replace(OFFSET, mass=(m, 0.75)), duration=0.1), 20).states
        for m in (mass, Fraction(*mass.as_integer_ratio()))
    ]
    assert found[0] == found[1]


def test_a_proof_that_ended_early_is_repeated_with_the_digits_of_the_time_left(monkeypatch):
    """Digits are lost at a constant rate; at most twice as many as before are expected."""
    tried = []

    def proven(scene, asked, own, radius, report):
        tried.append(own)
        ended = Ended(1e-3 if len(tried) == 1 else 0.5, "too wide", True)
        return ProvenRun((), (), ended, bits=100, order=35, steps=9)

    monkeypatch.setattr("twolink.accuracy.enclosure.proven_run", proven)
    with pytest.raises(SimulationError, match="100 bits in each step do not suffice"):
        enclosure(SHORT, 20, [0.0, 1.0])
    first, second, third = (own - 20 for own in tried)
    assert (second, third) == (3 * first, 2 * second)
