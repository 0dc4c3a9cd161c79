"""Positions, velocities and accelerations of the chain's points (section 6.1).

A point has coordinates (a, b) along and across its link; loads may act on any such point. C1, C2
and D of uniform bars have b = 0 and a = L1/2, L2/2 and L2.

The x-axis points right, the y-axis down; vectors are pairs (x, y). Angles q are absolute (rad),
u = dq/dt (rad/s) and du = d²q/dt² (rad/s²). Entries may have any scalar type, or be arrays.
"""

from twolink.arithmetic import Pair, cos, sin, sine_and_cosine
from twolink.chain import Chain, Point


def position(chain: Chain, q: Pair, point: Point) -> Pair:
    """Return the position vector r of a point (m)."""
    q1, q2 = q
    link, a, b = point
    s1, c1 = sine_and_cosine(q1)
    if link == 1:
        return a * c1 - b * s1, a * s1 + b * c1
    s2, c2 = sine_and_cosine(q2)
    return chain.L1 * c1 + a * c2 - b * s2, chain.L1 * s1 + a * s2 + b * c2


def velocity(chain: Chain, q: Pair, u: Pair, point: Point) -> Pair:
    """Return the velocity vector v of a point (m/s)."""
    (q1, q2), (u1, u2) = q, u
    _, a, b = point
    if point.link == 1:
        vx = -a * u1 * sin(q1) - b * u1 * cos(q1)
        vy = a * u1 * cos(q1) - b * u1 * sin(q1)
    else:
        vx = -chain.L1 * u1 * sin(q1) - a * u2 * sin(q2) - b * u2 * cos(q2)
        vy = chain.L1 * u1 * cos(q1) + a * u2 * cos(q2) - b * u2 * sin(q2)
    return vx, vy


def acceleration(chain: Chain, q: Pair, u: Pair, du: Pair, point: Point) -> Pair:
    """Return the acceleration vector a of a point (m/s²)."""
    (q1, q2), (u1, u2), (du1, du2) = q, u, du
    s1, c1 = sin(q1), cos(q1)
    _, a, b = point
    if point.link == 1:
        ax = -a * (du1 * s1 + u1 * u1 * c1) - b * (du1 * c1 - u1 * u1 * s1)
        ay = a * (du1 * c1 - u1 * u1 * s1) - b * (du1 * s1 + u1 * u1 * c1)
    else:
        s2, c2 = sin(q2), cos(q2)
        ax = (
            -chain.L1 * (du1 * s1 + u1 * u1 * c1)
            - a * (du2 * s2 + u2 * u2 * c2)
            - b * (du2 * c2 - u2 * u2 * s2)
        )
        ay = (
            chain.L1 * (du1 * c1 - u1 * u1 * s1)
            + a * (du2 * c2 - u2 * u2 * s2)
            - b * (du2 * s2 + u2 * u2 * c2)
        )
    return ax, ay


def angular_velocities(u: Pair) -> Pair:
    """Return ω1, ω2, the angular velocities of the links about **k** (rad/s)."""
    u1, u2 = u
    return u1, u2


def angular_accelerations(du: Pair) -> Pair:
    """Return α1, α2, the angular accelerations of the links about **k** (rad/s²)."""
    du1, du2 = du
    return du1, du2
