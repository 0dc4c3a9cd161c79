"""Jumps, one kind of event after the other: states and modes that are known by hand."""

import math

import pytest

from tests.simulation.hybrid import (
    BALANCED,
    STOP,
    hitting,
    mode_of,
    sliding_painleve,
    state_of,
    stopped_chain,
    system_of,
)
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.errors import IntegrationError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.jump import jump, settle


def test_a_discontinuity_of_the_effects_selects_the_mode_anew():
    friction = JointFriction((0.5, 0.0), (1.0, 0.0))
    before = system_of(JointTorque((0.9, 0.0)), friction, chain=BALANCED)
    state = state_of(before, (0.3, 0.0))
    assert settle(before, state, {}).mode.states == (S.STICKS,)
    after = before.with_effects((JointTorque((1.1, 0.0)), friction))
    assert jump(after, state, mode_of(after, S.STICKS), None).mode.states == (S.FORWARD,)


def test_a_start_that_is_struck_settles_after_its_impacts():
    """Both stops are hit at once: A from −2 to 1 rad/s and then B, as in the test of impacts."""
    system = system_of(STOP, JointStop("B", lower=0.0, restitution=0.5), chain=BALANCED)
    state = state_of(system, (0.0, 0.0), (-2.0, 0.0))
    after = settle(system, state, {})
    assert [strike.number for strike in after.strikes] == [0, 1]
    assert after.state.u == pytest.approx((1 - 3 / 14, 9 / 7))
    assert after.mode.states == (S.OPEN, S.OPEN)
    assert after.notes == ()


def test_two_modes_are_noted():
    """Pulled off, a locked slide may go on or leave."""
    for system, state in sliding_painleve():
        upwards = system.with_effects((Gravity(-9.81), *system.effects[1:]))
        after = settle(upwards, state, {})
        assert (len(after.notes) == 1) == bool(settle(system, state, {}).strikes)
        if after.notes:
            assert "leave a choice" in after.notes[0].sentence
            assert "moves freely" in after.notes[0].sentence


@pytest.mark.parametrize(
    ("torque", "static", "expected"),
    [
        (-6.0, 1.0, (S.PRESSED_BACKWARD, S.CLOSED)),
        (-6.0, 5.0, (S.PRESSED_BACKWARD, S.CLOSED)),
        (-4.0, 5.0, (S.STICKS, S.OPEN)),
    ],
)
def test_a_slide_that_has_just_begun_ends_on_a_contact_along_its_line(torque, static, expected):
    """A has begun to slide backward, and has no speed yet, as link 1 touches its stop."""
    friction = JointFriction((1.0, 0.0), (static, 0.0))
    effects = friction, JointStop("A", lower=0.0), JointTorque((torque, 0.0))
    system = system_of(*effects, chain=BALANCED)
    assert [element.rigid for element in system.elements] == [False, True]
    state = state_of(system, (0.0, 0.5), (0.0, 1.0))._replace(sliding=(-1, 0))
    after = settle(system, state, {})
    assert after.mode.states == expected
    assert after.notes == ()


def test_impacts_without_end_are_an_error(monkeypatch):
    monkeypatch.setattr("twolink.simulation.hybrid.jump._MOST_ROUNDS", 0)
    system = stopped_chain()
    with pytest.raises(IntegrationError, match="from one impact to the next without end"):
        settle(system, hitting(system, -2.0), {})


def between_floor_and_ceiling(precision):
    """Return a system whose D slides and jams on a floor while B is below a ceiling, and a pose."""
    chain = Chain((1.0, 1.71764), (1.0, 0.398342), ((0.5, 0.0), (0.0, 0.0)), (0.0496, 0.0196))
    q = -math.asin(0.2), math.asin(0.484)
    floor = Surface(
        (0.0, 0.398342 * 0.484 - 0.2), (0.0, -1.0), ("D",), 0.4, "poisson", friction=10.0,
        static=40.0, name="floor",
    )  # fmt: skip
    ceiling = Surface(
        (0.0, -0.2), (0.0, 1.0), ("B",), 0.0, "poisson", friction=10.0, name="ceiling"
    )
    loads = Gravity(direction=(0.0, 1.0)), JointTorque((-76.3, 10.6))
    return system_of(*loads, floor, ceiling, chain=chain, precision=precision), q


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_impacts_and_impacts_without_collision_that_answer_each_other_end_at_rest(precision):
    system, q = between_floor_and_ceiling(precision)
    # So slow that all further bounces fit into the Zeno time.
    after = settle(system, state_of(system, q, (0.0, 50 * system.scales.zeno_time)), {})
    assert after.state.u == (0, 0)
    assert after.state.touching == {0, 1}
    assert len(after.strikes) > 10


def test_impacts_without_end_are_named(monkeypatch):
    monkeypatch.setattr("twolink.simulation.hybrid.jump._MOST_ROUNDS", 2)
    system, q = between_floor_and_ceiling("double")
    with pytest.raises(IntegrationError, match="the impacts are on: D on floor, B on ceiling"):
        settle(system, state_of(system, q, (0.0, 7e-7)), {})


def test_a_mode_that_holds_a_moving_element_is_an_error():
    """The stop is said to touch, and link 1 leaves it, pressed by a torque."""
    system = stopped_chain()
    state = state_of(system, (0.0, 0.0))._replace(touching=frozenset({0}))
    assert settle(system, state, {}).mode.states == (S.CLOSED,)
    assert settle(system, state._replace(u=(1e-9, 0.0)), {}).mode.states == (S.CLOSED,)
    with pytest.raises(IntegrationError, match=r"A on its lower stop is held, but moves at 0\.5 "):
        settle(system, state._replace(u=(0.5, 0.0)), {})


def test_a_contact_whose_gap_stays_zero_in_the_motion_of_a_mode_stays_touching():
    """A folded chain turns as one about A, where its end is: on a wall through A."""
    wall = Surface((0.0, 0.0), (1.0, 0.0))
    system = system_of(JointFriction((1.0, 2.0)), wall)
    state = state_of(system, (0.5, 0.5 + math.pi), (1.0, 1.0))
    after = settle(system, state._replace(touching=frozenset({2})), {})
    assert after.mode.states == (S.FORWARD, S.STICKS, S.OPEN)
    assert after.state.touching == {2}
    scene = Scene(system.scene_chain, (0.5, 0.5 + math.pi), (1.0, 1.0), 1.0, system.effects)
    turned = simulate(scene)
    assert turned.met
    assert turned.q[0, -1] == pytest.approx(turned.q[1, -1] - math.pi, abs=1e-12)
