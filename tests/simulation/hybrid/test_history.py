"""The loop of flow and jump: its progress, its limits of work, and its errors."""

import math

import pytest

from tests.simulation.hybrid import BALANCED, BARS
from tests.simulation.hybrid.test_run import BOUNCES, ONTO, STOP, scene
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.errors import IntegrationError, SimulationError
from twolink.scene import Scene
from twolink.simulation.hybrid import history as history_module
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.simulate import simulate


def test_progress_is_reported():
    heard = []
    hybrid_run(
        Scene(BARS, (0.3, 0.2), (0.0, 0.0), 5.0, (Gravity(), JointFriction((1e-3, 1e-3)))),
        [0.0, 5.0], progress=heard.append, longest_step=0.01,
    )  # fmt: skip
    assert heard == sorted(heard)
    assert 0 < heard[0] <= heard[-1] <= 1


def test_short_arcs_are_reported_together():
    """Bounces of a step or two each: a report of each takes as long as the bounce."""
    heard = []
    scene = Scene(BALANCED, (1.0, 0.0), (0.0, 0.0), 10.0, (ONTO, STOP))
    run = hybrid_run(scene, [0.0, 10.0], progress=heard.append)
    assert len(run.arcs) > 20
    assert heard == sorted(heard)
    assert len(heard) < len(run.arcs) / 2
    assert heard[-1] == 1


def test_modes_that_follow_each_other_without_time_are_an_error(monkeypatch):
    """A jump that leads nowhere: the contact is hit again and again at one instant."""
    from twolink.simulation.hybrid.jump import Jump

    def nowhere(system, state, mode, trigger, recent=()):
        return Jump(state, mode)

    monkeypatch.setattr(history_module, "jump", nowhere)
    with pytest.raises(IntegrationError, match="modes follow each other without end at 1 s"):
        hybrid_run(BOUNCES, [0.0, 4.0])


@pytest.mark.slow
def test_a_folded_chain_that_turns_about_its_end_ends_with_this_cause():
    """The friction of an end force at A and that of joint B share a torque in no single way."""
    effects = Gravity(), EndForce(-1.0, 0.5), JointFriction((0.0, 5.0))
    folded = scene(*effects, chain=BARS, q=(0.3, 0.3 + math.pi), u=(1.0, 1.0), duration=1.0)
    run = hybrid_run(folded, [0.0, 1.0], precision="long double", partial=True)
    assert "the folded links can turn together about A" in run.failure
    assert "(D) beside the torque of joint B" in run.failure


def test_a_run_whose_modes_change_too_often_is_an_error(monkeypatch):
    """A pendulum with friction has a mode for each half swing: four take about 3 s of 1000 s."""
    swinging = scene(
        Gravity(9.81), JointFriction((0.02, 0.02)), chain=BARS, q=(1.0, 1.2), duration=1000.0
    )
    monkeypatch.setattr(tolerances, "MANY_JUMPS", 4)
    words = r"4 modes by .* s, and is not followed further, as about 2.9e\+03 more modes would"
    with pytest.raises(IntegrationError, match=words):
        hybrid_run(swinging, [0.0, 1000.0])
    # Enough modes for the time that is left are followed.
    assert not hybrid_run(scene(ONTO, STOP, q=(1.0, 0.0), duration=4.0), [0.0, 4.0]).failure


@pytest.mark.parametrize("start", [0.0, 0.5])
def test_a_motion_ends_before_an_impact_at_its_end_and_begins_with_one_at_its_start(start):
    """Link 1 turns to its stop with −1 rad/s, and arrives at the end of the first motion."""
    turning = Scene(BALANCED, (start, 0.0), (-1.0, 0.0), 0.5, (STOP,))
    run = simulate(turning)
    ends = run.at(0.5)[1][0, 0], run.at(0.5, side="left")[1][0, 0]
    assert len(run.impacts) == (start == 0)
    assert ends == ((-1.0, -1.0) if start else (0.5, 0.5))


def test_friction_twice_is_refused():
    frictions = JointFriction((1.0, 0.0)), JointFriction((2.0, 0.0))
    with pytest.raises(SimulationError, match="dry friction twice"):
        hybrid_run(scene(*frictions), [0.0, 1.0])
