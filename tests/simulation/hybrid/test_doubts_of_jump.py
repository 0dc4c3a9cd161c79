"""Doubts on jumps: speeds set to zero, modes that begin early, flat events, slides at a start."""

import math
from dataclasses import dataclass, replace
from fractions import Fraction

import pytest

from tests.simulation.hybrid import BALANCED, mode_of, state_of, system_of
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.effect import Effect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.loads import Torque
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.doubts_of_jump import of_early_mode
from twolink.simulation.hybrid.jump import jump, settle
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.hybrid.select import Early, Selection


@pytest.mark.parametrize(("speed", "doubted"), [(1e-8, True), (1e-11, False)])
def test_speeds_that_a_stop_takes_are_a_doubt_if_they_are_more_than_round_off(speed, doubted):
    """The links turn together, and A comes to rest."""
    system = system_of(JointFriction((1.0, 1.0)), chain=BALANCED)
    state = state_of(system, (0.3, 0.2), (1.0, 1.0))._replace(t=2.0, u=(speed, speed))
    after = jump(system, state, mode_of(system, S.FORWARD, S.STICKS), Trigger(E.STOPS, 0, 1))
    assert after.state.u == (0.0, 0.0)
    assert [doubt.change for doubt in after.doubts] == ([speed] if doubted else [])


@pytest.mark.parametrize(("change", "counts"), [(1e-12, True), (0.0, False)])
def test_a_mode_that_begins_early_is_a_doubt_of_the_change_that_it_makes(change, counts):
    state = state_of(system_of(JointFriction((1.0, 1.0)), chain=BALANCED), (0.3, 0.2))
    own = Trigger(E.BREAKS, 1, -1)
    found = of_early_mode(state._replace(t=2.0), Selection((), early=Early(change, own)))
    assert [(doubt.time, doubt.trigger, doubt.change) for doubt in found] == (
        [(2.0, own, change)] if counts else []
    )
    assert of_early_mode(state, Selection(())) == ()


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
@pytest.mark.parametrize(("torque", "sticks"), [(1.5, True), (-1.5, False), (0.5, False)])
def test_a_slide_that_an_impact_leaves_at_a_start_may_go_on(torque, sticks, precision):
    """An impact stops link 1 at a start, and link 2 slides by the rounding of float64.

    Kinetic friction of 1 N m stops it unless the loads drive it on; static friction holds 2 N m.
    """
    stop = JointStop("A", lower=0.0, restitution=0.0)
    effects = JointTorque((-6.0, torque)), stop, JointFriction((0.0, 1.0), (0.0, 2.0))
    scene = Scene(BALANCED, (0.0, 0.25), (-1.0, 1e-15), 1.0, effects)
    system = system_of(*effects, chain=BALANCED, precision=precision)
    found = settle(system, state_of(system, scene.q, scene.u), {})
    infinite = [doubt for doubt in found.doubts if doubt.change == math.inf]
    assert len(infinite) == (sticks and precision != "double")
    run = simulate(scene)
    assert run.met is not sticks
    if sticks:
        assert "round-off decides at 0 s whether a slide comes to rest (B)" in run.notes[0]


@dataclass(frozen=True)
class Flat(Effect):
    """A torque of 1 N m on link 1 plus (t − 1 s)^`power`, which reaches 1 N m flat."""

    power: int

    def loads(self, chain, q, u, t):
        found = 1.0
        for _ in range(self.power):
            found = found * (t - 1.0)
        return (Torque(1, 1 + found),)


@pytest.mark.parametrize("power", [3, 5, 7])
def test_a_static_limit_that_is_reached_flat_is_in_the_error(power):
    """In 113 bits two runs find it at nearly the same wrong time: 1.3e-7 s late for power 5."""
    free = Chain((0.5, 0.5), (1.0, 1.0), ((1.0, 0.0), (0.0, 0.0)), (0.0, 1.0))
    effects = (Flat(power), JointFriction((0.5, 0.0), (1.0, 0.0)))
    found = simulate(Scene(free, (0.0, 0.0), (0.0, 0.0), 2.0, effects), samples=11)
    off = abs(found.u[0, -1] - (0.5 + 1 / (power + 1)))
    assert off <= found.error < 1e2 * max(off, 1e-12)
    assert found.met == (power == 3)


def test_the_doubt_on_a_flat_event_is_the_change_in_its_time():
    """The force of friction falls from 1 to 0.5 N m, on an inertia of 1 kg m²."""
    free = Chain((0.5, 0.5), (1.0, 1.0), ((1.0, 0.0), (0.0, 0.0)), (0.0, 1.0))
    effects = (Flat(3), JointFriction((0.5, 0.0), (1.0, 0.0)))
    scene = Scene(free, (0.0, 0.0), (0.0, 0.0), 2.0, effects)
    run = hybrid_run(scene, [0.0, 2.0], precision="quadruple", order=31)
    arc = next(arc for arc in run.arcs if arc.spread)
    assert arc.event.kind is E.BREAKS
    (doubt,) = (doubt for doubt in run.doubts if doubt.trigger == arc.event)
    assert 1e-12 < arc.spread < 1e-10
    assert doubt.change == pytest.approx(0.5 * arc.spread, rel=1e-6)
    assert all(not arc.spread for arc in hybrid_run(scene, [0.0, 2.0]).arcs)


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
    assert [(doubt.trigger.kind, doubt.change) for doubt in found.doubts] == (
        [(E.BREAKS, math.inf)] * expected
    )
    slips = excess > 0 and precision == "quadruple"
    assert (found.mode.states[0] is S.FORWARD) == slips


@pytest.mark.parametrize("excess", [2.0**-52, 2.0**-50, 0.0, -(2.0**-52)])
def test_a_force_within_the_rounding_of_a_start_is_a_doubt_of_its_acceleration(excess):
    torque = JointTorque((2.0 * (1 + excess), 0.0))
    friction = JointFriction((2.0, 60.0))
    system = system_of(friction, torque, chain=BALANCED, precision="quadruple")
    found = settle(system, state_of(system, (0.3, 0.7)), {})
    assert found.mode.states[0] is S.STICKS
    inertia = float(BALANCED.inertia[0] + BALANCED.mass[1] * BALANCED.L1**2)
    expected = [2.0 * excess / inertia] if excess > 0 else []
    assert [doubt.rate for doubt in found.doubts] == pytest.approx(expected, rel=1e-9)
    assert not any(doubt.leaving.growth for doubt in found.doubts)


@pytest.mark.parametrize("duration", [10.0, 1000.0])
@pytest.mark.parametrize("power", [-52, -48, -46, -44, -42, -36])
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
