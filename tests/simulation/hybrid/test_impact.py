"""Impacts against the balance of momentum by NumPy, the laws as they are worded, and by hand."""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import BARS, system_of
from twolink import kane, lagrange
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elements import RigidContact
from twolink.contact.impact_laws import LAWS
from twolink.effects.surface import Surface
from twolink.simulation.hybrid.impact import (
    Impacts,
    approach,
    at_rest,
    is_left_over,
    placed,
    speed_along,
    stopped,
)
from twolink.simulation.hybrid.pose import Pose

EPSILON = 2.0**-52
UP, ALONG = PointCoordinate("D", (0.0, -1.0)), PointCoordinate("D", (1.0, 0.0))
ELBOW_UP, ELBOW_ALONG = PointCoordinate("B", (0.0, -1.0)), PointCoordinate("B", (1.0, 0.0))
AT_A, AT_B = JointCoordinate("A"), JointCoordinate("B")
Q = (0.7, -0.4)


def stop(coordinate, e=0.0):
    return RigidContact("stop", coordinate, 0.0, e)


def floor(e=0.0, mu=0.0, law="stronge", normal=UP, tangent=ALONG):
    return RigidContact("floor", normal, 0.0, e, tangent if mu else None, mu, mu, law)


def impacts_of(*elements, chain=BARS, q=Q, formulation=lagrange):
    return Impacts(Pose(chain, formulation, q), elements, 0.5, EPSILON)


def mass_matrix(chain, q):
    """Return M from the kinetic energy, whose second differences it is."""

    def energy(u):
        return float(lagrange.kinetic_energy(chain, q, u))

    M11, M22 = 2 * energy((1.0, 0.0)), 2 * energy((0.0, 1.0))
    M12 = energy((1.0, 1.0)) - (M11 + M22) / 2
    return np.array([[M11, M12], [M12, M22]])


def end_rows(q):
    """Return D's rows along −y and x on bars of 1 m."""
    return -np.cos(q), -np.sin(q)


def unbalanced(chain, q, strike, normal, tangent=(0.0, 0.0)):
    """Return M du − Jᵀ Λ of an impact (N m s)."""
    du = np.subtract(strike.u[1], strike.u[0])
    impulse = strike.impulse
    given = impulse.normal * np.array(normal) + impulse.tangential * np.array(tangent)
    return mass_matrix(chain, q) @ du - given


def energy(chain, q, u):
    return float(lagrange.kinetic_energy(chain, q, u))


def approaches(random, row):
    """Return speeds that approach along a row."""
    while True:
        u = random.normal(size=2) * 3
        if row @ u < -0.1:
            return tuple(u)


# Speeds that are zero.


def test_a_speed_is_zero_within_the_rounding_of_its_terms():
    assert at_rest((1.0, -1.0), (3.0, 3.0 + 4e-16), EPSILON, 2.0)
    assert at_rest((1.0, -1.0), (0.0, 0.0), EPSILON, 2.0)
    assert not at_rest((1.0, -1.0), (3.0, 3.0 + 1e-12), EPSILON, 2.0)
    assert not at_rest((1.0, 0.0), (1e-300, 5.0), EPSILON, 2.0)


def test_a_speed_is_residual_if_it_is_within_the_round_off_of_the_speeds_before():
    assert is_left_over((1.0, 0.0), (1e-16, 1.0), (1.0, 1.0), EPSILON)
    assert not is_left_over((1.0, 0.0), (1e-16, 1.0), (1e-4, 1e-4), EPSILON)


def test_a_contact_is_approached_only_by_more_than_rounding():
    row = impacts_of(stop(AT_B)).row(0)
    assert approach(row, (3.0, 2.0), EPSILON, 2.0) == -1.0
    assert approach(row, (2.0, 3.0), EPSILON, 2.0) == 0
    assert approach(row, (3.0, 3.0 - 4e-16), EPSILON, 2.0) == 0
    # A row that is the rounding of a pose is zero.
    assert approach((0.0, -6e-17), (0.0, 1.0), EPSILON, 2.0) == 0
    assert at_rest((0.0, -6e-17), (0.0, 1.0), EPSILON, 2.0)


# Places and speeds that are put right.


@pytest.mark.parametrize(
    ("coordinate", "expected"),
    [
        (AT_A, (0.25, 2.0)),
        (JointCoordinate("A", -1), (-0.25, 2.0)),
        (AT_B, (1.0, 1.25)),
        (JointCoordinate("B", -1), (1.0, 0.75)),
    ],
)
def test_a_joint_is_placed_exactly_at_its_bound(coordinate, expected):
    assert placed(Pose(BARS, lagrange, (1.0, 2.0)), coordinate, 0.25, EPSILON, EPSILON) == expected


@pytest.mark.parametrize("error", [1e-15, 1e-12, -1e-10])
def test_a_point_is_placed_at_its_bound_by_the_shortest_way(error):
    bound = -math.sin(Q[0]) - math.sin(Q[1]) + error
    q = placed(Pose(BARS, lagrange, Q), UP, bound, EPSILON, EPSILON)
    assert -math.sin(q[0]) - math.sin(q[1]) == pytest.approx(bound, abs=4 * EPSILON)
    # Along the gradient: no motion across it.
    row = end_rows(Q)[0]
    moved = np.subtract(q, Q)
    assert abs(moved[0] * row[1] - moved[1] * row[0]) < 1e-15


def test_a_point_that_cannot_move_to_its_bound_stays():
    stretched = Pose(BARS, lagrange, (0.0, 0.0))
    assert placed(stretched, ALONG, 2.0 + 1e-15, EPSILON, EPSILON) == (0.0, 0.0)


def test_speeds_along_coordinates_are_stopped_exactly():
    pose, u = Pose(BARS, lagrange, Q), (1.5, -0.5)
    assert stopped(pose, [AT_A], u, 2.0**-52) == (0.0, -0.5)
    assert stopped(pose, [AT_B], u, 2.0**-52) == (1.5, 1.5)
    assert stopped(pose, [UP, ALONG], u, 2.0**-52) == (0.0, 0.0)
    assert stopped(pose, [AT_A, AT_B], u, 2.0**-52) == (0.0, 0.0)
    assert stopped(pose, [AT_A, JointCoordinate("A", -1)], u, 2.0**-52) == (0.0, -0.5)


def test_stopping_a_point_changes_speeds_along_its_row_only():
    row = end_rows(Q)[0]
    u = tuple((np.array([-row[1], row[0]]) + 1e-11 * row).tolist())
    after = stopped(Pose(BARS, lagrange, Q), [UP], u, 2.0**-52)
    assert row @ after == pytest.approx(0, abs=1e-15)
    assert np.subtract(u, after) == pytest.approx(1e-11 * row, rel=1e-4)


def test_a_speed_beyond_round_off_is_not_removed():
    u = (1.5, -0.5)
    assert stopped(Pose(BARS, lagrange, Q), [UP], u, 2.0**-52) == u


# One impact.


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_a_smooth_impact_turns_the_normal_speed_and_balances_momentum(formulation, random):
    normal, _ = end_rows(Q)
    for e in (0.0, 0.4, 1.0):
        u = approaches(random, normal)
        strike = impacts_of(floor(e), formulation=formulation).impact(0, u)
        assert strike.speeds == pytest.approx((normal @ u, -e * (normal @ u)), abs=1e-14)
        assert unbalanced(BARS, Q, strike, normal) == pytest.approx((0, 0), abs=1e-13)
        assert strike.impulse.regime == "frictionless"


@pytest.mark.parametrize("law", LAWS)
def test_a_rough_impact_balances_momentum_and_obeys_coulombs_cone(law, random):
    normal, tangent = end_rows(Q)
    for mu in (0.1, 0.5, 2.0):
        for _ in range(20):
            u = approaches(random, normal)
            strike = impacts_of(floor(0.5, mu, law)).impact(0, u)
            assert unbalanced(BARS, Q, strike, normal, tangent) == pytest.approx((0, 0), abs=1e-11)
            assert strike.impulse.normal > 0
            assert abs(strike.impulse.tangential) <= mu * strike.impulse.normal * (1 + 1e-12)
            assert strike.speeds[1] >= 0
            assert strike.sliding == pytest.approx((tangent @ u, tangent @ strike.u[1]))


@pytest.mark.parametrize("law", ["poisson", "stronge"])
def test_no_impact_creates_energy(law, random):
    normal, _ = end_rows(Q)
    for mu in (0.0, 0.1, 0.5, 2.0):
        for e in (0.0, 0.5, 1.0):
            for _ in range(10):
                u = approaches(random, normal)
                after = impacts_of(floor(e, mu, law)).impact(0, u).u[1]
                assert energy(BARS, Q, after) <= energy(BARS, Q, u) * (1 + 1e-13)


def test_a_point_of_link_1_is_struck_along_its_line(random):
    """Both speeds of B are one, so its friction is that of sliding in, and of sliding out."""
    q = (0.9, -0.4)
    normal, tangent = np.array([-math.cos(0.9), 0.0]), np.array([-math.sin(0.9), 0.0])
    element = floor(0.5, 0.3, normal=ELBOW_UP, tangent=ELBOW_ALONG)
    for _ in range(20):
        u = approaches(random, normal)
        strike = impacts_of(element, q=q).impact(0, u)
        assert unbalanced(BARS, q, strike, normal, tangent) == pytest.approx((0, 0), abs=1e-12)
        assert strike.sliding[1] == pytest.approx(strike.speeds[1] * math.tan(0.9))
        assert energy(BARS, q, strike.u[1]) <= energy(BARS, q, u)


def test_a_point_that_cannot_slide_in_its_pose_is_struck_without_friction():
    """Stretched along x, D moves along y only."""
    strike = impacts_of(floor(0.5, 0.8), q=(0.0, 0.0)).impact(0, (1.0, 1.0))
    assert strike.impulse.regime == "frictionless"
    assert strike.speeds == pytest.approx((-2.0, 1.0))


def test_a_fully_sticking_impact_leaves_exactly_zero_speeds():
    """e = 0, and friction at which D sticks: no round-off of the old speeds remains."""
    strike = impacts_of(floor(0.0, 50.0)).impact(0, (1.0, 0.2))
    assert strike.impulse.regime.endswith("sticks")
    assert strike.u[1] == (0.0, 0.0)


def test_a_locked_slide_is_ended_by_its_own_friction():
    """In the limit a push has no normal response, and its impulse takes all of the momenta."""
    q = (1.1, 1.3)
    normal, tangent = end_rows(q)
    M = np.array(mass_matrix(BARS, q))
    answer = np.linalg.solve(M, normal)
    mu = float(normal @ answer / abs(tangent @ answer))
    direction = 1 if tangent @ answer > 0 else -1
    u = tuple(np.linalg.solve([normal, tangent], [0.0, 0.2 * direction]))
    impacts = impacts_of(floor(0.5, mu), q=q)
    strike = impacts.locked(0, u, direction)
    assert strike.u[1] == (0.0, 0.0)
    assert strike.impulse.normal > 0
    assert strike.impulse.tangential == pytest.approx(-direction * mu * strike.impulse.normal)
    given = strike.impulse.normal * (normal - direction * mu * tangent)
    assert given == pytest.approx(-M @ u)
    assert impacts.stops(strike)
    # In the other direction friction answers a push, and cannot stop both links.
    assert not impacts.stops(impacts.locked(0, tuple(-x for x in u), -direction))


def test_speeds_along_rows_are_products():
    assert speed_along((2.0, -3.0), (5.0, 7.0)) == -11.0


def test_near_a_dead_point_a_pose_is_not_moved_by_more_than_rounding():
    """The row is 1e-9 m: a gap of 1e-14 m would turn the links by 1e-5 rad."""
    q = (1e-9, 1e-9)
    nearly = Pose(BARS, lagrange, q)
    bound = ALONG.coordinate(BARS, q)
    assert placed(nearly, ALONG, bound + 1e-14, EPSILON, EPSILON) == q


LONG_AND_SHORT = Chain.point_masses((1.0, 1.0), (1.0, 0.5))
"""Point masses at B and D: the rows of D are nearly parallel where the chain is nearly straight."""


def struck_near_straight(precision, q, u, surface):
    """Return the impact of D, or None if it does not approach the surface."""
    system = system_of(surface, chain=LONG_AND_SHORT, precision=precision)
    q, u = (tuple(map(system.number, pair)) for pair in (q, u))
    impacts = Impacts(system.pose(q), system.elements, 0.0, system.rounding)
    if float(speed_along(impacts.row(0), u)) > -1e-3:
        return None
    return impacts.impact(0, u)


@pytest.mark.parametrize("bend", [1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("mu", [0.1, 0.3, 2.0])
@pytest.mark.parametrize("e", [0.0, 0.5])
def test_an_impact_near_a_straight_pose_loses_no_more_digits_than_the_pose_has_lost(
    bend, law, mu, e
):
    """Against quadruple precision: impulses lost twice as many, and could be zero in place of 2.

    With a bend δ the rows of D have 1e-16/δ of their difference. Sticking impulses solve a system
    with the determinant δ², whose right-hand side cancels as well.
    """
    compared = 0
    for straight in (0.4, 0.4 + math.pi):
        for normal in ((0.6, -0.8), (-0.28, -0.96), (-1.0, 0.0)):
            for u in ((0.0, 2.0), (0.0, -2.0), (1.0, 3.0), (-1.0, 1.0)):
                surface = Surface((0.0, 0.0), normal, restitution=e, law=law, friction=mu)
                case = (0.4, straight + bend), u, surface
                found, exact = (struck_near_straight(p, *case) for p in ("double", "quadruple"))
                if exact is None:
                    continue
                compared += 1
                for own, true in [
                    (found.impulse[:2], exact.impulse[:2]), (found.u[1], exact.u[1])
                ]:  # fmt: skip
                    size = max(1.0, *(abs(float(x)) for x in true))
                    error = max(abs(float(x) - float(y)) for x, y in zip(own, true, strict=True))
                    assert error <= 100 * EPSILON / bend * size
    assert compared >= 8
