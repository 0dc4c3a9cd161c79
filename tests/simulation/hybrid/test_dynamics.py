"""Dynamics of a mode against NumPy's solution of the equations of motion with constraints."""

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, BARS, system_of
from twolink import kane, lagrange
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elements import CompliantContact, DryFriction, RigidContact
from twolink.contact.force_laws import Hertz, KelvinVoigt, Phase, PlasticState
from twolink.contact.states import ContactState as S
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.loads import Force, Torque
from twolink.simulation.hybrid.dynamics import (
    constraint_count,
    is_fixed,
    loads_of,
    local_equations,
    mode_solution,
    push_of,
    scaled,
)
from twolink.simulation.hybrid.pose import Pose

UP, ALONG = PointCoordinate("D", (0.0, -1.0)), PointCoordinate("D", (1.0, 0.0))
FLOOR = RigidContact("D on floor", UP, -2.0, 0.0, ALONG, kinetic=0.3, static=0.5)
AT_A = DryFriction("A", JointCoordinate("A"), 0.7, 0.9)
AT_B = DryFriction("B", JointCoordinate("B"), 0.2, 0.4)
Q, U = (0.7, -0.4), (1.1, -0.6)
WEIGHT = (Gravity(9.81),)


def pose_of(formulation=lagrange, chain=BARS, q=Q):
    return Pose(chain, formulation, q)


def solved(elements, states, u=U, effects=WEIGHT, formulation=lagrange, **more):
    dents = [None] * len(elements)
    pose = pose_of(formulation)
    return pose, mode_solution(pose, effects, elements, states, dents, u, 0.0, **more)


def bars(q, u, g=9.81):
    """Return M, the right side and D's Jacobian of two uniform bars of 1 kg and 1 m."""
    s, c = np.sin(q[1] - q[0]), np.cos(q[1] - q[0])
    M = np.array([[4 / 3, c / 2], [c / 2, 1 / 3]])
    right = np.array([s / 2 * u[1] ** 2, -s / 2 * u[0] ** 2])
    right += g * np.array([1.5 * np.cos(q[0]), 0.5 * np.cos(q[1])])
    J = np.array([[-np.sin(q[0]), -np.sin(q[1])], [np.cos(q[0]), np.cos(q[1])]])
    drift = -np.array([np.cos(q) @ np.square(u), np.sin(q) @ np.square(u)])
    return M, right, J, drift


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_a_free_chain_obeys_its_equations_of_motion(formulation):
    M, right, _, _ = bars(Q, U)
    _, solution = solved((), (), formulation=formulation)
    assert solution.du == pytest.approx(np.linalg.solve(M, right), rel=1e-13)
    assert solution.forces == ()


@pytest.mark.parametrize("formulation", [kane, lagrange])
@pytest.mark.parametrize("states", [(S.OPEN, S.FORWARD), (S.OPEN, S.PRESSED_BACKWARD)])
def test_known_friction_is_a_torque_against_its_direction(formulation, states):
    M, right, _, _ = bars(Q, U)
    torque = {S.FORWARD: -0.7, S.PRESSED_BACKWARD: 0.9}[states[1]]
    _, solution = solved((FLOOR, AT_A), states, formulation=formulation)
    assert solution.du == pytest.approx(
        np.linalg.solve(M, [right[0] + torque, right[1]]), rel=1e-13
    )
    assert solution.forces == ((0, 0), (0, torque))


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_a_sliding_contact_keeps_its_normal_and_is_braked_by_the_normal_force(formulation):
    M, right, J, drift = bars(Q, U)
    normal, tangent = -J[1], J[0]
    pushes = normal - 0.3 * tangent
    A = np.block([[M, -pushes[:, None]], [normal[None], np.zeros((1, 1))]])
    expected = np.linalg.solve(A, [*right, drift[1]])
    _, solution = solved((FLOOR,), (S.FORWARD,), formulation=formulation)
    assert solution.du == pytest.approx(expected[:2], rel=1e-12)
    assert solution.forces[0] == pytest.approx((expected[2], -0.3 * expected[2]), rel=1e-12)


def test_a_sticking_contact_takes_the_forces_that_stop_its_point():
    M, right, J, drift = bars(Q, U)
    du = np.linalg.solve(J, -drift)
    fx, fy = np.linalg.solve(J.T, M @ du - right)
    _, solution = solved((FLOOR,), (S.STICKS,))
    assert solution.du == pytest.approx(du, rel=1e-12)
    assert solution.forces[0] == pytest.approx((-fy, fx), rel=1e-12)


def test_a_stuck_joint_and_a_resting_contact_hold_the_chain():
    """With u = 0 both accelerations are zero; the forces carry the weight alone."""
    smooth = RigidContact("D on floor", UP, -2.0, 0.0)
    _, solution = solved((AT_B, smooth), (S.STICKS, S.CLOSED), u=(0.0, 0.0))
    _, right, J, _ = bars(Q, (0.0, 0.0))
    torque, push = np.linalg.solve(np.array([[-1, 1], -J[1]]).T, -right)
    assert solution.du == (0, 0)
    assert solution.forces[0].tangential == pytest.approx(torque)
    assert solution.forces[1].normal == pytest.approx(push)


def test_all_loads_together_give_the_acceleration_of_the_mode():
    """Newton and Euler again: the loads that are listed, put into inverse dynamics."""
    elements = FLOOR, AT_B
    pose, solution = solved(elements, (S.BACKWARD, S.FORWARD))
    loads = loads_of(pose, WEIGHT, elements, solution, U, 0.0)
    missing = kane.inverse_dynamics(BARS, Q, U, solution.du, loads)
    assert missing == pytest.approx((0, 0), abs=1e-12)


@pytest.mark.parametrize(
    ("elements", "states", "count"),
    [
        ((AT_A, AT_B), (S.FORWARD, S.BACKWARD), 0),
        ((AT_A, AT_B), (S.STICKS, S.BACKWARD), 1),
        ((FLOOR,), (S.FORWARD,), 1),
        ((FLOOR,), (S.STICKS,), 2),
        ((AT_A, FLOOR), (S.STICKS, S.PRESSED_FORWARD), 2),
    ],
)
def test_constraints_are_counted(elements, states, count):
    assert constraint_count(elements, states) == count


def test_stabilisation_pulls_a_point_back_as_a_critically_damped_spring():
    """c'' = −2 r c' − r² (c − bound), along the normal of a contact that rests."""
    rate, smooth = 5.0, RigidContact("D on floor", UP, -2.0, 0.0)
    _, solution = solved((smooth,), (S.CLOSED,), rate=rate)
    _, _, J, drift = bars(Q, U)
    place, speed = -np.sin(Q).sum(), -J[1] @ U
    acceleration = -(J[1] @ solution.du + drift[1])
    assert acceleration == pytest.approx(-2 * rate * speed - rate**2 * (place + 2.0), rel=1e-12)


def test_joints_and_held_chains_are_not_stabilised():
    for elements, states in [((AT_A,), (S.STICKS,)), ((FLOOR,), (S.STICKS,))]:
        _, with_rate = solved(elements, states, rate=5.0)
        _, without = solved(elements, states)
        assert with_rate.du == without.du


def test_elements_that_are_left_out_have_no_terms():
    pose = pose_of()
    equations = local_equations(pose, (), (FLOOR, AT_A), U, 0.0, (False, True), (0, 0))
    assert equations.terms[0] is None
    assert equations.terms[1].tangent.row == (1, 0)


DEEP = CompliantContact("D on cushion", UP, -0.2, KelvinVoigt(100.0, 3.0))
BALL = CompliantContact("D on ball", UP, -0.2, Hertz(1000.0))


def test_the_push_of_a_surface_is_that_of_the_depth():
    """Depth: −0.2 − (−sin q1 − sin q2); its rate is D's speed downwards."""
    depth, rate = np.sin(Q).sum() - 0.2, np.cos(Q) @ U
    pose = pose_of()
    assert push_of(pose, DEEP, None, U) == pytest.approx(100 * depth + 3 * rate)
    assert push_of(pose, BALL, None, U) == pytest.approx(1000 * depth**1.5)
    assert push_of(pose, BALL, None, U, root=0.1) == pytest.approx(1.0)
    assert push_of(pose, FLOOR, None, U) == push_of(pose, AT_A, None, U) == 0


def test_a_surface_above_the_point_does_not_pull_by_its_root():
    high = CompliantContact("D on ball", UP, -5.0, Hertz(1000.0))
    assert push_of(pose_of(), high, None, U) == 0


def test_a_dent_lowers_the_surface():
    from twolink.contact.elastoplastic import ElastoPlastic, Material

    material = Material(1e11, 0.01, 1e9, 0.3)
    steel = CompliantContact(
        "D on steel", UP, -0.2, Hertz(material.stiffness), memory=ElastoPlastic(material)
    )
    dent = PlasticState(Phase.DENTED, 500.0, 0.05, 1.0)
    depth = np.sin(Q).sum() - 0.2 - 0.05
    assert push_of(pose_of(), steel, dent, U) == pytest.approx(500 * depth**1.5)


def test_the_force_of_a_pressed_surface_acts_at_its_point():
    M, right, J, _ = bars(Q, U)
    push = 100 * (np.sin(Q).sum() - 0.2) + 3 * (np.cos(Q) @ U)
    _, solution = solved((DEEP,), (S.CLOSED,))
    assert solution.du == pytest.approx(np.linalg.solve(M, right - push * J[1]), rel=1e-12)
    assert solution.forces[0] == pytest.approx((push, 0))


def test_loads_are_scaled_in_their_size_only():
    assert scaled(Torque(2, 3.0), -2.0) == Torque(2, -6.0)
    assert scaled(Force(BARS.D, (3.0, 4.0)), 0.5) == Force(BARS.D, (1.5, 2.0))


def test_links_that_turn_on_their_own_answer_their_own_torques():
    """M = diag(3, 1/2): 6 N m at A and 1 N m at B, whose reaction acts on link 1."""
    system = system_of(JointTorque((6.0, 1.0)), chain=BALANCED)
    pose = pose_of(chain=BALANCED)
    solution = mode_solution(pose, system.effects, (), (), (), U, 0.0)
    assert solution.du == pytest.approx((5 / 3, 2.0))


def test_a_coordinate_is_fixed_by_one_of_the_same_point_or_by_any_two():
    chain = Chain.point_masses((1.0, 1.0), (1.0, 1.0))
    centre, joint = PointCoordinate("C2", UP.vector), JointCoordinate("A")
    assert is_fixed(UP, [centre], chain)
    assert not is_fixed(UP, [centre], BARS)
    assert not is_fixed(ALONG, [centre], chain)
    assert not is_fixed(UP, [], chain)
    assert not is_fixed(UP, [joint], chain)
    assert is_fixed(UP, [ALONG, joint], chain)
