"""Kane's dynamical equations of the chain, step by step (section 6.1).

K_in is the generalized inertia force, Q the generalized active force, and the equations of motion
are K_in + Q = 0 (6.8). With the mass matrix M and the velocity terms C u,
−K_in = M du + C u. Angles q are absolute; x points right, y down; SI units throughout.

This module shares no code with `lagrange.py`, so that their agreement is evidence for both.
"""

from typing import NamedTuple

from twolink.arithmetic import Matrix, Pair, Scalar, cos, sin
from twolink.chain import Chain, Point
from twolink.kinematics import acceleration, angular_accelerations
from twolink.loads import Force, Loads

# ∂ω_k/∂u_r of link k: each link rotates with its own generalized speed.
PARTIAL_ANGULAR_VELOCITY = {1: (1, 0), 2: (0, 1)}


class PartialVelocities(NamedTuple):
    """The vectors ∂v/∂u1 and ∂v/∂u2 of a point (m)."""

    u1: Pair
    u2: Pair


def partial_velocities(chain: Chain, q: Pair, point: Point) -> PartialVelocities:
    """Return ∂v/∂u1 and ∂v/∂u2 of a point (m), the projection vectors of (6.2)."""
    q1, q2 = q
    _, a, b = point
    s1, c1 = sin(q1), cos(q1)
    if point.link == 1:
        return PartialVelocities((-a * s1 - b * c1, a * c1 - b * s1), (0, 0))
    s2, c2 = sin(q2), cos(q2)
    return PartialVelocities(
        (-chain.L1 * s1, chain.L1 * c1),
        (-a * s2 - b * c2, a * c2 - b * s2),
    )


def inertia_forces(chain: Chain, q: Pair, u: Pair, du: Pair) -> tuple[Pair, Pair]:
    """Return F_in of link 1 and link 2 (N): −m a_C, by (6.3)."""
    ax1, ay1 = acceleration(chain, q, u, du, chain.C1)
    ax2, ay2 = acceleration(chain, q, u, du, chain.C2)
    return (-chain.m1 * ax1, -chain.m1 * ay1), (-chain.m2 * ax2, -chain.m2 * ay2)


def inertia_torques(chain: Chain, du: Pair) -> Pair:
    """Return T_in of link 1 and link 2 about z (N m): −I_C α, by (6.4) for plane motion."""
    alpha1, alpha2 = angular_accelerations(du)
    return -chain.I_C1 * alpha1, -chain.I_C2 * alpha2


def generalized_inertia_force(chain: Chain, q: Pair, u: Pair, du: Pair) -> Pair:
    """Return K_in,1 and K_in,2 (N m), by (6.7)."""
    F_in1, F_in2 = inertia_forces(chain, q, u, du)
    T_in1, T_in2 = inertia_torques(chain, du)
    v_C1 = partial_velocities(chain, q, chain.C1)
    v_C2 = partial_velocities(chain, q, chain.C2)
    omega1, omega2 = PARTIAL_ANGULAR_VELOCITY[1], PARTIAL_ANGULAR_VELOCITY[2]
    K_in1 = _dot(v_C1.u1, F_in1) + omega1[0] * T_in1 + _dot(v_C2.u1, F_in2) + omega2[0] * T_in2
    K_in2 = _dot(v_C1.u2, F_in1) + omega1[1] * T_in1 + _dot(v_C2.u2, F_in2) + omega2[1] * T_in2
    for inertia, omega in chain.rotors:
        # A rotor has the partial angular velocity ω = (w1, w2), and −J α as its inertia torque.
        T_in = -inertia * (omega[0] * du[0] + omega[1] * du[1])
        K_in1, K_in2 = K_in1 + omega[0] * T_in, K_in2 + omega[1] * T_in
    return K_in1, K_in2


def generalized_active_force(chain: Chain, q: Pair, loads: Loads) -> Pair:
    """Return Q_1 and Q_2 (N m): each load projected on the partial velocities of its point."""
    Q1 = Q2 = chain.scalar(0)
    for load in loads:
        if isinstance(load, Force):
            v = partial_velocities(chain, q, load.point)
            components = chain.scalars(load.components)
            Q1 = Q1 + _dot(v.u1, components)
            Q2 = Q2 + _dot(v.u2, components)
        else:
            omega, moment = PARTIAL_ANGULAR_VELOCITY[load.link], chain.scalar(load.moment)
            Q1 = Q1 + omega[0] * moment
            Q2 = Q2 + omega[1] * moment
    return Q1, Q2


def inverse_dynamics(chain: Chain, q: Pair, u: Pair, du: Pair, loads: Loads) -> Pair:
    """Return the generalized forces (N m) that must be added to `loads` to obtain du (rad/s²)."""
    K_in1, K_in2 = generalized_inertia_force(chain, q, u, du)
    Q1, Q2 = generalized_active_force(chain, q, loads)
    return -K_in1 - Q1, -K_in2 - Q2


def mass_matrix(chain: Chain, q: Pair) -> Matrix:
    """Return M (kg m²) = −∂K_in/∂du: products of partial velocities, by (6.3), (6.4) and (6.7).

    The length of a partial velocity is the distance of its point from the pivot of the speed, so
    its product with itself is a squared radius.
    """
    v_C2 = partial_velocities(chain, q, chain.C2)
    M11 = chain.I_C1 + chain.m1 * _squared_radius(chain.C1) + chain.m2 * chain.L1 * chain.L1
    M12 = chain.m2 * _dot(v_C2.u1, v_C2.u2)
    M22 = chain.I_C2 + chain.m2 * _squared_radius(chain.C2)
    for inertia, (w1, w2) in chain.rotors:
        M11, M12, M22 = M11 + inertia * w1 * w1, M12 + inertia * w1 * w2, M22 + inertia * w2 * w2
    return (M11, M12), (M12, M22)


def velocity_terms(chain: Chain, q: Pair, u: Pair) -> Pair:
    """Return C u (N m): −K_in of the motion without angular acceleration."""
    K_in1, K_in2 = generalized_inertia_force(chain, q, u, (0, 0))
    return -K_in1, -K_in2


def coriolis_matrix(chain: Chain, q: Pair, u: Pair) -> Matrix:
    """Return C (kg m²/s) = Σ m ∂v_C/∂u_r · d(∂v_C/∂u_s)/dt, which makes dM/dt − 2C skew."""
    v_C2 = partial_velocities(chain, q, chain.C2)
    # A vector v fixed to a link of angular velocity ω has the rate ω **k** × v, perpendicular to v,
    # so the diagonal of C is zero.
    C12 = chain.m2 * _dot(v_C2.u1, _turned(v_C2.u2, u[1]))
    C21 = chain.m2 * _dot(v_C2.u2, _turned(v_C2.u1, u[0]))
    return (0, C12), (C21, 0)


def determinant(chain: Chain, q: Pair) -> Scalar:
    """Return det M (kg² m⁴) as a sum of squares, without cancellation.

    M is a sum of squares of partial velocities, so (Cauchy and Binet) det M is the sum, over all
    pairs of their components, of the squared 2 × 2 minor times both weights. Summed over
    components, a squared minor is a product of squared lengths, or a squared cross product.
    """
    m1, m2, I_C1, I_C2 = chain.m1, chain.m2, chain.I_C1, chain.I_C2
    link1 = I_C1 + m1 * _squared_radius(chain.C1)
    link2 = I_C2 + m2 * _squared_radius(chain.C2)
    # ∂v_C2/∂u1 × ∂v_C2/∂u2 by the angle between them, accurate even if they are nearly parallel.
    _, a, b = chain.C2
    elbow = q[1] - q[0]
    cross = chain.L1 * (a * sin(elbow) + b * cos(elbow))
    det = link1 * link2 + m2 * (chain.L1 * chain.L1 * I_C2 + m2 * (cross * cross))
    for number, (inertia, (w1, w2)) in enumerate(chain.rotors):
        # A rotor's minors with the links' angular velocities and the components of their centres.
        v1, v2 = partial_velocities(chain, q, chain.C2)
        across = v1[0] * w2 - v2[0] * w1, v1[1] * w2 - v2[1] * w1
        minors = link1 * w2 * w2 + I_C2 * w1 * w1 + m2 * _dot(across, across)
        det = det + inertia * minors
        for other, (x1, x2) in chain.rotors[:number]:
            minor = w1 * x2 - w2 * x1
            det = det + inertia * other * minor * minor
    return det


def forward_dynamics(chain: Chain, q: Pair, u: Pair, loads: Loads) -> Pair:
    """Return du (rad/s²) from K_in + Q = 0 (6.8), solved by Cramer's rule."""
    Q1, Q2 = generalized_active_force(chain, q, loads)
    Cu1, Cu2 = velocity_terms(chain, q, u)
    (M11, M12), (_, M22) = mass_matrix(chain, q)
    r1, r2 = Q1 - Cu1, Q2 - Cu2
    det = determinant(chain, q)
    return (M22 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det


def kinetic_energy(chain: Chain, q: Pair, u: Pair) -> Scalar:
    """Return T = ½ uᵀ M u (J), with M from the partial velocities."""
    (M11, M12), (_, M22) = mass_matrix(chain, q)
    u1, u2 = u
    return (M11 * u1 * u1 + M22 * u2 * u2) / 2 + M12 * u1 * u2


def _dot(v: Pair, w: Pair) -> Scalar:
    return v[0] * w[0] + v[1] * w[1]


def _turned(v: Pair, omega: Scalar) -> Pair:
    """Return ω **k** × v."""
    return -omega * v[1], omega * v[0]


def _squared_radius(point: Point) -> Scalar:
    _, a, b = point
    return a * a + b * b
