"""Steps of arcs that passed a change of the loads."""

import math

import numpy as np
import pytest

from tests.campaign.draw import draw_scene
from tests.simulation.hybrid import BARS
from tests.simulation.smooth.pulses import Detent, Kink, Pulse
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid import history
from twolink.simulation.hybrid.effort import Effort
from twolink.simulation.hybrid.run import hybrid_run
from twolink.simulation.hybrid.unseen import passed_change

CONTACTS = {
    "far away": Surface((0.0, 50.0), (0.0, -1.0)),
    "floor": Surface((0.0, 1.2), (0.0, -1.0), restitution=0.5, friction=0.2),
    "ball": CompliantSurface((0.0, 1.2), (0.0, -1.0), "hertz", 1e4, friction=0.3),
    "joints": JointFriction((0.2, 0.1), (0.3, 0.1)),
}


STOP = JointStop("A", lower=-3.0)


def narrow(contact, size=200.0, width=3e-3):
    """Return a scene whose link 1 passes a narrow pulse of torque at 1.7 rad."""
    effects = (Gravity(), Detent(size, 1.7, width), contact)
    return Scene(BARS, (0.3, -0.4), (1.0, 2.0), 1.0, effects)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("precision", "order"),
    [("double", 15), ("long double", 21)],
)
def test_the_steps_of_all_effects_have_the_residuals_of_their_series(monkeypatch, precision, order):
    """Also those on pressed surfaces, whose variable is not time."""
    found = []

    def add(self, arc, delay):
        found.append((arc.compiled.clock, passed_change(self.system, arc)))
        return own(self, arc, delay)

    own = history.History._add
    monkeypatch.setattr(history.History, "_add", add)
    for index in range(24):
        scene = draw_scene(555, index)
        effort = Effort(work=2000, jumps=50)
        hybrid_run(
            scene, [0.0, scene.duration], precision=precision, order=order, partial=True,
            effort=effort,
        )  # fmt: skip
    assert len(found) > 150
    assert sum(clock is not None for clock, _ in found) > 2
    assert {passed for _, passed in found} == {None}


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", CONTACTS)
def test_a_pulse_in_an_angle_is_seen_beside_contact_and_friction(name):
    scene = narrow(CONTACTS[name])
    found = simulate(scene, samples=21)
    assert found.met
    fine = np.linspace(0.0, 1.0, 21)
    exact = hybrid_run(
        scene, fine, formulation="kane", precision="long double", order=23, longest_step=1e-3
    )
    off = np.abs(found.q - np.asarray(exact.q, float)).max()
    assert off <= found.error


@pytest.mark.slow
@pytest.mark.parametrize("centre", [0.55, 0.6, 0.7])
def test_a_pulse_is_seen_while_a_soft_surface_is_pressed(centre):
    """There the variable of the steps is not time, and they are made shorter too."""
    soft = CompliantSurface((0.0, 1.2), (0.0, -1.0), "hertz", 200.0, friction=0.3)
    effects = (Gravity(), Detent(500.0, centre, 1e-3), soft)
    scene = Scene(BARS, (0.3, 0.9), (0.5, 0.5), 0.5, effects)
    passed = hybrid_run(scene, [0.0, 0.5], order=21).unseen
    assert passed is not None
    found = simulate(scene, samples=11)
    assert found.met
    exact = hybrid_run(
        scene, found.t, formulation="kane", precision="long double", order=23, longest_step=2e-4
    )
    assert np.abs(found.q - np.asarray(exact.q, float)).max() <= found.error


def test_a_step_that_passes_a_pulse_is_noted_with_its_length():
    run = hybrid_run(narrow(CONTACTS["far away"]), [0.0, 1.0], order=15)
    assert run.unseen is not None
    starts = np.array(run.polynomials.starts)
    (place,) = np.flatnonzero(starts == run.unseen.time)
    assert run.unseen.length == pytest.approx(starts[place + 1] - starts[place], rel=1e-12)
    shorter = hybrid_run(
        narrow(CONTACTS["far away"]), [0.0, 1.0], order=15, longest_step=run.unseen.length / 64
    )
    assert shorter.unseen is None


@pytest.mark.slow
def test_loads_that_no_steps_see_leave_an_unknown_error():
    found = simulate(narrow(CONTACTS["far away"], 5000.0, 1e-4), samples=21)
    assert not found.met
    assert found.error == math.inf
    assert any("pass a change of the loads; an effect that" in note for note in found.notes)


def test_built_in_effects_are_not_looked_at():
    run = hybrid_run(Scene(BARS, (0.3, -0.4), (1.0, 2.0), 1.0, (Gravity(), STOP)), [0.0, 1.0])
    assert run.unseen is None


@pytest.mark.slow
def test_the_error_of_a_motion_over_a_kink_is_a_bound_or_unknown():
    scene = Scene(BARS, (0.0, 0.5), (0.0, 0.0), 1.0, (Gravity(), Kink(30.0, 1.0, 1e-7), STOP))
    found = simulate(scene, samples=11, accuracy=1e-6)
    exact = hybrid_run(scene, found.t, order=21, longest_step=2e-5)
    assert np.abs(found.q - exact.q).max() <= found.error


def test_roundings_of_two_large_angles_do_not_cancel_in_their_difference():
    """The error was unknown: equal roundings of both angles changed no load."""
    effects = (Pulse(0.0, 0.0, 1.0), JointFriction((0.5, 0.5)))
    scene = Scene(BARS, (515.2, 514.9), (2e4, 4e3), 2e-3, effects)
    assert simulate(scene, accuracy=1e-3, samples=2).met
