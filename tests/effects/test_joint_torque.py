import pytest

from tests.verification.chains import GENERAL
from twolink import kane, lagrange
from twolink.effects.joint_torque import JointTorque

Q, U = (0.3, -0.4), (1.1, -0.7)


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_the_power_of_a_motor_is_torque_times_joint_speed(formulation):
    """The motor at B turns by u2 − u1, and reacts on link 1."""
    tau = (2.0, -3.0)
    Q1, Q2 = formulation.generalized_active_force(GENERAL, Q, JointTorque(tau).loads(GENERAL, Q, U))
    power = Q1 * U[0] + Q2 * U[1]
    assert power == pytest.approx(tau[0] * U[0] + tau[1] * (U[1] - U[0]))


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_a_motor_at_the_elbow_alone_turns_the_links_apart(formulation):
    du1, du2 = formulation.forward_dynamics(
        GENERAL, Q, (0.0, 0.0), JointTorque((0.0, 1.0)).loads(GENERAL, Q, U)
    )
    assert du1 < 0 < du2
