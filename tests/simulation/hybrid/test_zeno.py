"""Bounces that are left out since they all end within rounding."""

import pytest

from tests.simulation.hybrid import BALANCED, STOP, hitting, mode_of, stopped_chain, system_of
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.simulation.hybrid.jump import jump
from twolink.simulation.hybrid.mode import BOUNCES_DIE_AWAY, Trigger
from twolink.simulation.hybrid.tolerances import zeno_time


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
