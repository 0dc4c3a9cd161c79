"""Rotors: carried along or not, in both formulations, and as bodies of their own in Pinocchio."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pinocchio
import pytest
import sympy

from tests.verification.chains import GENERAL
from twolink import kane, lagrange
from twolink.chain import Chain, Rotor
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.effects.motor_inertia import MotorInertia
from twolink.errors import ParameterError
from twolink.loads import motor_loads
from twolink.scene import Scene
from twolink.simulation import simulate

MOTORS = MotorInertia((0.02, 0.03), (6.0, -5.0))

LIMITS = '"revolute"><limit effort="1" velocity="1"/>'


def with_rotor_bodies(chain: Chain, inertias) -> str:
    """The chain's URDF with a body for each rotor, on a joint of its own."""
    bodies = ""
    for parent, inertia in zip(("world", "link1"), inertias, strict=True):
        at_B = f"<origin xyz='{chain.L1!r} 0 0'/>" if parent == "link1" else ""
        bodies += f"""
  <link name="rotor_on_{parent}"><inertial><mass value="0"/>
    <inertia ixx="0" ixy="0" ixz="0" iyy="{inertia!r}" iyz="0" izz="0"/></inertial></link>
  <joint name="motor_on_{parent}" type="continuous">{at_B}<parent link="{parent}"/>
    <child link="rotor_on_{parent}"/><axis xyz="0 1 0"/></joint>"""
    text = chain.to_urdf()
    root = text.split('<parent link="')[1].split('"')[0]
    bodies = bodies.replace('"world"', f'"{root}"')
    return text.replace("</robot>", bodies + "\n</robot>").replace('"continuous">', LIMITS)


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_pinocchio_with_rotors_as_bodies(formulation, random):
    """Pinocchio's four-joint tree, with rotor angles n θ: M = Gᵀ M₄ G, and the torques likewise."""
    model = pinocchio.buildModelFromXML(with_rotor_bodies(GENERAL, MOTORS.inertia))
    data = model.createData()
    index = {name: model.joints[model.getJointId(name)].idx_v for name in model.names[1:]}
    motors = [index["motor_on_world"], index["motor_on_link1"]]
    joints = [value for name, value in index.items() if not name.startswith("motor")]
    G = np.zeros((4, 2))
    for k in (0, 1):
        G[joints[k], k] = 1.0
        G[motors[k], k] = MOTORS.ratio[k]
    S = np.array([[1.0, 0.0], [1.0, 1.0]])  # u = S θ̇
    chain = MOTORS.with_rotors(GENERAL)
    for _ in range(200):
        q, u, du = random.uniform(-3, 3, (3, 2))
        theta, speed, rate = (np.linalg.solve(S, x) for x in (q, u, du))
        M = S.T @ np.array(formulation.mass_matrix(chain, tuple(q))) @ S
        M4 = pinocchio.crba(model, data, G @ theta)
        np.testing.assert_allclose(M, G.T @ M4 @ G, rtol=1e-13, atol=1e-13)
        tau = pinocchio.rnea(model, data, G @ theta, G @ speed, G @ rate)
        loads = Gravity().loads(chain, tuple(q), tuple(u))
        ours = formulation.inverse_dynamics(chain, tuple(q), tuple(u), tuple(du), loads)
        assert S.T @ np.array(ours) == pytest.approx(G.T @ tau, rel=1e-11, abs=1e-11)


def test_an_armature_is_a_rotor_that_is_not_carried(random):
    motors = replace(MOTORS, carried=False)
    model = pinocchio.buildModelFromXML(GENERAL.to_urdf().replace('"continuous">', LIMITS))
    model.armature = np.array(
        [J * n * n for J, n in zip(motors.inertia, motors.ratio, strict=True)]
    )
    data = model.createData()
    S = np.array([[1.0, 0.0], [1.0, 1.0]])
    chain = motors.with_rotors(GENERAL)
    for _ in range(20):
        q = random.uniform(-3, 3, 2)
        M = S.T @ np.array(lagrange.mass_matrix(chain, tuple(q))) @ S
        expected = pinocchio.crba(model, data, np.linalg.solve(S, q))
        np.testing.assert_allclose(M, expected, rtol=1e-13, atol=1e-13)


@pytest.mark.slow
def test_the_determinant_and_the_energy_are_those_of_the_mass_matrix():
    """By SymPy, for two rotors of any turning on any chain."""
    symbols = sympy.symbols("m1 m2 L1 L2 I1 I2 J1 J2", positive=True)
    m1, m2, L1, L2, I1, I2, J1, J2 = symbols
    a1, b1, a2, b2, w1, w2, x1, x2, q1, q2, u1, u2 = sympy.symbols(
        "a1 b1 a2 b2 w1 w2 x1 x2 q1 q2 u1 u2", real=True
    )
    rotors = Rotor(J1, (w1, w2)), Rotor(J2, (x1, x2))
    chain = Chain((m1, m2), (L1, L2), ((a1, b1), (a2, b2)), (I1, I2), rotors)
    u = sympy.Matrix([u1, u2])
    for formulation in (kane, lagrange):
        M = sympy.Matrix(formulation.mass_matrix(chain, (q1, q2)))
        det = formulation.determinant(chain, (q1, q2))
        assert sympy.simplify(sympy.expand_trig(sympy.expand(M.det() - det))) == 0
        T = formulation.kinetic_energy(chain, (q1, q2), (u1, u2))
        assert sympy.expand(T - (u.T * M * u)[0] / 2) == 0
    ours = kane.generalized_inertia_force(chain, (q1, q2), (u1, u2), (sympy.Symbol("A"), 0))
    theirs = lagrange.inverse_dynamics(chain, (q1, q2), (u1, u2), (sympy.Symbol("A"), 0), ())
    for one, other in zip(ours, theirs, strict=True):
        assert sympy.simplify(sympy.expand_trig(sympy.expand(one + other))) == 0


def test_a_geared_motor_spins_up_its_link():
    """A balanced link 1 with a locked elbow of no consequence: (I + J n²) du = τ."""
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (2.0, 0.5))
    effects = MotorInertia((0.1, 0.0), (4.0, 1.0)), JointTorque((2.3, 0.0))
    scene = Scene(chain=chain, q=(0.0, 0.0), u=(0.0, 0.0), duration=2.0, effects=effects)
    trajectory = simulate(scene)
    expected = 2.3 / (3.0 + 0.1 * 16) * trajectory.t
    assert trajectory.u[0] == pytest.approx(expected, abs=1e-10)
    assert trajectory.kinetic_energy == pytest.approx(2.3 * trajectory.q[0], abs=1e-9)


@pytest.mark.parametrize("formulation", ["momenta", "lagrange", "kane"])
def test_energy_is_conserved_with_rotors(formulation):
    scene = Scene(
        chain=GENERAL, q=(0.3, -0.4), u=(1.1, -0.7), duration=5.0, effects=(MOTORS, Gravity()),
        accuracy=1e-11,
    )  # fmt: skip
    trajectory = simulate(scene, formulation=formulation)
    energy = trajectory.energy
    assert energy == pytest.approx(energy[0], abs=1e-9)
    assert trajectory.q != pytest.approx(simulate(replace(scene, effects=(Gravity(),))).q, abs=1e-2)


def test_dfkis_mass_matrix():
    """DFKI's pendulum C.1/1.0: in joint angles, with the second rotor turning against its joint."""
    m, L, r = (0.52346, 0.62557), (0.2, 0.3), (0.2, 0.25569305)
    about_joint, J, n = (0.0318872, 0.0508698), 6.2872e-5, 6.0
    central = tuple(np.array(about_joint) - np.array(m) * np.array(r) ** 2)
    chain = Chain(m, L, ((r[0], 0.0), (r[1], 0.0)), central)
    chain = MotorInertia((J, J), (n, -n)).with_rotors(chain)
    elbow = 0.7
    coupling = m[1] * L[0] * r[1] * math.cos(elbow)
    own = about_joint[0] + about_joint[1] + m[1] * L[0] ** 2 + 2 * coupling
    expected = [
        [own + J + n * n * J, about_joint[1] + coupling - n * J],
        [about_joint[1] + coupling - n * J, about_joint[1] + n * n * J],
    ]
    S = np.array([[1.0, 0.0], [1.0, 1.0]])
    M = S.T @ np.array(lagrange.mass_matrix(chain, (0.3, 0.3 + elbow))) @ S
    np.testing.assert_allclose(M, expected, rtol=1e-13)


@pytest.mark.parametrize("ratio", [(1.0, -7.3), (Fraction(1, 3), Fraction(1, 7)), (2, 5)])
def test_a_carried_rotor_turns_with_exactly_one_less_than_its_gear_ratio(ratio):
    """1 + 7.3 is rounded in float64; a reference has it with all its digits."""
    bars = Chain.uniform_bars()
    chain = MotorInertia((0.1, 0.2), ratio).with_rotors(bars)
    first, second = map(Fraction, ratio)
    exact = (Rotor(Fraction(0.1), (first, 0)), Rotor(Fraction(0.2), (1 - second, second)))
    assert chain.convert(Fraction).rotors == exact
    assert chain.convert(Fraction).inertia == (Fraction(1, 12),) * 2
    (_, (_, (own, _))) = chain.rotors
    assert (type(own), own) == (float, float(1 - second))
    twice = MotorInertia((0.3, 0.0), (0.7, 1.0)).with_rotors(chain).convert(Fraction)
    assert twice.rotors == (*exact, Rotor(Fraction(0.3), (Fraction(0.7), 0)))


def test_other_rotors_are_the_floats_that_they_are():
    chain = MotorInertia((0.1, 0.2), (1.0, -7.3)).with_rotors(Chain.uniform_bars())
    other = replace(chain, rotors=(Rotor(0.1, (1.0 + 7.4, -7.4)),))
    assert other.convert(Fraction).rotors[0].turning == (Fraction(1.0 + 7.4), Fraction(-7.4))
    assert replace(chain, rotors=()).convert(Fraction).rotors == ()


def test_rotors_without_inertia_are_omitted_and_others_are_refused_for_urdfs():
    assert MotorInertia((0.0, 0.0)).with_rotors(GENERAL) == GENERAL
    with pytest.raises(ParameterError, match="a chain must have no rotors for a URDF"):
        MOTORS.with_rotors(GENERAL).to_urdf()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"inertia": (-0.1, 0.0)}, "motor inertia at A must be zero or .*; got -0.1"),
        ({"inertia": (0.1, math.nan)}, "motor inertia at B must be zero or .*; got nan"),
        (
            {"inertia": (0.1, 0.1), "ratio": (math.inf, 1.0)},
            "gear ratio at A must be finite; got inf",
        ),
    ],
)
def test_bad_motors_are_refused(options, words):
    with pytest.raises(ParameterError, match=words):
        MotorInertia(**options)


def test_motor_loads_are_felt_through_the_gear():
    """A torque on link 2 has its reaction on link 1."""
    Q1, Q2 = kane.generalized_active_force(GENERAL, (0.1, 0.2), motor_loads(0.0, 3.0))
    assert (Q1, Q2) == (-3.0, 3.0)
