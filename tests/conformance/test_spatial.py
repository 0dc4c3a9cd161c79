"""The kit's truth against two planar derivations at 50 digits, and against other engines."""

from decimal import Decimal

import mpmath
import numpy as np
import pytest

from tests.import_suite.index import FOLDER, VALID, named
from tests.import_suite.truth import ANGLES, gravity_torque, mass_matrix
from twolink import kane, kinematics, lagrange
from twolink.chain import Chain
from twolink.conformance.spatial import DECIMALS, FLOATS, SpatialState, rotation_about
from twolink.conformance.suites import suite
from twolink.conformance.urdf_model import model_of_parameters, model_of_urdf
from twolink.coordinates import JointConvention
from twolink.effects.gravity import Gravity
from twolink.hardcases.exact import digits

JOINTS = JointConvention()
GROUPS = {group.id: group for group in suite("evaluation")}
PLAIN = [name for name, group in GROUPS.items() if not any(group.parameters.armature)]


class Planar:
    """The quantities by a formulation of the library, in joint coordinates."""

    def __init__(self, formulation, parameters, state):
        pairs = parameters.damping, parameters.friction
        self.resistance = [tuple(map(mpmath.mpf, pair)) for pair in pairs]
        given = parameters.mass, parameters.length, parameters.centre, parameters.inertia
        self.chain = Chain(*given).convert(mpmath.mpf)
        self.gravity = Gravity(mpmath.mpf(parameters.gravity))
        self.formulation, self.state = formulation, state
        self.omega = state.get("speeds", (0, 0))
        self.q = JOINTS.absolute_angles(state["angles"])
        self.u = JOINTS.absolute_speeds(self.omega)
        self.du = JOINTS.absolute_speeds(state.get("accelerations", (0, 0)))
        self.loads = self.gravity.loads(self.chain, self.q, self.u)

    def mass_matrix(self):
        return JOINTS.joint_matrix(self.formulation.mass_matrix(self.chain, self.q))

    def velocity_terms(self):
        return JOINTS.joint_forces(self.formulation.velocity_terms(self.chain, self.q, self.u))

    def gravity_terms(self):
        Q1, Q2 = self.formulation.generalized_active_force(self.chain, self.q, self.loads)
        return JOINTS.joint_forces((-Q1, -Q2))

    def inverse_dynamics(self):
        chain, q, u, du, loads = self.chain, self.q, self.u, self.du, self.loads
        return JOINTS.joint_forces(self.formulation.inverse_dynamics(chain, q, u, du, loads))

    def forward_dynamics(self):
        damping, friction = self.resistance
        terms = zip(
            self.state["torques"],
            self.velocity_terms(),
            self.gravity_terms(),
            damping,
            friction,
            self.omega,
            strict=True,
        )
        rest = [tau - c - g - d * w - f * mpmath.sign(w) for tau, c, g, d, f, w in terms]
        return tuple(mpmath.lu_solve(mpmath.matrix(self.mass_matrix()), mpmath.matrix(rest)))

    def kinetic_energy(self):
        return self.formulation.kinetic_energy(self.chain, self.q, self.u)

    def potential_energy(self):
        return self.gravity.potential_energy(self.chain, self.q)

    def position(self):
        return kinematics.position(self.chain, self.q, self.chain.D)

    def velocity(self):
        return kinematics.velocity(self.chain, self.q, self.u, self.chain.D)

    def acceleration(self):
        return kinematics.acceleration(self.chain, self.q, self.u, self.du, self.chain.D)

    def jacobian(self):
        columns = lagrange.position_gradients(self.chain, self.q, self.chain.D)
        return JOINTS.joint_columns(tuple(zip(*columns, strict=True)))


def flat(value):
    if isinstance(value, (tuple, list)):
        return [number for entry in value for number in flat(entry)]
    return [value]


@pytest.mark.parametrize("name", PLAIN)
@pytest.mark.parametrize("formulation", [kane, lagrange], ids=["kane", "lagrange"])
def test_values_have_thirty_digits(formulation, name):
    group = GROUPS[name]
    with mpmath.workdps(50):
        for test in group.tests:
            states = test.states.model_dump(exclude_none=True)
            first = None
            for index, expected in enumerate(test.values):
                state = {key: tuple(map(mpmath.mpf, rows[index])) for key, rows in states.items()}
                found = flat(getattr(Planar(formulation, group.parameters, state), test.quantity)())
                if test.quantity == "potential_energy":
                    first = found if first is None else first
                    found = [found[0] - first[0]]
                wanted = [mpmath.mpf(word) for word in flat(expected)]
                size = max(map(abs, wanted))
                for one, other in zip(found, wanted, strict=True):
                    assert abs(one - other) <= mpmath.mpf("1e-28") * size, test.id


def test_armature_is_added_to_the_diagonal():
    given = GROUPS["evaluation/armature"].parameters.model_dump()
    with_rotors, without = (
        SpatialState(model_of_parameters(each, FLOATS), FLOATS, (0.3, -0.8)).mass_matrix()
        for each in (given, given | {"armature": (0.0, 0.0)})
    )
    difference = np.array(with_rotors) - np.array(without)
    assert np.allclose(difference, np.diag(given["armature"]), rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    "test", [test for test in VALID if "Encoding" not in test["flags"]], ids=named
)
def test_files_have_their_planar_parameters(test):
    """The sums over bodies agree with the parameters from which the files were built."""
    expected = test["parameters"]
    text = (FOLDER / test["file"]).read_text(encoding="utf-8")
    model = model_of_urdf(
        text,
        FLOATS,
        plane=expected["plane"],
        origin=expected["origin"],
        gravity=(0.0, 0.0, -9.81),
    )
    for theta in ANGLES:
        state = SpatialState(model, FLOATS, theta)
        M, weight = mass_matrix(expected, theta), gravity_torque(expected, theta)
        assert np.allclose(state.mass_matrix(), M, rtol=0, atol=1e-13 * M.max())
        scale = 9.81 * sum(link["mass"] * link["length"] for link in expected["links"])
        assert np.allclose(state.gravity_terms(), -weight, rtol=0, atol=1e-12 * scale)


def test_a_rotation_in_decimals_is_that_in_floats():
    axis = (Decimal(0), Decimal("0.6"), Decimal("0.8"))
    with digits():
        exact = rotation_about(axis, *DECIMALS.cosine_and_sine(Decimal("0.7")))
    near = rotation_about((0.0, 0.6, 0.8), *FLOATS.cosine_and_sine(0.7))
    assert np.allclose(np.array(exact, dtype=float), near, rtol=0, atol=1e-15)
    assert np.allclose(np.array(near) @ np.array(near).T, np.eye(3), rtol=0, atol=1e-15)


def test_work_of_the_forces_is_the_change_of_energy():
    """dT/dt = θ̇ · (M θ̈ + C θ̇), which no formula here has been made for."""
    model = model_of_urdf(
        (FOLDER / "valid" / "products-of-inertia.urdf").read_text(),
        FLOATS,
        plane=np.eye(3),
        origin=(0, 0, 0),
        gravity=(0, 0, 0),
    )
    theta, omega, alpha, h = np.array([0.4, 1.3]), np.array([1.7, -2.1]), np.array([0.6, 2.2]), 1e-5

    def energy(t):
        state = theta + omega * t + alpha * t * t / 2
        return SpatialState(model, FLOATS, tuple(state), tuple(omega + alpha * t)).kinetic_energy()

    state = SpatialState(model, FLOATS, tuple(theta), tuple(omega))
    power = omega @ (np.array(state.mass_matrix()) @ alpha + np.array(state.velocity_terms()))
    assert (energy(h) - energy(-h)) / (2 * h) == pytest.approx(power, rel=1e-8)
