"""Doubts on laws that hold within round-off only: of friction limits, and of forces of contacts."""

import math
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.simulation.hybrid import BALANCED, state_of, system_of
from twolink.arithmetic import exp
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.effect import Effect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.loads import motor_loads
from twolink.scene import Scene
from twolink.simulation.hybrid import doubts_of_zeros
from twolink.simulation.hybrid.doubts_of_zeros import leaving_later
from twolink.simulation.hybrid.jump import settle
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.noise import Zero
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.simulate import simulate


def slow(*values):
    return pytest.param(*values, marks=pytest.mark.slow)


@pytest.mark.parametrize(
    ("excess", "precision", "doubts"),
    [
        (0.0, "double", 1),
        (1e-14, "long double", 1),
        (1e-14, "quadruple", 0),
        (0.0, "quadruple", 0),
        (-1e-3, "double", 0),
    ],
)
@pytest.mark.parametrize("kinetic", [1.0, 2.0])
def test_an_element_at_its_static_limit_within_round_off_is_a_doubt(
    excess, precision, doubts, kinetic
):
    """If it slips after all, it moves at once where kinetic friction is smaller.

    Where it is not, only an excess beyond the round-off of the precision is a doubt.
    """
    torque = JointTorque((2.0 * (1 + excess), 0.0))
    effects = JointFriction((kinetic, 50.0), (2.0, 60.0)), torque
    system = system_of(*effects, chain=BALANCED, precision=precision)
    state = state_of(system, (0.3, 0.7))._replace(t=system.number(2.0))
    found = settle(system, state, {})
    expected = doubts if kinetic < 2.0 or excess else 0
    infinite = [doubt.trigger.kind for doubt in found.doubts if doubt.change == math.inf]
    assert infinite == [E.BREAKS] * expected
    slips = excess > 0 and precision == "quadruple"
    assert (found.mode.states[0] is S.FORWARD) == slips


@pytest.mark.parametrize("excess", [2.0**-52, 2.0**-50, 0.0, -(2.0**-52)])
def test_a_force_within_the_rounding_of_a_start_is_a_doubt_of_its_acceleration(excess):
    torque = JointTorque((2.0 * (1 + excess), 0.0))
    friction = JointFriction((2.0, 60.0))
    scene = Scene(BALANCED, (0.3, 0.7), (0.0, 0.0), 1.0, (friction, torque))
    found = hybrid_run(scene, [0.0, 1.0], precision="quadruple")
    assert found.arcs[0].mode.states[0] is S.STICKS
    # B sticks.
    inertia = float(sum(BALANCED.inertia) + BALANCED.mass[1] * BALANCED.L1**2)
    expected = [2.0 * excess / inertia] if excess >= 0 else []
    rates = [doubt.rate for doubt in found.doubts]
    assert rates == pytest.approx(expected, rel=1e-9, abs=1e-30)
    assert not any(doubt.leaving.growth for doubt in found.doubts)


@pytest.mark.parametrize("duration", [10.0, 1000.0])
@pytest.mark.parametrize("power", [-52, slow(-48), slow(-46), slow(-44), slow(-42), -36])
def test_a_joint_that_is_held_against_a_slightly_larger_torque_has_an_error(power, duration):
    """Without friction the excess would turn link 1 by M⁻¹ x t²/2, with link 2 held to it."""
    excess, bars = 2.0**power, Chain.uniform_bars()
    effects = JointTorque((1.0 + excess, 0.0)), JointFriction((1.0, 5.0))
    run = simulate(Scene(bars, (0.0, 0.0), (0.0, 0.0), duration, effects), samples=2)
    off = abs(run.q[0, -1] - excess / (8 / 3) * duration**2 / 2)
    assert off <= run.error
    assert run.met


@pytest.mark.parametrize("length", [0.01, 0.05, 0.3])
def test_a_contact_gears_up_the_acceleration_that_is_left_out(length):
    """D stays on the floor along a stretched chain: link 2 turns by −1/L2 of link 1.

    Its motor pushes D onto the floor, and the brake at A holds all but an excess. With the floor
    the moment on link 1 is T_A − T_B − T_B gear, by that of link 2, and the brake at A has 1 N m.
    """
    gear, motor = -1 / length, 0.25
    chain = Chain((1.0, 1.0), (1.0, length), ((0.5, 0.0), (0.0, 0.0)), (0.1, 1e-3))
    limit = motor * (1 - gear)
    torque = math.nextafter(1.0 + limit, math.inf)
    excess = float(Fraction(torque) - 1 - Fraction(motor) * (1 + 1 / Fraction(length)))
    floor = Surface((0.0, 0.0), (0.0, -1.0), on=("D",))
    effects = JointTorque((torque, motor)), JointFriction((1.0, 0.0)), floor
    run = simulate(Scene(chain, (0.0, 0.0), (0.0, 0.0), 10.0, effects), samples=2)
    assert str(run.events[0].mode).startswith("A sticks")
    inertia = 0.1 + 0.25 + 1.0 + 1e-3 * gear**2
    moved = abs(gear) * excess / inertia * 10.0**2 / 2
    assert excess > 0
    assert moved <= run.error < 1e-6


@pytest.mark.slow
def test_brakes_that_are_exceeded_together_are_left_out_together():
    """Link 1 has the excess of both, of which one alone would turn the heavy link 2 too."""
    excess, heavy = 2.0**-51, Chain((1.0, 0.01), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (0.08, 10.0))
    effects = JointTorque((1 + excess, -(1 + excess))), JointFriction((1.0, 1.0))
    for duration in (10.0, 1000.0):
        run = simulate(Scene(heavy, (0.0, 0.0), (0.0, 0.0), duration, effects), samples=2)
        rate = 2 * excess / (0.08 + 0.25 + 0.01)
        assert run.error >= rate * max(duration, duration**2 / 2)


def test_a_chain_that_tiny_friction_holds_upright_has_no_accuracy():
    """Gravity in the pose of float64 numbers exceeds the friction, and the chain falls."""
    bars, up = Chain.uniform_bars((1.0, 1.0), (0.1, 0.1)), (-math.pi / 2, -math.pi / 2)
    for limit, met in ((1e-20, False), (0.25, True)):
        scene = Scene(bars, up, (0.0, 0.0), 5.0, (Gravity(), JointFriction((limit, 5.0))))
        run = simulate(scene, samples=2)
        assert run.met == met
    # Link 2 may spin, balanced on B.
    spinning = replace(
        scene,
        chain=Chain((1.0, 1.0), (0.1, 0.1), ((0.05, 0.0), (0.0, 0.0)), (1e-3, 1e-3)),
        u=(0.0, 1.0),
        effects=(Gravity(), JointFriction((1e-20, 0.0))),
        duration=8.0,
    )
    assert not simulate(spinning, samples=2).met
    # One that hangs is held back, however long it does.
    brakes = Gravity(), JointFriction((1e-20, 5.0))
    hanging = replace(scene, q=(-up[0], -up[1]), effects=brakes, duration=1e5)
    assert simulate(hanging, samples=2).met


@pytest.mark.parametrize("excess", [-1e-13, 0.0, 4.5e-16, 1e-14, 1e-13])
def test_a_joint_slips_however_little_its_static_limit_is_exceeded(excess):
    """It stuck up to 1e-13 of the limit, with an error of 3e-16 reported."""
    motor = SampledTorque((0.0, 0.5), (0.0, 2.0 * (1 + excess)), (0.0, 0.0), "hold")
    effects = JointFriction((1.0, 50.0), (2.0, 60.0)), motor
    scene = Scene(Chain.uniform_bars(), (0.3, 0.7), (0.0, 0.0), 1.5, effects)
    found = simulate(scene, accuracy=1e-8)
    assert found.met
    # B sticks: the chain is one body, of inertia 1/3 + 1/3 + 1 + cos(0.4) about A.
    inertia = 5.0 / 3.0 + math.cos(0.4)
    expected = (2.0 * (1 + excess) - 1.0) / inertia if excess > 0 else 0.0
    assert found.u[:, -1] == pytest.approx([expected, expected], abs=1e-12)


UPRIGHT, BARS = Gravity(9.81, (-1.0, 0.0)), Chain.uniform_bars()


def rod_after(torque, duration):
    """Return the angle and the speed of both bars as one rod that stands upright, under a torque.

    B sticks: the inertia about A is 8/3 kg m², and the weight turns it by 2 g sin q.
    """
    found = solve_ivp(
        lambda t, y: [y[1], (2 * 9.81 * math.sin(y[0]) + torque(t)) / (8 / 3)],
        (0.0, duration), (0.0, 0.0), rtol=1e-10, atol=1e-30, method="DOP853",
    )  # fmt: skip
    return found.y[:, -1]


def off(run, expected):
    """Return by how much the end of a run differs from the angle and the speed of one rod."""
    angle, speed = expected
    return max(np.abs(run.q[:, -1] - angle).max(), np.abs(run.u[:, -1] - speed).max())


HELD = JointStop("A", lower=0.0), JointFriction((0.0, 1e3))


@pytest.mark.parametrize(("amplitude", "rate"), [(1e-12, 1e-3), slow(1e-13, 1e-2)])
def test_a_load_that_grows_slowly_from_zero_is_in_the_error_of_a_chain_that_stands(amplitude, rate):
    """The stop has no force, and was held for 14 s with an error of zero: the chain falls."""
    motor = JointTorque((0.0, 0.0), (amplitude, 0.0), (rate, 0.0))
    expected = rod_after(lambda t: amplitude * math.sin(rate * t), 14.0)
    for duration in (2.0, 14.0):
        scene = Scene(BARS, (0.0, 0.0), (0.0, 0.0), duration, (UPRIGHT, *HELD, motor))
        run = simulate(scene, samples=2)
        moved = expected if duration == 14.0 else rod_after(lambda t: amplitude * rate * t, 2.0)
        assert off(run, moved) <= run.error
        assert run.met == (duration == 2.0)
    # Not that the run which measures it ends early.
    cause = "round-off decides at 0 s whether a contact no longer pushes (A on its lower stop)"
    assert cause in run.notes[0]


@pytest.mark.parametrize("growth", [2.0**-42, slow(2.0**-50)])
def test_a_torque_that_exceeds_its_limit_slowly_is_in_the_error(growth):
    """It grows from 1 N m by 1e-18 N m/s and less, far below the round-off of a step."""
    ramp = SampledTorque((0.0, 1e5), (1.0, 1.0 + growth), (0.0, 0.0), "linear")
    effects = (UPRIGHT, JointFriction((1.0, 1e3)), ramp)
    run = simulate(Scene(BARS, (0.0, 0.0), (0.0, 0.0), 20.0, effects), samples=2)
    assert not run.met
    short = simulate(Scene(BARS, (0.0, 0.0), (0.0, 0.0), 4.0, effects), samples=2)
    assert off(short, rod_after(lambda t: growth / 1e5 * t, 4.0)) <= short.error
    assert short.met


@pytest.mark.parametrize("growth", [1e-12, 1e-13, 1e-15])
@pytest.mark.parametrize(
    "held", [(JointFriction((1.0, 1e3)), JointTorque((1.0, 0.0))), HELD], ids=["brake", "stop"]
)
def test_a_limit_that_is_reached_slowly_after_a_start_is_left_at_once(held, growth):
    """A table reaches it exactly at 1 s: longer numbers show what grows from there."""
    table = SampledTorque((0.0, 1.0, 101.0), (-1.0, 0.0, 100 * growth), (0.0, 0.0, 0.0), "linear")
    scene = Scene(BARS, (0.0, 0.0), (0.0, 0.0), 6.0, (UPRIGHT, *held, table))
    run = simulate(scene, samples=2)
    expected = rod_after(lambda t: growth * t, 5.0)
    assert off(run, expected) <= run.error + 1e-9 * abs(expected[0])
    assert run.met


SINES = ((14.0, 1.0), (-14.0, 2.0), (6.0, 3.0), (-1.0, 4.0))
"""Amplitudes and rates of sines whose sum is t⁷ − …: its first six derivatives are zero."""


@pytest.mark.parametrize("size", [1.0, 100.0])
def test_a_limit_that_is_exceeded_flat_at_a_start_is_left_within_a_step(size):
    """Both runs slipped a whole step late, at 0.478 s."""
    sines = (JointTorque((0.0, 0.0), (size * a, 0.0), (k, 0.0)) for a, k in SINES)
    motors = (JointTorque((1.0, 0.0)), *sines)
    scene = Scene(BARS, (0.0, 0.0), (0.0, 0.0), 0.5, (JointFriction((1.0, 1e3)), *motors))
    run = simulate(scene, samples=2)
    assert 0.0 < run.events[1].time < 0.02
    angle = sum(a * (0.5 / k - math.sin(0.5 * k) / k**2) for a, k in SINES) * size / (8 / 3)
    speed = sum(a * (1 - math.cos(0.5 * k)) / k for a, k in SINES) * size / (8 / 3)
    assert off(run, (angle, speed)) <= run.error + 1e-14 * size
    # Where kinetic friction is smaller, the time at which it slips is all that counts.
    hysteretic = replace(scene, effects=(JointFriction((0.5, 1e3), (1.0, 1e3)), *motors))
    assert not simulate(hysteretic, samples=2).met


@pytest.mark.parametrize(("roundings", "met"), [(-4, True), (0, True), (1, False), (7, False)])
def test_a_static_limit_is_a_doubt_where_a_start_exceeds_it_by_its_rounding(roundings, met):
    """Kinetic friction is smaller: in no precision does the element slip, as it would."""
    torque = 1.0 + roundings * 2.0**-52
    effects = JointFriction((0.5, 1e3), (1.0, 1e3)), JointTorque((torque, 0.0))
    run = simulate(Scene(BARS, (0.0, 0.0), (0.0, 0.0), 1.0, effects), samples=2)
    assert np.abs(run.q).max() == 0.0
    assert run.met == met


@pytest.mark.parametrize("excess", [1e-17, 1e-18, 1e-20, 1e-26])
def test_a_static_limit_is_exceeded_by_less_than_the_truncation_of_a_series(excess):
    """Series of order 25 in 113 bits do not show it, and those of a higher order do."""
    late = SampledTorque((0.0, 1.0, 2.0), (0.0, 1.0, 1.0), (0.0, 0.0, 0.0), "hold")
    effects = JointFriction((0.5, 1e3), (1.0, 1e3)), JointTorque((excess, 0.0)), late
    scene = Scene(BARS, (0.0, 0.0), (0.0, 0.0), 2.0, effects)
    low = hybrid_run(scene, [0.0, 2.0], precision="quadruple", order=25)
    assert any(doubt.change == math.inf for doubt in low.doubts) == (excess < 1e-17)
    run = simulate(scene, samples=2)
    assert run.met
    assert run.u[0, -1] == pytest.approx(0.5 / (8 / 3), rel=1e-12)


@pytest.mark.parametrize(
    ("q", "limit"),
    [
        (-0.8848873777325674, 12.426850020790217),
        slow(-1.0889251791440053, 9.092654828437142),
        slow(-0.7481496496215087, 14.380457145579381),
    ],
)
def test_a_weight_that_exceeds_a_brake_by_less_than_a_rounding_is_in_the_error(q, limit):
    """By 1e-21 N m and more. In long doubles it is not; the fall is unstable and long."""
    effects = Gravity(9.81), JointFriction((limit, 1e3))
    scene = Scene(BARS, (q, q), (0.0, 0.0), 25.0, effects)
    run = simulate(scene, samples=2)
    assert not run.met or np.abs(run.q[:, -1] - q).max() > 1e-3
    assert simulate(replace(scene, duration=4.0), samples=2).met


def test_a_contact_along_which_no_force_acts_has_no_doubt():
    """Nothing turns a chain that stands in A = 0 exactly, for any time."""
    scene = Scene(BARS, (0.0, 0.0), (0.0, 0.0), 60.0, (UPRIGHT, *HELD))
    run = simulate(scene, samples=2)
    assert run.error == 0.0


@pytest.mark.parametrize("stiffness", [1e4, slow(1e8), slow(1e12)])
def test_a_chain_that_stands_falls_however_stiff_its_elbow_is(stiffness):
    """A brake at A is exceeded by four roundings of its torque, and the rod falls within 16 s."""
    effects = JointSpring((0.0, stiffness)), JointFriction((1.0, 0.0))
    motor = JointTorque((1.0 + 2.0**-50, 0.0))
    scene = Scene(BARS, (0.0, 0.0), (0.0, 0.0), 16.0, (UPRIGHT, *effects, motor))
    assert not simulate(scene, samples=2).met
    assert simulate(replace(scene, duration=3.0), samples=2).met


@dataclass(frozen=True)
class Fading(Effect):
    """A spring in A whose stiffness fades: 60 N m/rad at 0 s, and a part of 1/e after 1 s."""

    def loads(self, chain, q, u, t=0.0):
        """Return its torque."""
        return motor_loads(-60.0 * exp(-t) * q[0], 0 * q[1])


def test_a_chain_that_stands_falls_as_the_spring_that_held_it_fades():
    """Beyond 1.1 s the weight, 19.62 N m/rad, exceeds the spring; it was stable at the start.

    The brake at A is exceeded by four roundings of its torque.
    """
    excess = 2.0**-50
    effects = Fading(), JointFriction((1.0, 1e3)), JointTorque((1.0 + excess, 0.0))
    scene = Scene(BARS, (0.0, 0.0), (0.0, 0.0), 12.0, (UPRIGHT, *effects))
    run = simulate(scene, samples=2)
    moved = solve_ivp(
        lambda t, y: [y[1], ((19.62 - 60.0 * math.exp(-t)) * y[0] + excess) / (8 / 3)],
        (0.0, 12.0), (0.0, 0.0), rtol=1e-10, atol=1e-30, method="DOP853",
    ).y[:, -1]  # fmt: skip
    assert 1e-5 < off(run, moved) <= run.error
    assert simulate(replace(scene, duration=4.0), samples=2).met


@pytest.mark.parametrize("excess", [slow(2.0**-52), 0.0])
def test_a_motion_that_is_left_out_falls_where_the_chain_rests_later(excess):
    """Link 2 stands on a stop without force, and falls from it where link 1 has crept.

    The brake at A is exceeded by one rounding for 1 s; a spring holds link 1 until it sticks.
    Both runs stood exactly still, with an error of 4e-14. The rod creeps to 2 x / (k − 2 g).
    """
    motors = SampledTorque((0.0, 1.0), (1.0 + excess, 0.5), (-1.0, 0.0), "hold")
    held = JointSpring((1000.0, 0.0)), JointFriction((1.0, 0.0)), JointStop("B", lower=0.0)
    scene = Scene(BARS, (0.0, 0.0), (0.0, 0.0), 9.0, (UPRIGHT, *held, motors))
    run = simulate(scene, samples=2)
    fallen = 2 * excess / (1000.0 - 19.62) * math.cosh(8.0 * math.sqrt(1.5 * 9.81))
    assert abs(run.q[1, -1] - fallen) <= run.error
    assert run.met == (excess == 0.0)
    far = simulate(replace(scene, duration=12.0), samples=2)
    assert (far.error == math.inf) == (excess > 0.0)


def test_a_chain_that_rests_in_a_mode_goes_on_in_it_though_no_other_mode_is_possible(monkeypatch):
    effects = UPRIGHT, JointFriction((1.0, 1e3))
    scene = Scene(BARS, (0.0, 0.0), (0.0, 0.0), 0.5, effects)
    run = hybrid_run(scene, [0.0, 0.5], precision="double")
    monkeypatch.setattr(doubts_of_zeros, "is_solvable", lambda *_: False)
    at_limit = {Trigger(E.BREAKS, 0, 1): Zero(1.0, 1e-17, 1e-16, 1e-16, True)}
    assert leaving_later(system_of(*effects), run.arcs[0], at_limit) == (0.0, math.inf, 0.0)


def test_a_motion_that_is_left_out_goes_on_as_by_a_mode_only_where_the_chain_rests():
    """Where it moves, the difference of two runs shows how a change grows."""
    effects = UPRIGHT, JointFriction((1.0, 1e3))
    for speed, grows in ((0.0, False), (1e-9, None)):
        scene = Scene(BARS, (0.0, 0.0), (speed, speed), 0.5, effects)
        run = hybrid_run(scene, [0.0, 0.5], precision="double")
        system = system_of(*effects)
        found = leaving_later(system, run.arcs[0], {})
        assert (found and bool(found.growth)) == grows
    trigger = Trigger(E.BREAKS, 0, 1)
    at_limit = Zero(1.0, 1e-17, 1e-16, 1e-16, True)
    run = hybrid_run(replace(scene, u=(0.0, 0.0)), [0.0, 0.5], precision="double")
    assert leaving_later(system, run.arcs[0], {trigger: at_limit}).growth > 2.0
