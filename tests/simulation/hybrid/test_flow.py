"""One arc against motions in closed form: its end, its event, and its constraints."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, mode_of, state_of, system_of
from tests.simulation.smooth.test_taylor import Kinked
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.errors import IntegrationError
from twolink.scene import Scene
from twolink.simulation.hybrid import flow as flow_module
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.compile import Compiler
from twolink.simulation.hybrid.flow import flow
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.hybrid.steps_of_arc import take_steps


def arc_of(system, q, u, *states, until=10.0, state=None, formulation="lagrange"):
    state = state or state_of(system, q, u)
    mode = mode_of(system, *states)
    compiler = Compiler(formulation)
    return flow(system, state, mode, system.number(until), compiler, lambda t, size: None)


FALLING = JointTorque((-6.0, 0.0)), JointStop("A", lower=0.0, restitution=0.5)
"""Link 1 turns back to its stop with −2 rad/s², and link 2 on its own."""


@pytest.mark.parametrize("formulation", ["kane", "lagrange"])
def test_an_arc_ends_where_its_event_is(formulation):
    """1 + u t − t² = 0."""
    system = system_of(*FALLING, chain=BALANCED)
    arc = arc_of(system, (1.0, 0.3), (0.5, 2.0), S.OPEN, formulation=formulation)
    t = (0.5 + math.sqrt(0.25 + 4)) / 2
    assert arc.event == Trigger(E.HITS, 0)
    assert arc.end.t == pytest.approx(t, rel=4e-16)
    assert arc.end.q == pytest.approx((0.0, 0.3 + 2 * t), abs=1e-15)
    assert arc.end.u == pytest.approx((0.5 - 2 * t, 2.0), rel=1e-15)
    assert abs(arc.end.gaps[0]) < 1e-15
    assert arc.doubts == ()


def test_an_arc_without_an_event_ends_at_the_very_time_that_was_asked_for():
    system = system_of(*FALLING, chain=BALANCED)
    arc = arc_of(system, (1.0, 0.0), (0.0, 0.0), S.OPEN, until=0.7)
    assert arc.event is None
    assert arc.end.t == 0.7
    assert arc.end.q[0] == pytest.approx(1 - 0.49, rel=1e-15)


def test_a_load_that_is_not_smooth_ends_the_run_with_the_time_reached():
    system = system_of(*FALLING, Kinked(), chain=BALANCED)
    words = (
        r"beyond 0 s \(the state, a load or a derivative of a load by time is not finite there\), "
        r"in the mode 'moves freely'; it must stay finite, and its loads smooth$"
    )
    with pytest.raises(IntegrationError, match=words):
        arc_of(system, (1.0, 0.0), (0.0, 0.0), S.OPEN)


@pytest.mark.parametrize("speed", [1e-3, 1e-8, 1e-12])
def test_a_low_bounce_is_accurate_to_round_off(speed):
    """From the stop at v: back after v seconds, with −v."""
    system = system_of(*FALLING, chain=BALANCED)
    arc = arc_of(system, (0.0, 0.0), (speed, 0.0), S.OPEN)
    assert arc.event == Trigger(E.HITS, 0)
    assert arc.end.t == pytest.approx(speed, rel=1e-14)
    assert arc.end.u[0] == pytest.approx(-speed, rel=1e-14)


def test_the_steps_of_an_arc_join_and_end_with_it():
    system = system_of(Gravity(), Surface((0.0, 1.5), (0.0, -1.0)), longest_step=0.05)
    arc = arc_of(system, (0.3, 0.2), (0.0, 0.0), S.OPEN)
    starts = np.concatenate([block.starts for block in arc.blocks])
    lengths = np.concatenate([block.lengths for block in arc.blocks])
    assert starts[0] == 0
    assert starts[1:] == pytest.approx((starts + lengths)[:-1], rel=1e-15)
    assert starts[-1] + lengths[-1] == arc.end.t
    assert lengths.max() <= 0.05
    # The end of the bars is on the floor.
    assert math.sin(arc.end.q[0]) + math.sin(arc.end.q[1]) == pytest.approx(1.5, abs=1e-14)


def test_a_slide_stops_where_friction_has_taken_its_speed():
    """3 kg m² at 2 rad/s against 1.5 N m: 4 s."""
    system = system_of(JointFriction((1.5, 0.0)), chain=BALANCED)
    arc = arc_of(system, (0.0, 0.0), (2.0, 1.0), S.FORWARD)
    assert arc.event == Trigger(E.STOPS, 0, 1)
    assert arc.end.t == pytest.approx(4.0, rel=1e-15)
    # It is the jump that brings the joint to rest.
    assert arc.end.sliding == (1,)
    assert abs(arc.end.u[0]) < 1e-15


def test_a_joint_breaks_loose_where_the_torque_reaches_its_limit():
    """2 sin t = 1 N m at π/6 s."""
    torque = JointTorque((0.0, 0.0), (2.0, 0.0), (1.0, 0.0))
    system = system_of(torque, JointFriction((0.5, 0.0), (1.0, 0.0)), chain=BALANCED)
    arc = arc_of(system, (0.0, 0.0), (0.0, 0.0), S.STICKS)
    assert arc.event == Trigger(E.BREAKS, 0, 1)
    assert arc.end.t == pytest.approx(math.pi / 6, rel=1e-14)


def test_a_contact_leaves_where_its_force_falls_to_zero():
    """1 + 2 cos t N m onto the stop: none at 2 π/3 s."""
    torque = JointTorque((-1.0, 0.0), (-2.0, 0.0), (1.0, 0.0), (math.pi / 2, 0.0))
    system = system_of(torque, JointStop("A", lower=0.0), chain=BALANCED)
    arc = arc_of(system, (0.0, 0.0), (0.0, 0.0), S.CLOSED)
    assert arc.event == Trigger(E.LEAVES, 0)
    assert arc.end.t == pytest.approx(2 * math.pi / 3, rel=1e-14)
    assert arc.end.q[0] == 0


def test_a_spring_throws_back_after_half_its_period():
    """D of a stretched chain moves along y alone for small angles; a damped press ends by force."""
    cushion = CompliantSurface((0.0, 0.0), (0.0, -1.0), "kelvin-voigt", 1e6)
    system = system_of(cushion)
    arc = arc_of(system, (0.0, 0.0), (1e-6, 1e-6), S.CLOSED)
    assert arc.event == Trigger(E.LEAVES, 0)
    # The response of D to its own push in the stretched pose: 1ᵀ M⁻¹ 1.
    M = np.array([[4 / 3, 1 / 2], [1 / 2, 1 / 3]])
    response = np.ones(2) @ np.linalg.solve(M, np.ones(2))
    assert arc.end.t == pytest.approx(math.pi / math.sqrt(1e6 * response), rel=1e-6)


def test_a_rooted_press_takes_the_time_of_hertz():
    """From touch to touch: 2.9432… δ_m/v, with δ_m^{5/2} = 5/4 m v²/K (Johnson, 11.23)."""
    ball = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 1e6)
    system = system_of(ball)
    M = np.array([[4 / 3, 1 / 2], [1 / 2, 1 / 3]])
    mass = 1 / (np.ones(2) @ np.linalg.solve(M, np.ones(2)))
    direction = np.linalg.solve(M, np.ones(2)) * mass
    speed = 1e-4
    arc = arc_of(system, (0.0, 0.0), tuple(speed * direction), S.CLOSED)
    assert arc.event == Trigger(E.LEAVES, 0)
    deepest = (5 / 4 * mass * speed**2 / 1e6) ** 0.4
    factor = 4 / 5 * math.sqrt(math.pi) * math.gamma(2 / 5) / math.gamma(9 / 10)
    assert factor == pytest.approx(2.9432, abs=1e-4)
    assert arc.end.t == pytest.approx(factor * deepest / speed, rel=1e-6)
    assert arc.end.u == pytest.approx(tuple(-speed * direction), rel=1e-5)


def test_an_arc_of_a_rooted_press_ends_at_the_time_that_was_asked_for():
    ball = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 1e6)
    system = system_of(ball)
    arc = arc_of(system, (0.0, 0.0), (0.01, 0.01), S.CLOSED, until=1e-4)
    assert arc.event is None
    assert arc.end.t == 1e-4
    # Hardly braked yet: a depth of speed times time.
    assert arc.end.compliant[0].sqrt_depth ** 2 == pytest.approx(0.02 * 1e-4, rel=0.05)


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_an_arc_has_the_digits_of_its_precision(precision):
    """1 − t² = 0 and 1 − t²/3 = 0."""
    system = system_of(JointTorque((-1.0, 0.0)), FALLING[1], chain=BALANCED, precision=precision)
    arc = arc_of(system, (1.0, 0.0), (0.0, 0.0), S.OPEN)
    # t² = 6, so all digits but a few roundings of 6 belong to the square.
    assert abs(float(arc.end.t * arc.end.t - system.number(6))) < 32 * system.rounding


def test_an_arc_of_too_many_short_steps_is_an_error(monkeypatch):
    """Steps of 1 ms: 10 s are 10 000 of them."""
    system = system_of(*FALLING, chain=BALANCED, longest_step=1e-3)
    monkeypatch.setattr(tolerances, "MANY_STEPS", 4)
    monkeypatch.setattr(tolerances, "MOST_STEPS", 1000)
    monkeypatch.setattr(tolerances, "SHORT_STEPS", 2.0)
    with pytest.raises(IntegrationError, match="its steps become too short"):
        arc_of(system, (100.0, 0.0), (0.0, 0.0), S.OPEN)
    monkeypatch.setattr(tolerances, "MOST_STEPS", 10_000)
    assert arc_of(system, (100.0, 0.0), (0.0, 0.0), S.OPEN, until=0.1).step_count == 100
    # Many steps of the usual length are no reason to give up.
    monkeypatch.setattr(tolerances, "MOST_STEPS", 1)
    monkeypatch.setattr(tolerances, "SHORT_STEPS", 0.5)
    assert arc_of(system, (100.0, 0.0), (0.0, 0.0), S.OPEN, until=0.1).step_count == 100


def test_a_press_in_which_time_stands_still_is_a_failure():
    """With √depth and the speed at zero, the surface neither presses nor lets go."""
    ball = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 1e6, on=("B",))
    system = system_of(ball, chain=BALANCED)
    state = state_of(system, (0.0, 0.5), (1.0, 2.0))
    assert state.compliant[0].sqrt_depth == 0
    still = state._replace(u=(0.0, 2.0))
    with pytest.raises(IntegrationError, match="time stands still"):
        arc_of(system, None, None, S.CLOSED, state=still)


@pytest.mark.parametrize("duration", [1e-9, 1e-3, 0.02])
def test_an_arc_does_not_depend_on_the_last_one_in_its_mode(duration):
    """After a short arc the first steps are short; the event is the same."""
    system = system_of(*FALLING, Gravity(), longest_step=0.5)
    mode, until = mode_of(system, S.OPEN), system.number(10.0)
    state = state_of(system, (1.0, 0.3), (0.5, 2.0))

    def followed(lasts):
        return flow(system, state, mode, until, Compiler("lagrange"), lambda t, size: None, lasts)

    alone = followed({})
    last = alone._replace(end=alone.start._replace(t=alone.start.t + duration))
    after = followed({alone.compiled: last})
    most = max(tolerances.HORIZON * duration, tolerances.SHORT_STEPS * 0.5)
    assert after.blocks[0].lengths[0] == pytest.approx(min(most, alone.blocks[0].lengths[0]))
    assert after.step_count <= alone.step_count + 32
    assert after.event == alone.event
    assert after.end.t == pytest.approx(alone.end.t, rel=1e-14)
    assert after.end.u == pytest.approx(alone.end.u, rel=1e-13)
    other = replace(alone.compiled)
    assert followed({other: last}).blocks[0].lengths[0] == alone.blocks[0].lengths[0]


def test_as_many_steps_are_taken_at_first_as_by_the_last_arc_in_the_mode(monkeypatch):
    """The end of a slide is seen when the steps are certified, and steps beyond it are wasted."""
    system = system_of(JointFriction((1.0, 0.0)), chain=BALANCED, longest_step=0.02)
    mode, state = mode_of(system, S.FORWARD), state_of(system, (1.0, 0.3), (0.5, 0.0))
    taken = []

    def counted(course, ahead, longest):
        found = take_steps(course, ahead, longest)
        taken.append(len(found[0].lengths))
        return found

    monkeypatch.setattr(flow_module, "take_steps", counted)
    first = flow(system, state, mode, 10.0, Compiler("lagrange"), lambda t, size: None)
    assert len(taken) > 1
    taken.clear()
    lasts = {first.compiled: first}
    again = flow(system, state, mode, 10.0, Compiler("lagrange"), lambda t, size: None, lasts)
    assert sum(taken) == first.step_count == again.step_count
    assert again.end == first.end


def test_a_surface_that_recovers_too_fast_is_named():
    """In 1e-12 s, after 27 s: steps as short as roundings of the time."""
    cushion = CompliantSurface(
        (0.0, 1.2), (0.0, -1.0), "kelvin-voigt", stiffness=1e8, loss=1e-4, name="cushion"
    )
    scene = Scene(Chain.uniform_bars(), (0.3, 0.1), (0.0, 0.0), 40.0, (Gravity(0.01), cushion))
    with pytest.raises(IntegrationError, match=r"while D on cushion recovers at 1e\+12 1/s\)"):
        hybrid_run(scene, np.array([0.0, 40.0]))


def test_a_state_that_is_not_finite_ends_the_run(monkeypatch):
    """As where the powers of a step leave the range of the numbers."""
    end_state = flow_module.end_state

    def overflown(*given):
        return end_state(*given)._replace(q=(math.nan, 0.0))

    monkeypatch.setattr(flow_module, "end_state", overflown)
    stop = JointStop("A", lower=0.0)
    scene = Scene(Chain.uniform_bars(), (0.3, 0.1), (0.0, 0.0), 1.0, (stop,))
    with pytest.raises(IntegrationError, match="the state is not finite"):
        hybrid_run(scene, np.array([0.0, 1.0]))


@pytest.mark.parametrize("loss", [1e-3, 1e-4, 1e-6])
def test_a_surface_that_recovers_fast_is_met_again(loss):
    """A point leaves it at a depth that its place in q shows with a digit or two."""
    cushion = CompliantSurface(
        (0.0, 1.2), (0.0, -1.0), "kelvin-voigt", stiffness=1e8, loss=loss, name="cushion"
    )
    scene = Scene(Chain.uniform_bars(), (0.3, 0.1), (0.0, 0.0), 1.0, (Gravity(9.81), cushion))
    found = hybrid_run(scene, np.array([0.0, 1.0]))
    assert sum(arc.mode.states == (S.CLOSED,) for arc in found.arcs) == 2


@pytest.mark.parametrize("unit", [2.0**-10, 1.0, 2.0**10])
def test_a_rest_on_a_rooted_surface_has_as_many_arcs_in_any_unit_of_time(unit):
    """A second is long for one chain, and short for another."""
    cushion = CompliantSurface((0.0, 1.32), (0.0, -1.0), "hertz", 1e4 / unit**2)
    friction = JointFriction((30.0 / unit**2, 20.0 / unit**2))
    scene = Scene(
        chain=Chain.uniform_bars(),
        q=(0.5, 1.0),
        u=(0.0, 0.0),
        duration=100.0 * unit,
        effects=(Gravity(9.81 / unit**2), friction, cushion),
    )
    run = hybrid_run(scene, [0.0, scene.duration])
    assert run.steps < 1000
    assert len(run.arcs) == 6
