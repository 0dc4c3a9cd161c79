"""Lagrange's equations of the chain, from its energies (section 6.2).

d/dt(∂T/∂q̇_r) − ∂T/∂q_r = Q_r (6.9), with T for any two links: I_A, I_C2 and the squared distance
of the centre from B replace mL²/3, mL²/12 and L²/4 of uniform bars. With the mass matrix M and
the velocity terms C u the left-hand side is M du + C u. Angles q are absolute; x points right, y
down; SI units throughout; u is q̇.

This module shares no code with `kane.py` and `kinematics.py`, so that their agreement is evidence
for all of them.
"""

from twolink.arithmetic import Matrix, Pair, Scalar, cos, sin, sine_and_cosine
from twolink.chain import Chain, Point
from twolink.loads import Force, Loads


def pivot_inertia(chain: Chain) -> Scalar:
    """Return I_A, the inertia of link 1 about A (kg m²)."""
    _, a, b = chain.C1
    return chain.I_C1 + chain.m1 * (a * a + b * b)


def elbow_inertia(chain: Chain) -> Scalar:
    """Return the inertia of link 2 about B (kg m²)."""
    _, a, b = chain.C2
    return chain.I_C2 + chain.m2 * (a * a + b * b)


def coupling(chain: Chain, q: Pair) -> Scalar:
    """Return the factor of q̇1 q̇2 in T (kg m²): m2 L1 times the centre of link 2, along link 1."""
    _, a, b = chain.C2
    elbow = q[1] - q[0]
    return chain.m2 * chain.L1 * (a * cos(elbow) - b * sin(elbow))


def coupling_slope(chain: Chain, q: Pair) -> Scalar:
    """Return the coupling's derivative by q2 (kg m²), the negative of that by q1."""
    _, a, b = chain.C2
    elbow = q[1] - q[0]
    return -chain.m2 * chain.L1 * (a * sin(elbow) + b * cos(elbow))


def kinetic_energies(chain: Chain, q: Pair, u: Pair) -> Pair:
    """Return T_1 and T_2 (J). T_2 has ω2 where the textbook prints ω1."""
    u1, u2 = u
    T1 = pivot_inertia(chain) * u1 * u1 / 2
    T2 = (
        elbow_inertia(chain) * u2 * u2 / 2
        + chain.m2 * chain.L1 * chain.L1 * u1 * u1 / 2
        + coupling(chain, q) * u1 * u2
    )
    return T1, T2


def kinetic_energy(chain: Chain, q: Pair, u: Pair) -> Scalar:
    """Return T = T_1 + T_2 (J) plus the energies of rotors."""
    T1, T2 = kinetic_energies(chain, q, u)
    T = T1 + T2
    for inertia, (w1, w2) in chain.rotors:
        speed = w1 * u[0] + w2 * u[1]
        T = T + inertia * speed * speed / 2
    return T


def momenta(chain: Chain, q: Pair, u: Pair) -> Pair:
    """Return ∂T/∂q̇_1 and ∂T/∂q̇_2 (kg m²/s)."""
    (M11, M12), (M21, M22) = mass_matrix(chain, q)
    u1, u2 = u
    return M11 * u1 + M12 * u2, M21 * u1 + M22 * u2


def momentum_rates(chain: Chain, q: Pair, u: Pair, du: Pair) -> Pair:
    """Return d/dt(∂T/∂q̇_1) and d/dt(∂T/∂q̇_2) (N m)."""
    (u1, u2), (du1, du2) = u, du
    (M11, M12), (M21, M22) = mass_matrix(chain, q)
    coupling_rate = coupling_slope(chain, q) * (u2 - u1)
    return (
        M11 * du1 + M12 * du2 + coupling_rate * u2,
        M21 * du1 + M22 * du2 + coupling_rate * u1,
    )


def energy_gradient(chain: Chain, q: Pair, u: Pair) -> Pair:
    """Return ∂T/∂q_1 and ∂T/∂q_2 (N m)."""
    u1, u2 = u
    slope = coupling_slope(chain, q) * u1 * u2
    return -slope, slope


def position_gradients(chain: Chain, q: Pair, point: Point) -> tuple[Pair, Pair]:
    """Return the vectors ∂r/∂q_1 and ∂r/∂q_2 of a point (m)."""
    q1, q2 = q
    link, a, b = point
    s1, c1 = sine_and_cosine(q1)
    if link == 1:
        return (-a * s1 - b * c1, a * c1 - b * s1), (0, 0)
    s2, c2 = sine_and_cosine(q2)
    return (-chain.L1 * s1, chain.L1 * c1), (-a * s2 - b * c2, a * c2 - b * s2)


def generalized_active_force(chain: Chain, q: Pair, loads: Loads) -> Pair:
    """Return Q_1 and Q_2 (N m): the work of each load per radian of q_1 and of q_2."""
    Q1 = Q2 = chain.scalar(0)
    for load in loads:
        if isinstance(load, Force):
            (x1, y1), (x2, y2) = position_gradients(chain, q, load.point)
            Fx, Fy = chain.scalars(load.components)
            Q1 = Q1 + (x1 * Fx + y1 * Fy)
            Q2 = Q2 + (x2 * Fx + y2 * Fy)
        elif load.link == 1:
            Q1 = Q1 + chain.scalar(load.moment)
        else:
            Q2 = Q2 + chain.scalar(load.moment)
    return Q1, Q2


def inverse_dynamics(chain: Chain, q: Pair, u: Pair, du: Pair, loads: Loads) -> Pair:
    """Return the generalized forces (N m) that must be added to `loads` to obtain du (rad/s²)."""
    rate1, rate2 = momentum_rates(chain, q, u, du)
    slope1, slope2 = energy_gradient(chain, q, u)
    Q1, Q2 = generalized_active_force(chain, q, loads)
    return rate1 - slope1 - Q1, rate2 - slope2 - Q2


def mass_matrix(chain: Chain, q: Pair) -> Matrix:
    """Return M (kg m²) = ∂²T/∂q̇∂q̇."""
    M11 = pivot_inertia(chain) + chain.m2 * chain.L1 * chain.L1
    M12 = coupling(chain, q)
    M22 = elbow_inertia(chain)
    for inertia, (w1, w2) in chain.rotors:
        M11, M12, M22 = M11 + inertia * w1 * w1, M12 + inertia * w1 * w2, M22 + inertia * w2 * w2
    return (M11, M12), (M12, M22)


def velocity_terms(chain: Chain, q: Pair, u: Pair) -> Pair:
    """Return C u (N m): the left-hand side of (6.9) without angular acceleration.

    The products u1 u2 cancel in d/dt(∂T/∂q̇) − ∂T/∂q and are omitted, which avoids their rounding.
    """
    u1, u2 = u
    slope = coupling_slope(chain, q)
    return slope * u2 * u2, -slope * u1 * u1


def coriolis_matrix(chain: Chain, q: Pair, u: Pair) -> Matrix:
    """Return C (kg m²/s) by Christoffel's symbols of the mass matrix; dM/dt − 2C is skew."""
    u1, u2 = u
    slope = coupling_slope(chain, q)
    return (0, slope * u2), (-slope * u1, 0)


def determinant(chain: Chain, q: Pair) -> Scalar:
    """Return det M (kg² m⁴) as a sum of non-negative terms, without cancellation.

    With M12² = (m2 L1)² (a² + b² − h²), h the distance of C2 from the line of link 1, M11 M22 −
    M12² is I_A I_B + m2 L1² (I_C2 + m2 h²).
    """
    _, a, b = chain.C2
    elbow = q[1] - q[0]
    s, c = sine_and_cosine(elbow)
    h = a * s + b * c
    det = pivot_inertia(chain) * elbow_inertia(chain) + chain.m2 * chain.L1 * chain.L1 * (
        chain.I_C2 + chain.m2 * h * h
    )
    # M + Σ J w wᵀ adds J wᵀ adj(M) w of each rotor, in which m2 L1² w2² − 2 M12 w1 w2 and
    # m2 |c2|² w1² make two squares, and a product of each two rotors.
    ahead = a * c - b * s
    for number, (inertia, (w1, w2)) in enumerate(chain.rotors):
        along, across = chain.L1 * w2 - ahead * w1, h * w1
        squares = chain.m2 * (along * along + across * across)
        links = pivot_inertia(chain) * w2 * w2 + chain.I_C2 * w1 * w1
        det = det + inertia * (links + squares)
        for other, (x1, x2) in chain.rotors[:number]:
            product = w1 * x2 - w2 * x1
            det = det + inertia * other * product * product
    return det


def forward_dynamics(chain: Chain, q: Pair, u: Pair, loads: Loads) -> Pair:
    """Return du (rad/s²) from (6.9), solved by Cramer's rule."""
    Q1, Q2 = generalized_active_force(chain, q, loads)
    Cu1, Cu2 = velocity_terms(chain, q, u)
    (M11, M12), (M21, M22) = mass_matrix(chain, q)
    r1, r2 = Q1 - Cu1, Q2 - Cu2
    det = determinant(chain, q)
    return (M22 * r1 - M12 * r2) / det, (M11 * r2 - M21 * r1) / det
