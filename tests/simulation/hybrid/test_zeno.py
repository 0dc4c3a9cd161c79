"""Bounces that are left out since they all end within rounding."""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import (
    BALANCED,
    BARS,
    STOP,
    hitting,
    mode_of,
    state_of,
    stopped_chain,
    system_of,
)
from twolink.chain import Chain
from twolink.contact.impact_laws import Regime
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.errors import IntegrationError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.dynamics import mode_solution
from twolink.simulation.hybrid.effort import Effort
from twolink.simulation.hybrid.impact import speed_along
from twolink.simulation.hybrid.jump import jump
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.hybrid.tolerances import zeno_time
from twolink.simulation.hybrid.zeno import Past, _flight, _ratio, accumulated


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
    assert after.strikes[-1].impulse.regime == Regime.BOUNCES_DIE_AWAY
    assert after.delay == pytest.approx(2 * (-arrives / 2) / (2.0 * 0.5), rel=1e-6)


@pytest.mark.parametrize("precision", ["long double", "quadruple"])
def test_a_speed_below_the_least_float_ends_at_rest(precision):
    system = stopped_chain(precision=precision)
    arrives = -system.number("1e-400")
    after = jump(system, hitting(system, arrives), mode_of(system, S.OPEN), Trigger(E.HITS, 0))
    assert after.mode.states == (S.CLOSED,)
    assert after.state.u[0] == 0


def test_the_time_at_which_bounces_would_end_is_a_float_in_every_precision():
    """Also where the last impact had no approach speed, as one without a collision."""
    system = stopped_chain(precision="quadruple")
    state = hitting(system, system.number(-1e-12))
    (strike,) = jump(system, state, mode_of(system, S.OPEN), Trigger(E.HITS, 0)).strikes
    for speeds, ratio in (((-2.0, 1.0), 0.5), ((0.0, 1.0), 0.5)):
        pair = tuple(map(system.number, speeds))
        found = _ratio(system, [strike._replace(speeds=pair)], 0)
        assert found == ratio
        assert type(found) is float


def test_bounces_without_a_force_towards_the_contact_continue():
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


@pytest.mark.parametrize(
    ("tired", "remaining", "rests"),
    [
        (frozenset({0}), 1.0, True),
        (frozenset(), 1.0, False),
        # Fewer than MOST_JUMPS bounces would follow.
        (frozenset({0}), 1e-8, False),
    ],
)
def test_bounces_without_loss_are_left_out_with_a_note_where_too_many_would_follow(
    tired, remaining, rests
):
    """From v = 1e-12 rad/s under 2 rad/s² a bounce takes 1e-12 s."""
    system = stopped_chain(restitution=1.0)
    past = Past((), {}, tired, remaining)
    state = hitting(system, -1e-12)
    after = jump(system, state, mode_of(system, S.OPEN), Trigger(E.HITS, 0), past)
    assert after.mode.states == ((S.CLOSED,) if rests else (S.OPEN,))
    if rests:
        (doubt,) = after.doubts
        assert doubt.speed == pytest.approx(1e-12, rel=1e-3)
        assert "are left out: they follow each other every 1.0e-12 s" in after.notes[0].sentence
    else:
        assert not after.notes
        assert not after.doubts


def test_damped_bounces_that_never_end_are_followed_and_then_left_out():
    """B falls on a lossless stop; damping alone takes energy: bounces become ever smaller."""
    scene = Scene(
        BALANCED,
        (0.0, 1.0),
        (0.0, 0.0),
        12.0,
        (
            JointTorque((0.0, -20.0)),
            JointDamping((20.0, 20.0)),
            JointStop("B", lower=0.0, restitution=1.0),
        ),
    )
    few = hybrid_run(scene, [0.0, 12.0], effort=Effort(patience=100))
    more = hybrid_run(scene, [0.0, 12.0], effort=Effort(patience=300))
    assert few.exhausted
    assert few.reached == 12.0
    assert any("are left out" in note for note in few.notes)
    assert 0 < more.doubts[0].speed < few.doubts[0].speed


@pytest.mark.slow
def test_the_error_is_unknown_after_bounces_that_are_left_out():
    """Link 1 stands on its stop, upright, and is let go: it falls by its next bounce."""
    chain = Chain((1.0, 0.5), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (0.25, 0.1))
    effects = (
        Gravity(9.81, (-1.0, 0.0)),
        SampledTorque((0.0, 1.5), (-1.0, 0.0), (0.0, 0.0), "hold"),
        JointStop("A", lower=0.0, restitution=1.0),
    )
    found = simulate(Scene(chain, (0.0, 0.0), (2e-4, 0.0), 10.0, effects, 1e-3))
    assert not found.met
    assert found.error == math.inf
    assert "the bounces on A on its lower stop that are left out at" in found.notes[0]


@pytest.mark.parametrize(("impacts", "rests"), [(3, False), (4, True)])
def test_contacts_of_a_burst_rest_where_the_laws_admit_no_motion(impacts, rests):
    """Both joints have struck their stops within the Zeno time."""
    stop = JointStop("B", lower=-2.0, restitution=0.5)
    system = system_of(STOP, stop, chain=BALANCED)
    state = hitting(system, 1e-15)
    struck = jump(system, hitting(system, -1e-12), mode_of(system, S.OPEN, S.OPEN), None).strikes[0]
    strikes = [struck._replace(number=number % 2) for number in range(impacts)]
    found = accumulated(system, state, system.pose(state.q), Past(), strikes)
    assert (found is not None) == rests
    if found is not None:
        assert found.state.u == (0, 0)
        assert found.state.touching == {0, 1}
        assert {strike.impulse.regime for strike in found.strikes} == {Regime.BOUNCES_DIE_AWAY}
    early = [strike._replace(time=1.9) for strike in strikes]
    assert accumulated(system, state, system.pose(state.q), Past(), early) is None


def test_a_burst_that_gains_energy_is_an_error():
    stop = JointStop("B", lower=-2.0, restitution=0.5)
    system = system_of(STOP, stop, chain=BALANCED)
    struck = jump(system, hitting(system, -1e-12), mode_of(system, S.OPEN, S.OPEN), None).strikes[0]
    strikes = [struck._replace(number=number % 2) for number in range(5)]
    fast = hitting(system, 1e-6)
    words = r"the last 5 impacts, on .*, are beyond the range of their laws \(stronge\)"
    with pytest.raises(IntegrationError, match=words):
        accumulated(system, fast, system.pose(fast.q), Past(), strikes)


@pytest.mark.parametrize("friction", [0.3, 0.0])
@pytest.mark.parametrize("elbow", [1.0, 1e-6, 1e-9])
def test_a_bounce_lands_at_the_speeds_of_its_point(elbow, friction):
    """Near the folded pose the turning of the chain changes them as much as its accelerations do.

    The point moves on from the end of the flight as the kinematics say, in quadruple precision.
    """
    normal = (-math.sin(0.3), -math.cos(0.3))
    system = system_of(
        Gravity(), Surface((0.0, 0.0), normal, friction=friction), chain=BARS,
        precision="quadruple",
    )  # fmt: skip
    contact = system.elements[0]
    q = (0.2, 0.2 + math.pi + elbow)
    state = state_of(system, q, (3.0, 3.0))
    pose = system.pose(state.q)
    (x, y), rest = pose.row(contact.normal), speed_along(pose.row(contact.normal), state.u)
    change = (1e-9 - rest) / (x * x + y * y)
    u = state.u[0] + change * x, state.u[1] + change * y
    state = state._replace(u=u, gaps=(system.number(0),))
    flight = _flight(system, state, pose, mode_of(system, S.OPEN), 0)
    if flight.time == math.inf:
        pytest.fail("the point does not return")
    dents, t = [None], system.number(flight.time)
    du = mode_solution(pose, system.effects, system.elements, (S.OPEN,), dents, u, state.t, {}).du
    later = tuple(a + t * b + t * t * c / 2 for a, b, c in zip(state.q, u, du, strict=True))
    ends = tuple(b + t * c for b, c in zip(u, du, strict=True))
    assert float(contact.normal.speed(system.chain, later, ends)) == pytest.approx(
        -flight.lands, rel=1e-5
    )
    assert float(speed_along((x, y), flight.landing)) == pytest.approx(-flight.lands, rel=1e-9)
    if contact.tangent is not None:
        along = float(contact.tangent.speed(system.chain, later, ends))
        row = pose.row(contact.tangent)
        assert float(speed_along(row, flight.landing)) == pytest.approx(along, rel=1e-5)


@pytest.mark.parametrize("on", [("B", "D"), ("B", "C2")])
@pytest.mark.parametrize("q", [(-0.3, 0.4), (-0.6, -0.3), (-0.2, 3.3), (-0.3, -0.1)])
def test_points_of_a_link_that_land_without_rebound_lift_each_other_ever_less(q, on):
    """A point that stops opens the other contact: impacts without bounces accumulate as well.

    The motion is the limit of those with a small rebound.
    """
    chain = Chain((1.0, 2.0), (1.0, 1.0), ((0.5, 0.0), (0.9, 0.0)), (0.1, 0.3))

    def landing(restitution):
        floor = Surface((0.0, 0.2), (0.0, -1.0), on, restitution=restitution, name="floor")
        return simulate(Scene(chain, q, (0.0, 0.0), 1.5, (Gravity(9.81), floor)))

    found, bouncing = landing(0.0), landing(1e-6)
    assert found.met
    assert len(found.impacts) > 60
    assert found.events[-1].description == f"B on floor rests, {on[1]} on floor rests"
    assert abs(found.u[:, -1]).max() < 1e-12
    assert found.q[:, -1] == pytest.approx(bouncing.q[:, -1], abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(("play", "speed"), [(1e-12, 1.0), (1e-13, 100.0)])
def test_impacts_without_loss_between_two_stops_are_not_left_out_without_a_word(play, speed):
    """No load acts, and no energy is lost: the joint turns back and forth for ever."""
    free = Chain((0.5, 0.5), (1.0, 1.0), ((1.0, 0.0), (0.0, 0.0)), (0.0, 1.0))
    stop = JointStop("A", lower=-play / 2, upper=play / 2, restitution=1.0)
    found = simulate(Scene(free, (0.0, 0.0), (speed, 0.0), 1.0, (stop,)), samples=11)
    assert not found.met
    assert np.abs(np.abs(found.u[0]) - speed).max() <= found.error
    assert any("follow each other in" in note and "do not die away" in note for note in found.notes)


def test_a_burst_dies_away_if_it_loses_energy_and_its_impacts_do_not_become_rarer():
    """Sixty impacts at speeds and times like those of two contacts that answer each other."""
    stop = JointStop("B", lower=-2.0, restitution=0.5)
    system = system_of(STOP, stop, chain=BALANCED)
    state = hitting(system, 1e-3)
    struck = jump(system, hitting(system, -1e-12), mode_of(system, S.OPEN, S.OPEN), None).strikes[0]

    def rests(speeds, times):
        crowd = [
            struck._replace(number=k % 2, time=2.0 + t, u=((-v, -v), (v, v)))
            for k, (v, t) in enumerate(zip(speeds, times, strict=True))
        ]
        last = hitting(system, 1e-6)
        last = last._replace(t=crowd[-1].time)
        return accumulated(system, last, system.pose(state.q), Past(), crowd)

    k = np.arange(60)
    dying, closer, rarer = 0.9**k, 1e-10 * (1 - 0.9**k), 1e-12 * 1.1**k
    assert rests(dying, closer).doubts == ()
    (rare,) = rests(dying, rarer).doubts
    (lossless,) = rests(np.ones(60), 1e-12 * k).doubts
    assert rare.change == lossless.change == pytest.approx(2e-6)
    (note,) = rests(np.ones(60), 1e-12 * k).notes
    assert "with 1.0e-06 rad/s of the chain: 60 of them" in note.sentence
