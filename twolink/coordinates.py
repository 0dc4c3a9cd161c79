"""Absolute angles of the equations and joint angles of URDFs and engines.

The equations measure both links from the x-axis (q1, q2). A URDF measures each link from the
previous one (θ1, θ2), about an axis of either sign, from an arbitrary zero pose:

    q1 = s1 θ1 + φ1            q2 = q1 + s2 θ2 + φ2            s1, s2 = ±1

With the constant Jacobian S = ∂q/∂θ = [[s1, 0], [s1, s2]], speeds and accelerations map by S,
generalized forces by Sᵀ, and the mass matrix by Sᵀ M S.
"""

from dataclasses import dataclass

from twolink.arithmetic import Matrix, Pair
from twolink.inputs import as_pair, as_real, refuse


@dataclass(frozen=True)
class JointConvention:
    """The signs and offsets that relate joint angles θ to absolute angles q.

    `sign` is s1, s2 (each +1 or -1); `offset` is φ1, φ2 in rad. Every method takes and returns
    pairs whose entries have any scalar type, or arrays of one shape. Raises `ParameterError` for
    other signs, and for offsets that are not finite.
    """

    sign: tuple[int, int] = (1, 1)
    offset: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Check both pairs, and keep them as whole numbers and floats."""
        wanted = "a pair of signs, each 1 or -1"
        signs = as_pair("sign", self.sign, wanted)
        if not all(sign in (1, -1) for sign in signs):
            refuse("sign", self.sign, wanted)
        offsets = as_pair("offset", self.offset, "a pair of angles in rad")
        finite = (as_real(f"offset[{k}]", angle) for k, angle in enumerate(offsets))
        object.__setattr__(self, "sign", tuple(map(int, signs)))
        object.__setattr__(self, "offset", tuple(finite))

    def absolute_angles(self, joint_angles: Pair) -> Pair:
        """Return q1, q2 (rad) of the joint angles θ1, θ2 (rad)."""
        (s1, s2), (phi1, phi2) = self.sign, self.offset
        theta1, theta2 = joint_angles
        q1 = s1 * theta1 + phi1
        return q1, q1 + (s2 * theta2 + phi2)

    def joint_angles(self, absolute_angles: Pair) -> Pair:
        """Return θ1, θ2 (rad) of the absolute angles q1, q2 (rad)."""
        (s1, s2), (phi1, phi2) = self.sign, self.offset
        q1, q2 = absolute_angles
        return s1 * (q1 - phi1), s2 * (q2 - q1 - phi2)

    def absolute_speeds(self, joint_speeds: Pair) -> Pair:
        """Return S x: absolute speeds of joint speeds (rad/s), or accelerations (rad/s²)."""
        s1, s2 = self.sign
        x1, x2 = joint_speeds
        return s1 * x1, s1 * x1 + s2 * x2

    def joint_speeds(self, absolute_speeds: Pair) -> Pair:
        """Return S⁻¹ x: joint speeds of absolute speeds (rad/s), or accelerations (rad/s²)."""
        s1, s2 = self.sign
        x1, x2 = absolute_speeds
        return s1 * x1, s2 * (x2 - x1)

    def joint_forces(self, generalized_forces: Pair) -> Pair:
        """Return Sᵀ Q: the joint torques (N m) of the generalized forces Q1, Q2 (N m)."""
        s1, s2 = self.sign
        Q1, Q2 = generalized_forces
        return s1 * (Q1 + Q2), s2 * Q2

    def generalized_forces(self, joint_forces: Pair) -> Pair:
        """Return S⁻ᵀ τ: the generalized forces Q1, Q2 (N m) of the joint torques (N m)."""
        s1, s2 = self.sign
        tau1, tau2 = joint_forces
        return s1 * tau1 - s2 * tau2, s2 * tau2

    def joint_matrix(self, matrix: Matrix) -> Matrix:
        """Return Sᵀ A S of a matrix A over (q1, q2), such as the mass matrix (kg m²)."""
        s1, s2 = self.sign
        (A11, A12), (A21, A22) = matrix
        return (
            (A11 + A12 + A21 + A22, s1 * s2 * (A12 + A22)),
            (s1 * s2 * (A21 + A22), A22),
        )

    def joint_columns(self, rows: tuple[Pair, ...]) -> tuple[Pair, ...]:
        """Return J S of a Jacobian J over (q1, q2), given and returned as rows."""
        s1, s2 = self.sign
        return tuple((s1 * (J1 + J2), s2 * J2) for J1, J2 in rows)
