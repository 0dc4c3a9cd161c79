"""Doubts on jumps: speeds that are set to zero, modes that begin early, slides at a start."""

import math

import pytest

from tests.simulation.hybrid import BALANCED, mode_of, state_of, system_of
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.doubts_of_jump import of_early_mode
from twolink.simulation.hybrid.jump import jump, settle
from twolink.simulation.hybrid.mode import Trigger
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
