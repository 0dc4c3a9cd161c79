"""Quantities of a trajectory: joint forces, works, energies, the cost of its effects."""

import math
import sys
from dataclasses import replace

import numpy as np
import pinocchio
import pytest

from tests.verification.chains import GENERAL
from twolink.chain import Chain
from twolink.effects.end_drag import EndDrag
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.errors import SimulationError, TooMuchError
from twolink.kinematics import velocity
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.effects_cost import effects_cost

SCENE = Scene(
    chain=GENERAL, q=(0.3, -0.4), u=(1.1, -0.7), duration=2.0, effects=(Gravity(),), accuracy=1e-11
)


def test_a_hanging_chain_is_held_by_its_weight():
    down = (math.pi / 2, math.pi / 2)
    chain = Chain.uniform_bars((1.3, 0.7))
    trajectory = simulate(replace(SCENE, chain=chain, q=down, u=(0.0, 0.0), duration=0.1))
    at_A, at_B = trajectory.reactions()
    assert at_A[0] == pytest.approx(0, abs=1e-12)
    assert at_A[1] == pytest.approx(-9.81 * 2.0)
    assert at_B[1] == pytest.approx(-9.81 * 0.7)


def test_reactions_are_pinocchios_joint_forces():
    trajectory = simulate(SCENE, samples=9)
    at_A, at_B = trajectory.reactions()
    model = pinocchio.buildModelFromXML(
        GENERAL.to_urdf().replace('"continuous">', '"revolute"><limit effort="1" velocity="1"/>')
    )
    data = model.createData()
    for k, (q, u) in enumerate(zip(trajectory.q.T, trajectory.u.T, strict=True)):
        theta, speed = (np.array([pair[0], pair[1] - pair[0]]) for pair in (q, u))
        acceleration = pinocchio.aba(model, data, theta, speed, np.zeros(2))
        pinocchio.rnea(model, data, theta, speed, acceleration)
        pinocchio.forwardKinematics(model, data, theta)
        for joint, force in ((1, at_A), (2, at_B)):
            x, _, z = data.oMi[joint].rotation @ data.f[joint].linear
            assert (x, -z) == pytest.approx(tuple(force[:, k]), abs=1e-10)


def test_reactions_answer_to_forces_on_the_end():
    """The whole chain: m a = F_A + weights + force on D."""
    end = EndForce(-3.0, 0.4, sliding=1)
    trajectory = simulate(replace(SCENE, effects=(Gravity(), end)))
    at_A, _ = trajectory.reactions()
    momentum = sum(
        mass * np.array(velocity(GENERAL, tuple(trajectory.q), tuple(trajectory.u), centre))
        for mass, centre in ((GENERAL.m1, GENERAL.C1), (GENERAL.m2, GENERAL.C2))
    )
    change = momentum[:, -1] - momentum[:, 0]
    outer = np.array([[-1.2], [-3.0 + 9.81 * sum(GENERAL.mass)]])
    impulse = np.trapezoid(at_A + outer, trajectory.t)
    assert change == pytest.approx(impulse, abs=1e-3)


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


def test_methods_without_polynomials_have_samples_alone():
    trajectory = simulate(SCENE, accuracy=1e-3, method="rk4")
    with pytest.raises(SimulationError, match="known only at its samples"):
        trajectory.at(0.5)
    with pytest.raises(SimulationError, match="known only at its samples"):
        trajectory.work()


def test_without_heyoka_scipy_takes_over_and_says_so(monkeypatch):
    exact = simulate(SCENE)
    monkeypatch.setitem(sys.modules, "heyoka", None)
    trajectory = simulate(SCENE, accuracy=1e-8)
    assert trajectory.method == "DOP853"
    assert "heyoka is not installed here" in trajectory.notes[0]
    assert trajectory.met
    assert np.abs(trajectory.q - exact.q).max() <= 1e-8


def test_each_effect_has_a_cost():
    scene = replace(SCENE, effects=(Gravity(), JointDamping((0.2, 0.1))))
    cost = effects_cost(scene)
    assert set(cost.without) == {"Gravity", "JointDamping"}
    for step in cost.without.values():
        assert 0 < step.operations < cost.whole.operations
        assert step.seconds > 0


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
    monkeypatch.setattr("twolink.simulation.trajectory._BYTES_OF_A_NODE", 1e9)
    scene = Scene(Chain.uniform_bars(), (0.0, 0.0), (0.0, 0.0), 1.0, (Gravity(),))
    with pytest.raises(TooMuchError, match=r"the work would take about .* of memory; the limit is"):
        simulate(scene, samples=2).work()
