"""Whole runs against motions in closed form: bounces, slides, breaks, and reports."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, BARS
from twolink import lagrange
from twolink.chain import Chain
from twolink.contact.impact_laws import Regime
from twolink.contact.states import ContactState as S
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.errors import IntegrationError
from twolink.scene import Scene
from twolink.simulation.hybrid import history as history_module
from twolink.simulation.hybrid.effort import Effort
from twolink.simulation.hybrid.run import hybrid_run

STOP = JointStop("A", lower=0.0, restitution=0.5)
ONTO = JointTorque((-6.0, 0.0))


def scene(*effects, chain=BALANCED, q=(0.0, 0.0), u=(0.0, 0.0), duration=1.0):
    return Scene(chain, q, u, duration, effects)


BOUNCES = scene(ONTO, STOP, q=(1.0, 0.0), duration=4.0)
"""From 1 rad with −2 rad/s²: at the stop after 1 s at −2 rad/s, and then bounces of 1 s, 1/2 s …"""


@pytest.fixture(scope="module")
def bounces():
    return hybrid_run(BOUNCES, np.linspace(0, 4, 401))


def test_bounces_come_at_their_instants_and_with_their_speeds(bounces):
    """Flights of 2 v/a with v = 1, 1/2, 1/4 …"""
    first = bounces.impacts[:20]
    assert [i.time for i in first] == pytest.approx(
        [1 + sum(0.5**j for j in range(k)) for k in range(20)], rel=1e-14
    )
    assert [i.speeds[0] for i in first] == pytest.approx([-2 * 0.5**k for k in range(20)])


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_an_impact_at_the_start_has_the_given_speeds_before_it(precision):
    struck = scene(ONTO, STOP, u=(-1.0, 0.25))
    run = hybrid_run(struck, np.array([0.0, 0.1]), precision=precision)
    before, after = (run.dense()([0.0, 0.05], side) for side in ("left", "right"))
    assert [run.impacts[0].time, float(run.u[0, 0])] == [0.0, 0.5]
    assert before[1][:, 0].astype(float).tolist() == [-1.0, 0.25]
    assert after[1][:, 0].astype(float).tolist() == [0.5, 0.25]
    assert np.array_equal(before[0], after[0])
    assert np.array_equal(before[1][:, 1], after[1][:, 1])


def test_bounces_end_at_the_sum_of_their_flights(bounces):
    """At 1 + 1 + 1/2 + 1/4 + … = 3 s, and then the joint rests exactly."""
    assert bounces.impacts[-1].regime == Regime.BOUNCES_DIE_AWAY
    assert [e.mode.states for e in bounces.events] == [(S.OPEN,), (S.CLOSED,)]
    assert bounces.events[-1].time == pytest.approx(3.0, rel=1e-14)
    assert bounces.events[-1].entered <= bounces.events[-1].time
    resting = np.linspace(0, 4, 401) > 3
    assert np.all(bounces.q[0, resting] == 0)
    assert np.all(bounces.u[0, resting] == 0)


def test_events_after_bounces_that_die_away_are_in_order():
    """The slide after them ends before the sum of their flights, at which it would begin."""
    chain = Chain((1.38, 1.03), (0.75, 0.72), ((0.66, 0.0), (0.56, 0.0)), (0.093, 0.048))
    floor = Surface((0.0, 0.07), (0.0, -1.0), on=("C2",), restitution=0.9, friction=0.9)
    damped = Scene(chain, (-0.2, 0.0), (1.8, 2.4), 3.0,
                   (Gravity(), floor, JointDamping((0.0, 0.27))))  # fmt: skip
    run = hybrid_run(damped, np.linspace(0.0, 3.0, 5))
    assert [event.mode.states[0] for event in run.events] == [S.OPEN, S.BACKWARD, S.STICKS]
    times = [event.time for event in run.events]
    assert times == sorted(times)
    slide, stick = run.events[1:]
    assert slide.entered < slide.time <= stick.entered == stick.time


def test_an_event_is_not_after_the_end_of_its_run(bounces):
    """The end of the bounces is known before it."""
    last = bounces.events[-1]
    until = (last.entered + last.time) / 2
    cut = hybrid_run(replace(BOUNCES, duration=until), np.linspace(0.0, until, 5))
    assert all(event.time <= until for event in cut.events)


def test_bounces_that_are_left_out_give_their_impulse(bounces):
    """3 kg m² rebounds at v, v/2, v/4 …: 3 (v + v/2) (1 + 1/2 + …) = 9 v, of which −3 v at once."""
    ended, event = bounces.impacts[-1], bounces.events[-1]
    rebound = bounces.impacts[-2].speeds[1]
    assert ended.speeds == (rebound, 0.0)
    assert ended.normal_impulse == pytest.approx(-3 * rebound, rel=1e-12)
    at_rest = 6.0 * (event.time - event.entered)
    assert ended.normal_impulse + at_rest == pytest.approx(9 * rebound, rel=1e-6)


def test_between_bounces_the_motion_is_its_parabola(bounces):
    times = np.linspace(0, 4, 401)
    first, second = times < 1, (times > 1) & (times < 2)
    assert bounces.q[0, first] == pytest.approx(1 - times[first] ** 2, abs=1e-14)
    t = times[second] - 1
    assert bounces.q[0, second] == pytest.approx(t - t * t, abs=1e-14)


def test_on_either_side_of_an_impact_the_speeds_are_those_of_the_log(bounces):
    at = bounces.dense()
    for impact in bounces.impacts[:5]:
        assert at([impact.time], "left")[1][0, 0] == pytest.approx(impact.speeds[0], rel=1e-12)
        assert at([impact.time])[1][0, 0] == pytest.approx(impact.speeds[1], rel=1e-12)
        before, after = impact.kinetic_energy
        assert after == pytest.approx(before / 4, rel=1e-12)


def test_a_run_has_its_steps_times_and_log(bounces):
    assert bounces.steps == len(bounces.polynomials.starts) - 1
    assert bounces.reached == 4.0
    assert bounces.failure == ""
    assert bounces.notes == ()
    assert bounces.doubts == ()
    assert bounces.log is bounces.impacts
    assert bounces.compile_seconds >= 0
    assert bounces.run_seconds > 0


@pytest.mark.parametrize("formulation", ["kane", "lagrange"])
@pytest.mark.parametrize("precision", ["double", "long double"])
def test_a_joint_slides_to_rest_and_stays(formulation, precision):
    """3 du/dt = −1.5 from 2 rad/s: 4 s and 4 rad."""
    run = hybrid_run(
        scene(JointFriction((1.5, 0.0)), u=(2.0, 0.0), duration=5.0), [0.0, 2.0, 5.0],
        formulation=formulation, precision=precision,
    )  # fmt: skip
    assert [e.mode.states for e in run.events] == [(S.FORWARD,), (S.STICKS,)]
    assert run.events[1].time == pytest.approx(4.0, rel=1e-15)
    assert [float(x) for x in run.q[0]] == pytest.approx([0, 3, 4], abs=1e-14)
    assert run.u[0, 2] == 0
    assert run.formulation == formulation


def test_jumps_of_a_torque_are_met_at_their_instants():
    """3 N m on 3 kg m² for the first second, and then −3 N m."""
    torque = SampledTorque((0.0, 1.0, 2.0, 3.0), (3.0, -3.0, -3.0, -3.0), (0.0,) * 4, "hold")
    stop = JointStop("A", lower=-100.0)
    run = hybrid_run(scene(torque, stop, duration=2.0), [0.0, 1.0, 2.0])
    assert run.q[0] == pytest.approx([0.0, 0.5, 1.0], abs=1e-14)
    assert run.u[0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-14)
    assert 1.0 in run.polynomials.starts


def test_a_mode_that_continues_after_an_impact_is_one_event(bounces):
    """The chain is free from the start to its rest, whatever bounces lie between."""
    assert len(bounces.arcs) > 20
    assert len(bounces.events) == 2
    assert bounces.events[0].description == "moves freely"


def test_energy_is_kept_by_elastic_bounces_of_both_bars():
    """Two bars on an elastic floor with two points: T + V from the start to the end."""
    floor = Surface((0.0, 1.2), (0.0, -1.0), on=("B", "D"), restitution=1.0)
    gravity = Gravity(9.81)
    run = hybrid_run(
        Scene(BARS, (0.3, 0.2), (0.0, 0.0), 2.0, (gravity, floor)), np.linspace(0, 2, 101)
    )
    assert len(run.impacts) >= 3
    energy = lagrange.kinetic_energy(BARS, run.q, run.u) + gravity.potential_energy(BARS, run.q)
    assert np.ptp(energy) < 1e-11 * 30
    assert np.sin(run.q).sum(axis=0).max() <= 1.2 + 1e-12


def test_a_left_surface_springs_back_and_is_met_where_it_is():
    """A damped cushion: no force pulls, and it is sunk in no longer than its decay."""
    cushion = CompliantSurface((0.0, 1.0), (0.0, -1.0), "kelvin-voigt", 2000.0, 20.0)
    run = hybrid_run(
        Scene(BARS, (0.45, 0.5), (0.5, 0.4), 1.5, (Gravity(9.81), cushion)), [0.0, 1.5]
    )
    left = [arc for arc in run.arcs if arc.start.compliant[0].residual_depth > 0]
    assert left
    assert S.CLOSED in {arc.mode.states[0] for arc in run.arcs}
    for arc in left:
        assert arc.mode.states == (S.OPEN,)
        start, end = (float(s.compliant[0].residual_depth) for s in (arc.start, arc.end))
        decay = math.exp(-100 * float(arc.end.t - arc.start.t))
        assert end == pytest.approx(start * decay, rel=1e-9, abs=1e-18)


def test_a_run_that_cannot_continue_is_an_error_or_a_partial_run(monkeypatch):
    """The fourth jump fails, at 2.75 s: the run ends there."""
    made = iter([None, None, None])

    def failing(*args, _jump=history_module.jump, **options):
        if next(made, "none left") == "none left":
            raise IntegrationError("the third jump is the last")
        return _jump(*args, **options)

    times = np.linspace(0, 4, 41)
    monkeypatch.setattr(history_module, "jump", failing)
    with pytest.raises(IntegrationError, match="third jump"):
        hybrid_run(BOUNCES, times)
    made = iter([None, None, None])
    run = hybrid_run(BOUNCES, times, partial=True)
    assert run.failure == "the third jump is the last"
    assert run.reached == pytest.approx(2.75)
    asked = times[times <= run.reached]
    assert run.q.shape == (2, len(asked))
    assert run.q[0, asked < 1] == pytest.approx(1 - asked[asked < 1] ** 2)


def test_the_log_has_the_energies_of_the_strikes(bounces):
    """T = 3/2 u1² + 1/4 u2² of balanced links."""
    assert [impact.time for impact in bounces.log] == [s.time for s in bounces.strikes]
    first = bounces.log[0]
    assert first.kinetic_energy == pytest.approx((6.0, 1.5), rel=1e-14)
    assert bounces.log is bounces.impacts


def test_a_run_ends_at_its_limit_of_time():
    scene = Scene(BARS, (0.3, 0.2), (0.0, 0.0), 1.0, (JointFriction((0.1, 0.1)),))
    times = np.linspace(0, 1, 11)
    run, whole = (hybrid_run(scene, times, effort=Effort(until=t)) for t in (0.55, 2.0))
    assert (run.reached, run.failure) == (0.55, "")
    assert run.q.shape == (2, 6)
    assert whole.reached == 1.0


@pytest.mark.parametrize("end", [0.5, 1.7, 3.2])
def test_a_run_that_is_cut_is_one_that_ended_there(bounces, end):
    times = np.linspace(0, 4, 401)
    whole = hybrid_run(BOUNCES, times, effort=Effort(until=end))
    cut = bounces.until(times, end)
    assert cut.reached == whole.reached == end
    assert cut.q.shape == whole.q.shape
    assert np.abs(cut.q - whole.q).max() < 1e-14
    assert [arc.mode for arc in cut.arcs] == [arc.mode for arc in whole.arcs]
    assert cut.since == pytest.approx(whole.since, rel=1e-14)
    assert [s.time for s in cut.strikes] == pytest.approx([s.time for s in whole.strikes])
    ends = [np.concatenate(run.polynomials.at(end)) for run in (cut, whole)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-13, abs=1e-14)


def test_order_19_does_not_lose_digits_on_a_hertz_like_surface():
    """Its step would follow from coefficients that vanish: an error of 1.7e-11 in long double."""
    ball = CompliantSurface((0.0, 1.3), (0.0, -1.0), "hertz", 2.5e7, on=("D", "C2"))
    scene = Scene(BARS, (0.4, 0.7), (0.3, 0.2), 1.5, (Gravity(), ball))
    times = np.linspace(0, 1.5, 31)
    exact = hybrid_run(scene, times, precision="quadruple", order=31, formulation="kane")
    found = hybrid_run(scene, times, precision="long double", order=19)
    assert len(found.arcs) == len(exact.arcs) > 10
    for ours, truth in ((found.q, exact.q), (found.u, exact.u)):
        off = np.abs(np.array(ours, float) - np.array(truth, float)).max()
        assert off < 1e-14
