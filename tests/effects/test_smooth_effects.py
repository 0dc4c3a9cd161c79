"""Each effect alone: a closed form or a balance, and Pinocchio under the same loads."""

import math
from dataclasses import replace
from fractions import Fraction

import heyoka
import mpmath
import numpy as np
import pytest
import scipy

from tests.verification.chains import GENERAL
from twolink import kane, lagrange
from twolink.chain import Chain
from twolink.coordinates import JointConvention
from twolink.effects.end_drag import EndDrag
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.errors import ParameterError
from twolink.loads import Force
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.urdf import parse_planar_urdf

BALANCED = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (2.0, 0.5))
"""Both mass centres on the joints: each link turns on its own, and M = diag(3, 0.5)."""

EFFECTS = {
    "gravity": Gravity(9.81),
    "gravity aslant": Gravity(9.81, direction=(1.0, -2.0)),
    "end force": EndForce(normal=-3.0, friction=0.4, sliding=1),
    "joint torque": JointTorque((1.5, -0.7)),
    "sinusoidal torque": JointTorque((0.1, 0.2), (1.5, -0.7), (3.0, 5.0), (0.3, -0.4)),
    "joint damping": JointDamping((0.3, 0.7)),
    "joint spring": JointSpring((4.0, 3.0), rest=(0.5, -0.3)),
    "PD control": PdControl((0.4, 0.8), (20.0, 10.0), (2.0, 1.0)),
    "end drag": EndDrag(0.6),
}


FRACTIONS = {
    "gravity": lambda x: Gravity(x[0]),
    "gravity aslant": lambda x: Gravity(x[0], (x[1], -x[2])),
    "end force": lambda x: EndForce(normal=-x[0], friction=x[1], sliding=1),
    "sinusoidal torque": lambda x: JointTorque(x[:2], x[1:3], x[2:4], (x[3], -x[0])),
    "joint damping": lambda x: JointDamping(x[:2]),
    "joint spring": lambda x: JointSpring(x[:2], x[2:]),
    "PD control": lambda x: PdControl(x[:2], x[1:3], x[2:]),
    "end drag": lambda x: EndDrag(x[0]),
}


@pytest.mark.parametrize("name", FRACTIONS)
@pytest.mark.parametrize("number", [np.longdouble, lambda x: heyoka.real(x, 200)])
def test_fractions_have_the_digits_of_the_chain(name, number):
    """Thirds and sevenths against the same numbers in fifty digits."""
    fractions = (Fraction(2, 3), Fraction(3, 7), Fraction(5, 7), Fraction(4, 3))
    with mpmath.workdps(50):
        exact = tuple(mpmath.mpf(x.numerator) / x.denominator for x in fractions)
        true = generalized_force(FRACTIONS[name](exact), mpmath.mpf)
        found = generalized_force(FRACTIONS[name](fractions), number)
        left = max(abs(mpmath.mpf(str(x)) - y) for x, y in zip(found, true, strict=True))
        assert left < (1e-17 if number is np.longdouble else 1e-47)


def generalized_force(effect, number):
    """Return Q1 and Q2 (N m) in a state of float64, in numbers of a type."""
    chain = GENERAL.convert(number)
    q, u, t = ((number(x), number(y)) for x, y in ((0.3, -0.4), (1.1, -0.7), (0.5, 0.0)))
    return kane.generalized_active_force(chain, q, effect.loads(chain, q, u, t[0]))


def scene(*effects, chain=GENERAL, q=(0.3, -0.4), u=(1.1, -0.7), duration=3.0) -> Scene:
    return Scene(chain=chain, q=q, u=u, duration=duration, effects=effects, accuracy=1e-10)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("formulation", ["momenta", "lagrange", "kane"])
def test_pinocchio_under_the_same_loads_along_the_trajectory(name, formulation):
    """RNEA at our accelerations, under the effect's forces, needs the effect's torques."""
    effect = EFFECTS[name]
    trajectory = simulate(scene(effect), formulation=formulation, samples=40)
    q, u = tuple(trajectory.q), tuple(trajectory.u)
    loads = effect.loads(GENERAL, q, u, trajectory.t)
    equations = kane if formulation == "kane" else lagrange
    du = np.array(np.broadcast_arrays(*equations.forward_dynamics(GENERAL, q, u, loads)))
    forces = [load for load in loads if isinstance(load, Force)]
    torques = tuple(load for load in loads if not isinstance(load, Force))
    joints = JointConvention()
    angles, speeds, accelerations = (
        np.array(pair) for pair in (joints.joint_angles(q), joints.joint_speeds(u),
                                    joints.joint_speeds(du))
    )  # fmt: skip
    wanted = np.zeros_like(angles)
    if torques:
        moments = kane.generalized_active_force(GENERAL, q, torques)
        wanted = wanted + np.array(
            np.broadcast_arrays(*joints.joint_forces(moments), wanted[0])[:2]
        )
    end_force = np.zeros_like(angles)
    engine = PinocchioChain(parse_planar_urdf(GENERAL.to_urdf(), gravity=(0.0, 0.0, 0.0)))
    for force in forces:
        if force.point == GENERAL.D:
            end_force = end_force + np.array(np.broadcast_arrays(*force.components, angles[0])[:2])
        else:
            centre = "C1" if force.point == GENERAL.C1 else "C2"
            components = np.array(np.broadcast_arrays(*force.components, angles[0])[:2])
            wanted = wanted + np.einsum("pcn,pn->cn", engine.jacobian(centre, angles), components)
    found = engine.inverse_dynamics(angles, speeds, accelerations, end_force)
    assert found == pytest.approx(wanted, rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("name", ["gravity", "gravity aslant", "joint spring"])
def test_conservative_effects_conserve_energy(name):
    energy = simulate(scene(EFFECTS[name], Gravity())).energy
    assert energy == pytest.approx(energy[0], abs=1e-9)


def test_free_rotation_conserves_energy_and_angular_momentum():
    trajectory = simulate(scene())
    assert trajectory.effects == ()
    assert trajectory.energy == pytest.approx(trajectory.energy[0], rel=1e-11)
    momentum = sum(lagrange.momenta(GENERAL, tuple(trajectory.q), tuple(trajectory.u)))
    assert momentum == pytest.approx(momentum[0], rel=1e-11)


@pytest.mark.parametrize("name", ["joint damping", "end drag"])
def test_dissipation_takes_energy(name):
    energy = simulate(scene(EFFECTS[name])).energy
    assert np.all(np.diff(energy) < 0)


def test_small_oscillations_have_the_two_frequencies():
    """Near hanging, M q̈ + K q = 0: a start along a mode stays in it, at its frequency."""
    bars = Chain.uniform_bars()
    down = (math.pi / 2, math.pi / 2)
    M = np.array(lagrange.mass_matrix(bars, down))
    K = 9.81 * np.diag([1.5, 0.5])
    squares, modes = scipy.linalg.eigh(K, M)
    for square, mode in zip(squares, modes.T, strict=True):
        period = 2 * math.pi / math.sqrt(square)
        start = tuple(np.array(down) + 1e-5 * mode)
        moved = simulate(
            scene(Gravity(), chain=bars, q=start, u=(0.0, 0.0), duration=float(period))
        )
        assert moved.q[:, -1] - down == pytest.approx(1e-5 * mode, abs=1e-13)


def test_viscous_decay():
    """One link alone: u = u0 exp(−c t / I)."""
    trajectory = simulate(
        scene(JointDamping((0.7, 0.0)), chain=BALANCED, u=(2.0, 0.0), duration=4.0)
    )
    assert trajectory.u[0] == pytest.approx(2.0 * np.exp(-0.7 / 3.0 * trajectory.t), abs=1e-9)


def test_a_spring_swings_at_its_frequency():
    trajectory = simulate(
        scene(JointSpring((5.0, 0.0)), chain=BALANCED, q=(0.4, 0.0), u=(0.0, 0.0))
    )
    expected = 0.4 * np.cos(math.sqrt(5.0 / 3.0) * trajectory.t)
    assert trajectory.q[0] == pytest.approx(expected, abs=1e-9)


def test_a_constant_torque_accelerates():
    trajectory = simulate(
        scene(JointTorque((6.0, 0.0)), chain=BALANCED, q=(0.0, 0.0), u=(0.0, 0.0))
    )
    assert trajectory.q[0] == pytest.approx(trajectory.t**2, abs=1e-9)


def test_a_sinusoidal_torque():
    """3 q̈ = 6 sin 2t from rest: q = t − sin(2t)/2."""
    torque = JointTorque(amplitude=(6.0, 0.0), frequency=(2.0, 0.0))
    trajectory = simulate(scene(torque, chain=BALANCED, q=(0.0, 0.0), u=(0.0, 0.0)))
    expected = trajectory.t - np.sin(2 * trajectory.t) / 2
    assert trajectory.q[0] == pytest.approx(expected, abs=1e-9)


def test_pd_control_reaches_its_target():
    control = PdControl((0.4, 0.8), (20.0, 10.0), (8.0, 4.0))
    trajectory = simulate(replace(scene(control), duration=30.0))
    q1, q2 = trajectory.q[:, -1]
    assert (q1, q2 - q1) == pytest.approx((0.4, 0.8), abs=1e-8)


def test_drag_on_the_end_is_linear():
    """A balanced link 2 with drag c at its end: 0.5 u̇ = −c L² u, while link 1 stands still."""
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (1e9, 0.5))
    trajectory = simulate(scene(EndDrag(0.2), chain=chain, u=(0.0, 1.0)))
    assert trajectory.u[1] == pytest.approx(np.exp(-0.4 * trajectory.t), abs=1e-8)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: JointDamping((-0.1, 0.0)), "joint damping at A must be zero or .*; got -0.1"),
        (lambda: JointDamping((0.1, math.nan)), "joint damping at B must be zero or .*; got nan"),
        (lambda: EndDrag(-1.0), "end drag must be zero or positive and finite; got -1.0"),
        (
            lambda: Gravity(9.81, (0.0, 0.0)),
            "gravity: direction must be two finite numbers, not both zero",
        ),
    ],
)
def test_bad_parameters_are_refused(make, words):
    with pytest.raises(ParameterError, match=words):
        make()
