"""Laws of compliant contact against hand-computed forces, integrals and simple motions."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from twolink.contact.force_laws import (
    Branch,
    Hertz,
    HuntCrossley,
    KelvinVoigt,
    NoPull,
    Phase,
    PlasticState,
)

LAWS = [KelvinVoigt(2000.0, 30.0), Hertz(5e4), HuntCrossley(5e4, 0.3)]


def force(law, depth, rate=0.0):
    return law.force(depth, math.sqrt(depth), rate)


@pytest.mark.parametrize(
    ("law", "depth", "rate", "expected"),
    [
        (KelvinVoigt(2000.0, 30.0), 0.01, 0.5, 20.0 + 15.0),
        (KelvinVoigt(2000.0, 30.0), 0.01, -1.0, 20.0 - 30.0),
        (Hertz(5e4), 0.04, 7.0, 5e4 * 0.008),
        (HuntCrossley(5e4, 0.5), 0.04, 2.0, 5e4 * 0.008 * 2),
        (HuntCrossley(5e4, 0.5), 0.04, -2.0, 0.0),
    ],
)
def test_forces_are_those_computed_by_hand(law, depth, rate, expected):
    assert force(law, depth, rate) == pytest.approx(expected, rel=1e-14, abs=1e-12)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_the_stored_energy_is_the_work_of_a_slow_press(law):
    depth = 0.013
    work, _ = quad(lambda x: force(law, x), 0, depth, epsabs=1e-13, epsrel=1e-12)
    assert law.stored(depth, math.sqrt(depth)) == pytest.approx(work, rel=1e-9)


def test_the_laws_that_take_a_root_take_no_other_depth():
    """The power 3/2 has a power series in the root, and in the root only."""
    assert [law.uses_root for law in LAWS] == [False, True, True]
    for law in LAWS[1:]:
        assert law.force(math.nan, 0.1, 0.0) == pytest.approx(5e4 * 1e-3)


def test_a_released_damper_springs_back_without_any_force():
    """δ = exp(−k t/c): then k δ + c dδ/dt is zero."""
    law = KelvinVoigt(2000.0, 30.0)
    assert law.relaxation == pytest.approx(2000 / 30)
    for depth in (1.0, 1e-3):
        assert force(law, depth, -law.relaxation * depth) == pytest.approx(0, abs=1e-11)


@pytest.mark.parametrize("law", [KelvinVoigt(2000.0), Hertz(5e4), HuntCrossley(5e4, 0.3)])
def test_without_a_damper_a_surface_is_back_at_once(law):
    assert law.relaxation is None


def test_a_slow_impact_has_hunt_and_crossleys_restitution():
    """e = 1 − 2/3 a v, for a ball of 1 kg that comes in at v: their equation for slow impacts."""
    law, v = HuntCrossley(1e5, 0.02), 0.5

    def rates(t, state):
        depth, rate = state
        return [rate, -law.force(max(depth, 0), math.sqrt(max(depth, 0)), rate)]

    def out(t, state):
        return state[0]

    out.terminal, out.direction = True, -1
    run = solve_ivp(rates, (0, 1), [0, v], rtol=1e-10, atol=1e-13, events=out, max_step=1e-3)
    e = -run.y[1, -1] / v
    assert e == pytest.approx(1 - 2 / 3 * 0.02 * v, abs=2 * (0.02 * v) ** 2)


def test_half_a_swing_of_a_spring_takes_pi_times_its_period():
    """A ball of m on k leaves after π √(m/k) with the speed it came in at."""
    law = KelvinVoigt(400.0)
    t = np.linspace(0, math.pi / 20, 2001)
    depth = 0.1 * np.sin(20 * t)
    impulse = np.trapezoid([force(law, max(x, 0)) for x in depth], t)
    assert impulse == pytest.approx(2 * 0.1 * 20, rel=1e-6)


def test_one_phase_keeps_a_dent():
    kept = {phase for phase in Phase if PlasticState(phase).is_kept}
    assert kept == {Phase.DENTED}


def test_the_phases_of_older_files_are_read():
    """A dent had two phases, by the direction of the motion."""
    assert Phase("springs back") is Phase("is pressed again") is Phase.DENTED
    with pytest.raises(ValueError, match="sinks"):
        Phase("sinks")


def test_a_dent_is_rebuilt_with_other_numbers():
    dent = PlasticState(Phase.DENTED, 3.0, 0.1, 0.4)
    assert dent.numbers == (3.0, 0.1, 0.4)
    assert dent.with_numbers((7, 8, 9)) == PlasticState(Phase.DENTED, 7, 8, 9)
    whole = PlasticState(Phase.FLOWS)
    assert whole.numbers == ()
    assert whole.with_numbers(()) == whole


def test_a_branch_by_default_is_the_law_without_residual_and_end():
    branch = Branch(LAWS[0])
    assert (branch.residual, branch.reach, branch.turning) == (0.0, None, 0)


def test_hunt_and_crossleys_law_never_pulls():
    """With a = 0.5 s/m it would pull on a point that comes out faster than 2 m/s."""
    memory = NoPull(HuntCrossley(5e4, 0.5))
    pushes = memory.pressed(PlasticState(Phase.SLACK))
    branch = memory.branch(pushes)
    assert branch.law.force(0.04, 0.2, branch.rate) == 0
    assert branch.law.force(0.04, 0.2, branch.rate + 1e-9) > 0
    assert (branch.turning, branch.rate) == (1, -2.0)
    slack = memory.turned(pushes, 0.04)
    assert memory.branch(slack).law.force(0.04, 0.2, -3.0) == 0
    assert memory.branch(slack).law.stored(0.04, 0.2) == 0
    assert (memory.branch(slack).turning, memory.branch(slack).rate) == (-1, -2.0)
    assert memory.turned(slack, 0.04) == memory.reached(pushes) == pushes
    assert memory.jump(pushes) == math.inf
