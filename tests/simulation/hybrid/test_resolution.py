"""Sequences of impacts at one instant: balance of momentum, energy, and the limit of rest."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, BARS
from tests.simulation.hybrid.test_impact import (
    AT_A,
    AT_B,
    ELBOW_UP,
    EPSILON,
    Q,
    approaches,
    end_rows,
    energy,
    floor,
    impacts_of,
    mass_matrix,
    stop,
    unbalanced,
)
from twolink import lagrange
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elements import RigidContact
from twolink.contact.impact_laws import Regime
from twolink.errors import IntegrationError
from twolink.simulation.hybrid import resolution
from twolink.simulation.hybrid.impact import Impacts
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.resolution import ended, resolve


def test_impacts_follow_each_other_until_none_is_approached():
    """A with e = 1/2 from −2 to 1 rad/s; then B, approached at 1 rad/s: in fractions.

    M = diag(3, 1/2): an impulse P in B gives (−P/3, 2 P), so P = 3/2 · 3/7.
    """
    u = (-2.0, 0.0)
    found = resolve(impacts_of(stop(AT_A, 0.5), stop(AT_B, 0.5), chain=BALANCED), u, (0, 1), ())
    assert [strike.number for strike in found.strikes] == [0, 1]
    P = Fraction(9, 14)
    assert found.u == pytest.approx((float(1 - P / 3), float(2 * P)), rel=1e-15)
    assert [float(s.impulse.normal) for s in found.strikes] == pytest.approx([9.0, float(P)])
    assert found.resting == frozenset()


def test_the_fastest_approach_strikes_first():
    elements = stop(AT_A, 0.0), stop(AT_B, 0.0)
    for u, first in [((-1.0, -1.5), 0), ((-1.0, -5.0), 1)]:
        found = resolve(impacts_of(*elements, chain=BALANCED), u, (0, 1), ())
        assert found.strikes[0].number == first


def test_contacts_without_approach_have_no_impact():
    found = resolve(impacts_of(stop(AT_A), stop(AT_B)), (1.0, 2.0), (0, 1), ())
    assert (found.u, found.strikes, found.resting) == ((1.0, 2.0), (), frozenset())


def momentum(chain, q, found, rows):
    du = np.subtract(found.u, found.strikes[0].u[0])
    given = sum(s.impulse.normal * np.array(rows[s.number]) for s in found.strikes)
    return mass_matrix(chain, q) @ du - given


@pytest.mark.parametrize("e", [0.0, 0.3, 0.8])
def test_two_contacts_that_answer_each_other_share_the_momentum(e):
    """Both stops are approached, with each blow on B sending link 1 on to A."""
    u, rows = (-1.0, -3.0), ((1, 0), (-1, 1))
    found = resolve(impacts_of(stop(AT_A, e), stop(AT_B, e), chain=BALANCED), u, (0, 1), ())
    assert momentum(BALANCED, Q, found, rows) == pytest.approx((0, 0), abs=1e-12)
    energies = [energy(BALANCED, Q, s.u[side]) for s in found.strikes for side in (0, 1)]
    assert all(b <= a * (1 + 1e-14) for a, b in pairwise(energies))
    assert all(np.dot(row, found.u) >= -1e-15 for row in rows)
    if e == 0:
        assert found.u == (0.0, 0.0)
        assert found.resting == {0, 1}


def test_contacts_with_too_many_impacts_come_to_rest_together(monkeypatch):
    monkeypatch.setattr(resolution, "MOST_IMPACTS", 3)
    u, rows = (-1.0, -3.0), ((1, 0), (-1, 1))
    found = resolve(impacts_of(stop(AT_A), stop(AT_B), chain=BALANCED), u, (0, 1), ())
    assert found.u == (0.0, 0.0)
    assert found.resting == {0, 1}
    assert found.strikes[-1].impulse.regime == Regime.BOUNCES_DIE_AWAY
    assert momentum(BALANCED, Q, found, rows) == pytest.approx((0, 0), abs=1e-12)


def test_random_sequences_lose_energy_and_end_without_an_approach(random):
    """Two points on a floor and a stop, without friction: momentum is balanced by all together."""
    q = (0.5, -0.3)
    normal = end_rows(q)[0]
    elements = floor(0.6), floor(0.2, normal=ELBOW_UP), stop(AT_B, 0.4)
    rows = [normal, np.array([-math.cos(0.5), 0.0]), np.array([-1.0, 1.0])]
    for _ in range(30):
        u = tuple(random.normal(size=2))
        found = resolve(impacts_of(*elements, q=q), u, (0, 1, 2), ())
        if not found.strikes:
            assert min(row @ u for row in rows) >= 0
            continue
        assert energy(BARS, q, found.u) <= energy(BARS, q, u) * (1 + 1e-13)
        assert min(row @ found.u for row in rows) >= -1e-14
        assert momentum(BARS, q, found, rows) == pytest.approx((0, 0), abs=1e-12)


# Bounces that are left out.


def test_two_contacts_are_ended_at_rest_by_impulses_that_balance_momentum(random):
    rows = end_rows(Q)[0], np.array([-1.0, 1.0])
    for _ in range(20):
        u = tuple(1e-6 * random.normal(size=2))
        strikes = ended(impacts_of(floor(0.5), stop(AT_B, 0.5)), [0, 1], u)
        assert [s.number for s in strikes] == [0, 1]
        assert strikes[0].u[0] == u
        assert strikes[0].u[1] == strikes[1].u[0]
        assert strikes[1].u[1] == (0.0, 0.0)
        expected = np.linalg.solve(np.array(rows).T, -mass_matrix(BARS, Q) @ u)
        found = [s.impulse.normal for s in strikes]
        assert found == pytest.approx(expected, rel=1e-12)
        assert {s.impulse.regime for s in strikes} == {Regime.BOUNCES_DIE_AWAY}


def test_one_contact_is_ended_by_its_normal_impulse():
    normal, _ = end_rows(Q)
    u = approaches(np.random.default_rng(1), normal)
    (strike,) = ended(impacts_of(floor(0.5)), [0], u)
    assert normal @ strike.u[1] == pytest.approx(0, abs=1e-15)
    assert unbalanced(BARS, Q, strike, normal) == pytest.approx((0, 0), abs=1e-13)


@pytest.mark.parametrize("sense", [1, -1])
def test_a_slide_that_is_ended_goes_on_with_its_friction(sense):
    """The impulse is on the edge of Coulomb's cone, against the slide."""
    normal, tangent = end_rows(Q)
    u = tuple(np.linalg.solve([normal, tangent], [-1e-3, sense]))
    (strike,) = ended(impacts_of(floor(0.5, 0.3)), [0], u, {0: sense})
    assert strike.impulse.tangential == pytest.approx(-sense * 0.3 * strike.impulse.normal)
    assert unbalanced(BARS, Q, strike, normal, tangent) == pytest.approx((0, 0), abs=1e-13)
    assert normal @ strike.u[1] == pytest.approx(0, abs=1e-15)
    assert sense * (tangent @ strike.u[1]) > 0


def test_a_point_that_is_ended_sticking_is_at_rest():
    normal, tangent = end_rows(Q)
    u = tuple(np.linalg.solve([normal, tangent], [-1e-8, 1e-12]))
    (strike,) = ended(impacts_of(floor(0.5, 0.3)), [0], u)
    assert strike.u[1] == (0.0, 0.0)
    assert unbalanced(BARS, Q, strike, normal, tangent) == pytest.approx((0, 0), abs=1e-22)


def test_newtons_law_is_refused_where_it_would_multiply_the_energy():
    """D sticks and rebounds 1e-9 rad from the stretched pose: u is J⁻¹ v, and det J is 1e-9."""
    q = (0.5, 0.5 + 1e-9)
    normal = PointCoordinate("D", (0.0, -1.0))
    tangent = PointCoordinate("D", (1.0, 0.0))
    contact = RigidContact("floor", normal, 0.0, 0.5, tangent, 2.0, 2.0, "newton-routh")
    impacts = Impacts(Pose(BARS, lagrange, q), [contact], 0.5, EPSILON)
    with pytest.raises(IntegrationError, match=r"beyond the range of its law \(newton-routh\)"):
        resolve(impacts, (1.0, -0.5), (0,), ())


def corner(restitution, friction):
    """Return D at a wall of Newton's law, and the stop of joint B, which are approached in turn."""
    pose = Pose(BARS, lagrange, (0.651, 0.694))
    wall = RigidContact(
        "wall", PointCoordinate("D", (-0.923, -0.384)), 0.0, restitution,
        PointCoordinate("D", (0.384, -0.923)), friction, friction, "newton",
    )  # fmt: skip
    upper = RigidContact("stop", JointCoordinate("B", -1), 0.0, 0.0)
    return Impacts(pose, [wall, upper], 0.5, EPSILON)


def test_impacts_that_give_each_other_ever_more_energy_are_refused():
    """D sticks to the wall and rebounds, the links fold, and the stop throws D back.

    Newton's law with friction gives twenty times the energy in each round. It grew beyond all
    numbers, and the chain was at rest then.
    """
    words = (
        r"impact on wall is beyond the range of its law \(newton\): after others at this instant"
    )
    with pytest.raises(IntegrationError, match=words):
        resolve(corner(0.444, 1.84), (-4.4, -4.4), (0, 1), ())


def test_impacts_that_do_not_become_weaker_are_not_ended_in_rest(monkeypatch):
    """The few rounds here give less than is refused at once."""
    monkeypatch.setattr(resolution, "MOST_IMPACTS", 4)
    words = r"impacts on wall, stop answer each other without end, beyond the range of their laws"
    with pytest.raises(IntegrationError, match=words):
        resolve(corner(0.444, 1.84), (-4.4, -4.4), (0, 1), ())


def test_speed_that_two_nearly_parallel_contacts_take_is_in_the_log():
    """D strikes two walls at an angle of 1e-7 rad, and would slide on by 1e-7 m/s along one.

    The speed towards the other wall is rounding then, but that along both is not.
    """
    pose, angle = Pose(BARS, lagrange, Q), 1e-7
    normals = (0.0, -1.0), (math.sin(angle), -math.cos(angle))
    walls = [RigidContact(f"wall {n}", PointCoordinate("D", n), 0.0, 0.0) for n in normals]
    along, row = pose.row(PointCoordinate("D", (1.0, 0.0))), pose.row(walls[0].normal)
    after = np.linalg.solve([along, row], [1e-7, 0.0])
    before = after - np.array(pose.impulse_response(row))
    found = resolve(Impacts(pose, walls, 0.5, EPSILON), tuple(before.tolist()), (0, 1), ())
    assert found.u == (0, 0)
    given = sum(
        float(strike.impulse.normal) * np.array(pose.row(walls[strike.number].normal))
        for strike in found.strikes
    )
    assert given == pytest.approx(-lagrange_mass(Q) @ before, abs=1e-12)


def lagrange_mass(q):
    return np.array(lagrange.mass_matrix(BARS, q))
