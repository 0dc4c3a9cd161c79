import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink import lagrange
from twolink.coordinates import JointConvention
from twolink.errors import ParameterError

CONVENTIONS = [
    JointConvention(),
    JointConvention((1, -1), (0.3, -0.2)),
    JointConvention((-1, 1), (-1.5, 0.4)),
    JointConvention((-1, -1), (3.0, 2.0)),
]
THETA, THETA_DOT, TAU = (0.7, -1.1), (2.0, 3.0), (0.4, -0.9)


@pytest.fixture(params=CONVENTIONS, ids=str)
def joints(request):
    return request.param


def jacobian(joints):
    """S = ∂q/∂θ, from the angles alone."""
    zero = np.array(joints.absolute_angles((0.0, 0.0)))
    return np.stack(
        [np.array(joints.absolute_angles(unit)) - zero for unit in ((1.0, 0.0), (0.0, 1.0))], axis=1
    )


def test_joint_angles_are_the_inverse_of_absolute_angles(joints):
    assert joints.joint_angles(joints.absolute_angles(THETA)) == pytest.approx(THETA)


def test_speeds_map_by_the_jacobian(joints):
    S = jacobian(joints)
    assert joints.absolute_speeds(THETA_DOT) == pytest.approx(tuple(S @ THETA_DOT))
    assert joints.joint_speeds(joints.absolute_speeds(THETA_DOT)) == pytest.approx(THETA_DOT)


def test_forces_map_by_its_transpose(joints):
    Q = joints.generalized_forces(TAU)
    assert joints.joint_forces(Q) == pytest.approx(TAU)
    assert tuple(jacobian(joints).T @ Q) == pytest.approx(TAU)


def test_power_is_the_same_in_both(joints):
    u, Q = joints.absolute_speeds(THETA_DOT), joints.generalized_forces(TAU)
    assert np.dot(u, Q) == pytest.approx(np.dot(THETA_DOT, TAU))


def test_matrices_map_on_both_sides(joints):
    S = jacobian(joints)
    M = lagrange.mass_matrix(GENERAL, joints.absolute_angles(THETA))
    assert np.array(joints.joint_matrix(M)) == pytest.approx(S.T @ M @ S)
    rows = ((1.0, 2.0), (3.0, -4.0))
    assert np.array(joints.joint_columns(rows)) == pytest.approx(np.array(rows) @ S)
    lopsided = ((1.0, 2.0), (5.0, -4.0))
    assert np.array(joints.joint_matrix(lopsided)) == pytest.approx(S.T @ lopsided @ S)


@pytest.mark.parametrize(
    ("sign", "offset", "sentence"),
    [
        ((2, 1), (0.0, 0.0), r"sign must be a pair of signs, each 1 or -1; got \(2, 1\)"),
        ((0, 1), (0.0, 0.0), "sign must be a pair of signs"),
        ((1,), (0.0, 0.0), "sign must be a pair of signs"),
        ("ab", (0.0, 0.0), "sign must be a pair of signs, each 1 or -1; got 'ab'"),
        ((1, 1), (float("nan"), 0.0), r"offset\[0\] must be a finite real number; got nan"),
        ((1, 1), (0.0, 0.0, 0.0), "offset must be a pair of angles in rad"),
        ((1, 1), 0.5, r"offset must be a pair of angles in rad; got 0\.5"),
    ],
)
def test_other_signs_and_offsets_are_refused(sign, offset, sentence):
    with pytest.raises(ParameterError, match=sentence):
        JointConvention(sign, offset)


def test_arrays_of_signs_and_offsets_become_tuples():
    joints = JointConvention(np.array([1.0, -1.0]), np.array([0.5, 1]))
    assert joints == JointConvention((1, -1), (0.5, 1.0))
    assert hash(joints) == hash(JointConvention((1, -1), (0.5, 1.0)))
