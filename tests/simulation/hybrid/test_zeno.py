"""Bounces that are left out since they all end within rounding."""

import pytest

from tests.simulation.hybrid import BALANCED, STOP, hitting, mode_of, stopped_chain, system_of
from twolink.contact.impact_laws import Regime
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.errors import IntegrationError
from twolink.scene import Scene
from twolink.simulation.hybrid.jump import jump
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.run import Effort, hybrid_run
from twolink.simulation.hybrid.tolerances import zeno_time
from twolink.simulation.hybrid.zeno import Past, accumulated


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


def test_damped_bounces_that_never_end_are_followed_and_then_left_out_within_the_reported_error():
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
    with pytest.raises(IntegrationError, match="Newton's law of restitution with friction gives"):
        accumulated(system, fast, system.pose(fast.q), Past(), strikes)
