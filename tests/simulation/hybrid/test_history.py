"""The loop of flow and jump: its progress, its limits of work, and its errors."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, BARS
from tests.simulation.hybrid.test_run import BOUNCES, ONTO, STOP, scene
from twolink.contact.states import ContactState as S
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.errors import IntegrationError, SimulationError
from twolink.integration.precisions import PRECISIONS
from twolink.scene import Scene
from twolink.simulation.hybrid import history as history_module
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.history import Effort
from twolink.simulation.hybrid.run import hybrid_run


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


@pytest.mark.parametrize("effort", [Effort(jumps=3), Effort(steps=30)])
def test_a_run_ends_where_it_exceeds_its_effort(effort):
    with pytest.raises(IntegrationError, match=r"modes by .* s, and is not followed further"):
        hybrid_run(BOUNCES, [0.0, 4.0], effort=effort)
    run = hybrid_run(BOUNCES, [0.0, 4.0], effort=effort, partial=True)
    assert run.exhausted
    assert 0 < run.reached <= 3
    assert "is not followed further: moves freely" in run.failure


def test_a_run_ends_early_that_would_exceed_its_steps_at_its_pace():
    lossless = scene(ONTO, JointStop("A", lower=0.0, restitution=1.0), q=(1.0, 0.0), duration=100.0)
    whole = hybrid_run(lossless, [0.0, 100.0])
    enough = hybrid_run(lossless, [0.0, 100.0], effort=Effort(steps=whole.steps))
    assert enough.steps == whole.steps
    few = hybrid_run(lossless, [0.0, 100.0], effort=Effort(steps=whole.steps // 3), partial=True)
    assert few.exhausted
    assert few.steps < whole.steps // 4


def test_the_code_of_a_mode_is_optimised_that_will_take_enough_steps(monkeypatch):
    taken = []

    def spied(*arguments):
        taken.append(arguments[-1])
        return flow(*arguments)

    flow = history_module.flow
    double = replace(PRECISIONS["double"], steps_worth_optimising=40)
    monkeypatch.setattr(history_module, "PRECISIONS", {**PRECISIONS, "double": double})
    monkeypatch.setattr(history_module, "flow", spied)
    stop = JointStop("A", lower=0.0, restitution=1.0)
    run = hybrid_run(scene(ONTO, stop, q=(1.0, 0.0), duration=100.0), [0.0, 100.0])
    counts = np.cumsum([0, *(arc.step_count for arc in run.arcs[:-1])])
    begins = np.array([float(arc.start.t) for arc in run.arcs])
    alike = {arc.mode.states for arc in run.arcs} == {(S.OPEN,)}
    assert alike
    soon = (counts > 0.3 * 40) & (counts * 100.0 > 2 * 40 * begins)
    assert taken == list((counts > 40) | soon)
    assert sum(taken) > sum(counts > 40)


def test_only_short_steps_are_limited_by_their_number():
    """A ball of 1e12 N/m^1.5 is pressed for a few microseconds at a time."""
    ball = CompliantSurface((0.0, 1.3), (0.0, -1.0), "hertz", 1e12, on=("D",))
    scene = Scene(BARS, (0.4, 0.7), (0.3, 0.2), 1.5, (Gravity(), ball))
    times, effort = [0.0, 1.5], Effort(short_steps=20)
    pressed = hybrid_run(scene, times, effort=effort, partial=True)
    assert pressed.exhausted
    assert "is not followed further" in pressed.failure
    assert hybrid_run(scene, times, partial=True).reached > pressed.reached
    free = Scene(BARS, (0.4, 0.7), (0.3, 0.2), 100.0, (Gravity(), JointStop("A", lower=-1e9)))
    run = hybrid_run(free, [0.0, 100.0], effort=effort)
    assert run.steps > 100
    assert not run.exhausted


def test_a_run_whose_modes_change_too_often_is_an_error(monkeypatch):
    """A pendulum with friction has a mode for each half swing: four take about 3 s of 1000 s."""
    swinging = scene(
        Gravity(9.81), JointFriction((0.02, 0.02)), chain=BARS, q=(1.0, 1.2), duration=1000.0
    )
    monkeypatch.setattr(tolerances, "MANY_JUMPS", 4)
    with pytest.raises(IntegrationError, match=r"4 modes by .* s, and is not followed further"):
        hybrid_run(swinging, [0.0, 1000.0])
    # Enough modes for the time that is left are followed.
    assert not hybrid_run(scene(ONTO, STOP, q=(1.0, 0.0), duration=4.0), [0.0, 4.0]).failure


def test_friction_twice_is_refused():
    frictions = JointFriction((1.0, 0.0)), JointFriction((2.0, 0.0))
    with pytest.raises(SimulationError, match="dry friction twice"):
        hybrid_run(scene(*frictions), [0.0, 1.0])
