"""Jumps, one kind of event after the other: states and modes that are known by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, mode_of, state_of, system_of
from twolink import lagrange
from twolink.contact.force_laws import Phase, PlasticState
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.errors import IntegrationError
from twolink.simulation.hybrid.compliant_state import CompliantState
from twolink.simulation.hybrid.dynamics import Pose
from twolink.simulation.hybrid.jump import (
    direction_of,
    jump,
    nearby,
    press,
    settle,
    sliding_after,
)
from twolink.simulation.hybrid.mode import BOUNCES_DIE_AWAY, Trigger
from twolink.simulation.hybrid.tolerances import zeno_time

STOP = JointStop("A", lower=0.0, restitution=0.5)
ONTO = JointTorque((-6.0, 0.0))
"""Link 1 turns to the stop with −2 rad/s²."""


def stopped_chain(*more, restitution=0.5, **options):
    stop = JointStop("A", lower=0.0, restitution=restitution)
    return system_of(ONTO, stop, *more, chain=BALANCED, **options)


def hitting(system, speed, index=0):
    """Return the state in which link 1 arrives at its stop, moving at a speed."""
    state = state_of(system, (1.0, 0.0))
    gaps = tuple(0.0 if i == index else gap for i, gap in enumerate(state.gaps))
    return replace(state, t=2.0, q=(0.0, 0.0), u=(speed, 0.0), gaps=gaps)


# Hits, and the bounces that are left out.


def test_a_contact_that_is_hit_rebounds():
    system = stopped_chain()
    after = jump(system, hitting(system, -2.0), mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.state.u == (1.0, 0.0)
    assert after.mode.states == (S.OPEN,)
    assert after.state.touching == frozenset()
    assert after.state.gaps == (0.0,)
    (strike,) = after.strikes
    assert strike.speeds == (-2.0, 1.0)
    assert strike.impulse.normal == pytest.approx(3 * 3.0)
    assert strike.time == 2.0


def test_a_contact_that_gives_nothing_back_rests():
    system = stopped_chain(restitution=0.0)
    after = jump(system, hitting(system, -2.0), mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.state.u == (0.0, 0.0)
    assert after.mode.states == (S.CLOSED,)
    assert after.state.touching == {0}
    assert after.delay == 0


def test_a_contact_that_is_reached_without_speed_is_not_struck():
    system = stopped_chain()
    after = jump(system, hitting(system, 0.0), mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.strikes == ()
    assert after.mode.states == (S.CLOSED,)


@pytest.mark.parametrize(("share", "dies"), [(0.9, True), (1.1, False)])
def test_bounces_are_left_out_where_all_of_them_fit_into_the_zeno_time(share, dies):
    """From v they take 2 v/a (1 + e + e² + …) = 2 v/(a (1 − e)), with a = 2 and e = 1/2: 2 v."""
    system = stopped_chain()
    limit = zeno_time(system.longest_step, system.rounding)
    arrives = -share * limit
    state = hitting(system, arrives)
    after = jump(system, state, mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    if not dies:
        assert after.mode.states == (S.OPEN,)
        assert after.state.u[0] == pytest.approx(-arrives / 2, rel=1e-14)
        return
    assert after.mode.states == (S.CLOSED,)
    assert after.state.u[0] == 0
    assert after.strikes[-1].impulse.regime == BOUNCES_DIE_AWAY
    assert after.delay == pytest.approx(2 * (-arrives / 2) / (2.0 * 0.5), rel=1e-6)


def test_bounces_that_nothing_presses_back_go_on():
    system = system_of(STOP, chain=BALANCED)
    state = hitting(system, -1e-12)
    after = jump(system, state, mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.mode.states == (S.OPEN,)
    assert after.state.u[0] == pytest.approx(5e-13, rel=1e-14)


def test_lossless_bounces_never_die_away():
    system = stopped_chain(restitution=1.0)
    after = jump(system, hitting(system, -1e-12), mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.mode.states == (S.OPEN,)
    assert after.state.u[0] == pytest.approx(1e-12, rel=1e-14)


def test_a_compliant_contact_that_is_hit_begins_to_press():
    ball = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 1e6)
    system = system_of(ball)
    state = replace(state_of(system, (-0.5, -0.5)), q=(0.0, 0.0), u=(0.5, 0.5), gaps=(0.0,))
    after = jump(system, state, mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.mode.states == (S.CLOSED,)
    assert after.state.compliant[0].sqrt_depth == 0
    assert after.state.u == (0.5, 0.5)
    assert after.strikes == ()


def test_a_press_without_speed_starts_at_the_least_depth():
    ball = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 1e6)
    system = system_of(ball)
    state = state_of(system, (-0.5, -0.5))
    pose = Pose(system.chain, lagrange, (0.0, 0.0))
    for u, least in [((0.0, 0.0), 2.0**-26), ((1.0, 0.0), 0.0)]:
        slow = u == (0.0, 0.0)
        pressed = press(system, replace(state, q=(0.0, 0.0), u=u), pose, 0, slow)
        assert pressed.compliant[0].sqrt_depth == least
        assert pressed.touching == {0}


# Leaves.


def test_a_contact_that_no_longer_pushes_opens():
    system = system_of(JointTorque((1e-9, 0.0)), STOP, chain=BALANCED)
    state = state_of(system, (0.0, 0.0))
    assert state.touching == {0}
    after = jump(system, state, mode_of(system, S.CLOSED), Trigger(E.LEAVES, 0))
    assert after.mode.states == (S.OPEN,)
    assert after.state.touching == frozenset()
    assert after.state.gaps == (0.0,)


def test_a_damper_that_is_left_stays_sunk_in_where_it_gives_no_force():
    """The force is zero at a depth of c v/k = 0.04 · 0.5 m."""
    cushion = CompliantSurface((0.0, 0.0), (0.0, -1.0), "kelvin-voigt", 100.0, 4.0)
    system = system_of(cushion)
    angle = math.asin(0.01)
    v = 0.5 / (2 * math.cos(angle))
    state = state_of(system, (angle, angle))
    state = replace(state, u=(-v, -v), touching=frozenset({0}))
    after = jump(system, state, mode_of(system, S.CLOSED), Trigger(E.LEAVES, 0))
    assert after.mode.states == (S.OPEN,)
    assert after.state.compliant[0].residual_depth == pytest.approx(0.02)
    assert after.state.gaps == (0.0,)


# Stops and breaks.


@pytest.mark.parametrize(
    ("torque", "expected"), [(0.4, S.STICKS), (0.9, S.STICKS), (1.1, S.FORWARD), (-1.1, S.BACKWARD)]
)
def test_a_joint_that_stops_sticks_or_turns_around(torque, expected):
    """Kinetic 0.5 and static 1 N m."""
    system = system_of(
        JointTorque((torque, 0.0)), JointFriction((0.5, 0.0), (1.0, 0.0)), chain=BALANCED
    )
    state = replace(state_of(system, (0.3, 0.0)), u=(1e-17, 0.5), sliding=(1,))
    after = jump(system, state, mode_of(system, S.FORWARD), Trigger(E.STOPS, 0, 1))
    assert after.state.u == (0.0, 0.5)
    assert after.state.sliding == (0,)
    assert after.mode.states == (expected,)


@pytest.mark.parametrize(("sense", "expected"), [(1, S.FORWARD), (-1, S.BACKWARD)])
def test_a_joint_whose_limit_is_reached_begins_to_slide(sense, expected):
    system = system_of(
        JointTorque((sense * 1.0, 0.0)), JointFriction((0.5, 0.0), (1.0, 0.0)), chain=BALANCED
    )
    state = state_of(system, (0.3, 0.0))
    after = jump(system, state, mode_of(system, S.STICKS), Trigger(E.BREAKS, 0, sense))
    assert after.mode.states == (expected,)
    assert after.state.u == (0.0, 0.0)


def test_a_joint_that_a_stop_holds_does_not_slide_at_its_limit():
    system = system_of(
        JointTorque((-3.0, 0.0)), JointFriction((1.0, 0.0), (3.0, 0.0)), STOP, chain=BALANCED
    )
    state = state_of(system, (0.0, 0.0))
    mode = mode_of(system, S.STICKS, S.OPEN)
    after = jump(system, state, mode, Trigger(E.BREAKS, 0, -1))
    assert after.mode.states == (S.PRESSED_BACKWARD, S.CLOSED)


def test_a_discontinuity_of_the_effects_selects_the_mode_anew():
    friction = JointFriction((0.5, 0.0), (1.0, 0.0))
    before = system_of(JointTorque((0.9, 0.0)), friction, chain=BALANCED)
    state = state_of(before, (0.3, 0.0))
    assert settle(before, state, {}).mode.states == (S.STICKS,)
    after = before.with_effects((JointTorque((1.1, 0.0)), friction))
    assert jump(after, state, mode_of(after, S.STICKS), None).mode.states == (S.FORWARD,)


# Painlevé.


def sliding_painleve(restitution=0.5):
    """Return the shipped scene's system, whose slide locks under its weight, and its state."""
    q = (1.1, 1.3)
    floor = Surface(
        (0.0, math.sin(1.1) + math.sin(1.3)), (0.0, -1.0), friction=2.0, restitution=restitution
    )
    system = system_of(Gravity(9.81), floor)
    u = np.linalg.solve([-np.cos(q), -np.sin(q)], [0.0, 0.2])
    for direction in (1, -1):
        speeds = tuple(map(float, direction * u))
        yield (
            system,
            replace(state_of(system, q), u=speeds, touching=frozenset({0}), sliding=(direction,)),
        )


def test_a_locked_slide_under_a_weight_is_struck_without_a_collision():
    """In one direction the slide goes on; in the other an impact takes energy."""
    kinds = []
    for system, state in sliding_painleve():
        after = settle(system, state, {})
        kinds.append(len(after.strikes))
        if after.strikes:
            energies = [
                lagrange.kinetic_energy(system.chain, state.q, s.u[1]) for s in after.strikes
            ]
            start = lagrange.kinetic_energy(system.chain, state.q, state.u)
            assert all(energy <= start * (1 + 1e-12) for energy in energies)
            assert after.strikes[0].speeds[0] == pytest.approx(0, abs=1e-15)
        else:
            assert after.mode.states[0].slips
    assert sorted(kinds)[0] == 0
    assert sorted(kinds)[1] >= 1


def test_a_slide_whose_force_grew_without_bound_is_stopped():
    system, state = max(
        sliding_painleve(), key=lambda pair: len(settle(pair[0], pair[1], {}).strikes)
    )
    direction = state.sliding[0]
    slides = S.FORWARD if direction > 0 else S.BACKWARD
    after = jump(system, state, mode_of(system, slides), Trigger(E.JAMS, 0, direction))
    assert after.state.u == (0.0, 0.0)
    assert after.strikes[0].impulse.regime == "slides, then sticks"


# Surfaces that yield.


STEEL = CompliantSurface(
    (0.0, 0.0), (0.0, -1.0), "elasto-plastic", radius=0.02, modulus=(2e11, 2e11),
    poisson=(0.3, 0.3), strength=(1e9, 1e9),
)  # fmt: skip


def pressed_steel(share, phase, u=(0.0, 0.0), dent=None):
    """Return a system and a state pressed to a share of the depth of yield."""
    system = system_of(STEEL)
    material = system.elements[0].hysteresis.material
    depth = share * material.yield_depth
    angle = math.asin(depth / 2)
    state = state_of(system, (-0.5, -0.5))
    own = CompliantState(math.sqrt(depth), 0, dent or PlasticState(phase))
    state = replace(
        state, q=(angle, angle), u=u, gaps=(0.0,), touching=frozenset({0}), compliant=(own,)
    )
    return system, state, material


def phase_after(system, state, kind, sense=0):
    dents = (state.compliant[0].plastic,)
    mode = mode_of(system, S.CLOSED, dents=dents)
    return jump(system, state, mode, Trigger(kind, 0, sense))


@pytest.mark.parametrize(
    ("share", "before", "after"),
    [(1.0, Phase.WHOLE, Phase.YIELDS), (1.9, Phase.YIELDS, Phase.FLOWS)],
)
def test_a_surface_that_is_pressed_deeper_yields_and_then_flows(share, before, after):
    system, state, _ = pressed_steel(share, before, u=(0.1, 0.1))
    found = phase_after(system, state, E.REACHES)
    assert found.state.compliant[0].plastic == PlasticState(after)
    assert found.state.compliant[0].sqrt_depth == state.compliant[0].sqrt_depth
    assert found.mode.dents == (PlasticState(after),)
    assert found.mode.states == (S.CLOSED,)


def test_a_surface_that_is_turned_keeps_a_dent_and_springs_back():
    system, state, material = pressed_steel(5.0, Phase.FLOWS)
    found = phase_after(system, state, E.TURNS, 1)
    dent = found.state.compliant[0].plastic
    assert dent.phase is Phase.SPRINGS_BACK
    depth = 5 * material.yield_depth
    assert dent.deepest == pytest.approx(depth)
    assert dent.residual == pytest.approx(float(material.residual(depth)))
    assert found.mode.dents == (dent,)


def test_a_dent_that_is_left_behind_is_forgotten():
    system, state, _ = pressed_steel(5.0, Phase.FLOWS)
    dent = PlasticState(Phase.SPRINGS_BACK, 1e9, 1e-6, 2e-6)
    own = CompliantState(None, 0, dent)
    state = replace(state, touching=frozenset(), compliant=(own,), u=(-0.1, -0.1))
    mode = mode_of(system, S.OPEN, dents=(dent,))
    after = jump(system, state, mode, Trigger(E.CLEARS, 0))
    assert after.state.compliant[0].plastic == PlasticState(Phase.WHOLE)
    assert after.state.gaps == (0.0,)
    assert after.mode.states == (S.OPEN,)


# Helpers.


def test_contacts_are_nearby_within_the_rounding_of_their_place():
    system = stopped_chain(JointStop("B", upper=1.0))
    state = state_of(system, (0.5, 0.5))
    assert nearby(system, state) == []
    assert nearby(system, replace(state, gaps=(1e-15, 0.5))) == [0]
    assert nearby(system, replace(state, gaps=(1e-15, -1e-15))) == [0, 1]
    assert nearby(system, replace(state, gaps=(1e-13, 0.5))) == []


def test_the_direction_of_a_slide_is_the_sign_of_its_speed_beyond_rounding():
    system = system_of(JointFriction((1.0, 1.0)))
    pose = Pose(system.chain, lagrange, (0.3, 0.2))
    assert sliding_after(system, pose, (5.0, 5.0), (1.0, 3.0)) == (1, 1)
    assert sliding_after(system, pose, (5.0, 5.0), (-1.0, -3.0)) == (-1, -1)
    assert sliding_after(system, pose, (5.0, 5.0), (1.0, 1.0 + 4e-16)) == (1, 0)
    assert direction_of(system, (1.0, 0.0), (5.0, 0.0), (1e-16, 0.0)) == 0
    assert direction_of(system, (1.0, 0.0), (1e-9, 0.0), (1e-16, 0.0)) == 1


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
            assert "leave a choice (Painlevé)" in after.notes[0]
            assert "moves freely" in after.notes[0]


def test_impacts_without_end_are_an_error(monkeypatch):
    monkeypatch.setattr("twolink.simulation.hybrid.jump._MOST_ROUNDS", 0)
    system = stopped_chain()
    with pytest.raises(IntegrationError, match="from one impact to the next without end"):
        settle(system, hitting(system, -2.0), {})
