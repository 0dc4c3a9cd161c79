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
from twolink.errors import TooMuchError
from twolink.scene import Scene
from twolink.simulation import simulate

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
    trajectory = simulate(scene, samples=samples)
    given, T = sum(trajectory.work().values()), trajectory.kinetic_energy
    assert abs(given - (T - T[0])).max() <= 2e-12 * T.max()


def test_work_of_a_run_of_too_many_steps_is_refused(monkeypatch):
    monkeypatch.setattr("twolink.simulation.work._FLOATS_OF_A_NODE", 1e9)
    scene = Scene(Chain.uniform_bars(), (0.0, 0.0), (0.0, 0.0), 1.0, (Gravity(),))
    with pytest.raises(TooMuchError, match=r"the work would take about .* of memory; the limit is"):
        simulate(scene, samples=2).work()
