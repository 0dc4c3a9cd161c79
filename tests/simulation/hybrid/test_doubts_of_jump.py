"""Doubts on jumps: speeds set to zero, modes that begin early, flat events, slides at a start."""

import math
from dataclasses import dataclass

import pytest

from tests.simulation.hybrid import BALANCED, mode_of, state_of, system_of
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.effect import Effect
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
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
