"""The formulas of section 6.1 for uniform bars against the general ones."""

from math import cos, sin

import pytest

from twolink import kinematics
from twolink.chain import Chain

CHAIN = Chain.uniform_bars((1.3, 0.7), (0.9, 1.4))
L1, L2 = CHAIN.length
Q = q1, q2 = 0.3, -0.4
U = u1, u2 = 1.1, -0.7
DU = du1, du2 = 2.0, 0.5


def test_positions_as_printed():
    assert kinematics.position(CHAIN, Q, CHAIN.C1) == pytest.approx(
        (L1 / 2 * cos(q1), L1 / 2 * sin(q1))
    )
    assert kinematics.position(CHAIN, Q, CHAIN.C2) == pytest.approx(
        (L1 * cos(q1) + L2 / 2 * cos(q2), L1 * sin(q1) + L2 / 2 * sin(q2))
    )
    assert kinematics.position(CHAIN, Q, CHAIN.D) == pytest.approx(
        (L1 * cos(q1) + L2 * cos(q2), L1 * sin(q1) + L2 * sin(q2))
    )


def test_velocities_as_printed():
    assert kinematics.velocity(CHAIN, Q, U, CHAIN.C1) == pytest.approx(
        (-L1 / 2 * u1 * sin(q1), L1 / 2 * u1 * cos(q1))
    )
    assert kinematics.velocity(CHAIN, Q, U, CHAIN.C2) == pytest.approx(
        (
            -L1 * u1 * sin(q1) - L2 / 2 * u2 * sin(q2),
            L1 * u1 * cos(q1) + L2 / 2 * u2 * cos(q2),
        )
    )
    assert kinematics.velocity(CHAIN, Q, U, CHAIN.D) == pytest.approx(
        (-L1 * u1 * sin(q1) - L2 * u2 * sin(q2), L1 * u1 * cos(q1) + L2 * u2 * cos(q2))
    )


def test_accelerations_as_printed():
    assert kinematics.acceleration(CHAIN, Q, U, DU, CHAIN.C1) == pytest.approx(
        (
            -L1 / 2 * du1 * sin(q1) - L1 / 2 * u1**2 * cos(q1),
            L1 / 2 * du1 * cos(q1) - L1 / 2 * u1**2 * sin(q1),
        )
    )
    for length, point in ((L2 / 2, CHAIN.C2), (L2, CHAIN.D)):
        assert kinematics.acceleration(CHAIN, Q, U, DU, point) == pytest.approx(
            (
                -L1 * du1 * sin(q1)
                - L1 * u1**2 * cos(q1)
                - length * du2 * sin(q2)
                - length * u2**2 * cos(q2),
                L1 * du1 * cos(q1)
                - L1 * u1**2 * sin(q1)
                + length * du2 * cos(q2)
                - length * u2**2 * sin(q2),
            )
        )


def test_angular_motion_as_printed():
    assert kinematics.angular_velocities(U) == U
    assert kinematics.angular_accelerations(DU) == DU


def test_the_frame_has_y_downward():
    """At q = (π/2, π/2) the chain hangs straight down: y positive."""
    hanging = (1.5707963267948966, 1.5707963267948966)
    assert kinematics.position(CHAIN, hanging, CHAIN.D) == pytest.approx((0, L1 + L2))
