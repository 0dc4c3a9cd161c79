"""The work of the effects of a motion: energy balance, names, spacing of samples, memory."""

from dataclasses import replace

import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink.chain import Chain
from twolink.effects.end_drag import EndDrag
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.effects.surface import Surface
from twolink.errors import TooMuchError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.forces import ModeForces
from twolink.simulation.work import Work

SCENE = Scene(
    chain=GENERAL, q=(0.3, -0.4), u=(1.1, -0.7), duration=2.0, effects=(Gravity(),), accuracy=1e-11
)


def test_the_works_of_all_effects_are_the_change_of_kinetic_energy():
    effects = (
        Gravity(),
        JointDamping((0.2, 0.1)),
        JointSpring((3.0, 2.0)),
        JointTorque((0.3, 0.0), (1.0, 0.5), (3.0, 2.0)),
        EndDrag(0.3),
    )
    trajectory = simulate(replace(SCENE, effects=effects))
    works = trajectory.work()
    assert list(works) == [type(effect).__name__ for effect in effects]
    T = trajectory.kinetic_energy
    assert sum(works.values()) == pytest.approx(T - T[0], abs=1e-10)
    V = Gravity().potential_energy(GENERAL, tuple(trajectory.q))
    assert works["Gravity"] == pytest.approx(V[0] - V, abs=1e-10)
    assert np.all(np.diff(works["JointDamping"]) <= 0)
    assert np.all(np.diff(works["EndDrag"]) <= 0)


def test_works_of_two_effects_of_one_kind_are_kept_apart():
    works = simulate(replace(SCENE, effects=(Gravity(), Gravity(1.0)))).work()
    assert list(works) == ["Gravity", "Gravity 2"]
    assert works["Gravity 2"] == pytest.approx(works["Gravity"] / 9.81, abs=1e-12)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("samples", [2, 11, 501])
@pytest.mark.parametrize(
    "effects",
    [
        (Gravity(), JointDamping((0.05, 0.05))),
        (Gravity(), PdControl((0.5, 0.5), (1e4, 1e4), (1.0, 1.0))),
    ],
    ids=["fast", "stiff"],
)
def test_work_does_not_depend_on_the_spacing_of_samples(effects, samples):
    """Between two of them the chain may turn a hundred times."""
    scene = Scene(Chain.uniform_bars(), (0.0, 0.0), (60.0, -90.0), 2.0, effects)
    trajectory = simulate(scene, accuracy=1e-11, samples=samples)
    given, T = sum(trajectory.work().values()), trajectory.kinetic_energy
    assert abs(given - (T - T[0])).max() <= 2e-12 * T.max()


@pytest.mark.slow
def test_the_work_until_a_slide_jams_balances_to_the_round_off_of_the_angle_left():
    """D slides to the left along a ceiling, towards the base, until friction locks it.

    The last step is 2⁻⁴² of the time, so that at least this part of the mean turn is left, and the
    round-off of the angles is that much larger a part of the power there. The work from there on
    is less than T: most of it is that of the impact that ends the slide.
    """
    ceiling = Surface((0.0, 0.0), (0.0, -1.0), friction=5.0)
    scene = Scene(Chain.uniform_bars(), (-0.5, 0.5), (5.0, -5.0), 0.2, (ceiling,))
    trajectory = simulate(scene)
    assert trajectory.precision == "quadruple"
    (jam,) = trajectory.impacts
    assert jam.time > 0
    before, after = jam.kinetic_energy
    T = trajectory.kinetic_energy
    assert before < 0.02 * T[0]
    assert after == 0
    turned = np.abs(np.subtract(trajectory.q[:, -1], scene.q)).min()
    bound = np.finfo(np.longdouble).eps / 2 / (2.0**-42 * turned) * before
    assert bound < 1e-8 * T[0]
    (given,) = trajectory.work().values()
    assert abs(given - (T - T[0])).max() <= bound


def test_pieces_end_at_the_knots_themselves_and_leave_out_steps_below_rounding():
    """Three knots round to 1 s: a step before them, one after, and two that float64 cannot tell."""
    long = np.longdouble
    knots = np.array([0, 1 - long(2.0) ** -60, 1, 1 + long(2.0) ** -60, 2])
    forces = ModeForces(SCENE, (), np.longdouble)
    work = Work(forces, (), lambda times: (times, times), knots)
    begins, ends = work._pieces(np.array([0.0, 0.25, 1.0, 2.0]))
    assert begins.tolist() == [0, 0.25, knots[3]]
    assert ends.tolist() == [0.25, knots[1], 2]


def test_work_of_a_run_of_too_many_steps_is_refused(monkeypatch):
    monkeypatch.setattr("twolink.simulation.work._FLOATS_OF_A_NODE", 1e9)
    scene = Scene(Chain.uniform_bars(), (0.0, 0.0), (0.0, 0.0), 1.0, (Gravity(),))
    with pytest.raises(TooMuchError, match=r"the work would take about .* of memory; the limit is"):
        simulate(scene, samples=2).work()
