"""Directions of motion against derivatives of positions that mpmath finds."""

from itertools import product

import mpmath
import pytest

from tests.verification.chains import GENERAL
from twolink import kane, lagrange
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.loads import Force, Torque

DIGITS = 50
Q, U = (0.7, -1.9), (1.3, -2.1)

COORDINATES = [
    *(JointCoordinate(joint, sense) for joint, sense in product("AB", (1, -1))),
    *(
        PointCoordinate(point, vector)
        for point, vector in product(
            ("B", "C1", "C2", "D"), [(1.0, 0.0), (0.0, -1.0), (0.6, 0.8), (-0.8, 0.6)]
        )
    ),
]


def place(coordinate, q):
    """Return a coordinate at q by the geometry of the chain alone."""
    q1, q2 = q
    if isinstance(coordinate, JointCoordinate):
        return coordinate.sense * (q1 if coordinate.joint == "A" else q2 - q1)
    (x1, y1), (x2, y2) = GENERAL.centre
    first, second = mpmath.expj(q1), mpmath.expj(q2)
    elbow = GENERAL.length[0] * first
    at = {
        "B": elbow,
        "C1": mpmath.mpc(x1, y1) * first,
        "C2": elbow + mpmath.mpc(x2, y2) * second,
        "D": elbow + GENERAL.length[1] * second,
    }[coordinate.point]
    x, y = coordinate.vector
    return x * at.real + y * at.imag


def moved(t):
    """Return the angles after a time in which both links turn steadily."""
    return tuple(mpmath.mpf(q) + u * t for q, u in zip(Q, U, strict=True))


@pytest.fixture(autouse=True)
def _digits():
    with mpmath.workdps(DIGITS):
        yield


@pytest.mark.parametrize("coordinate", COORDINATES, ids=str)
def test_speed_and_bias_are_derivatives_of_the_coordinate(coordinate):
    """Its speed is the first derivative; with du = 0 its bias is the second."""
    chain = GENERAL.convert(mpmath.mpf)
    q, u = tuple(map(mpmath.mpf, Q)), tuple(map(mpmath.mpf, U))
    expected = mpmath.taylor(lambda t: place(coordinate, moved(t)), 0, 2)
    found = (
        coordinate.coordinate(chain, q),
        coordinate.speed(chain, q, u),
        coordinate.bias(chain, q, u) / mpmath.mpf(2),
    )
    for ours, theirs in zip(found, expected, strict=True):
        assert abs(ours - theirs) < mpmath.mpf(10) ** -30


@pytest.mark.parametrize("formulation", [kane, lagrange], ids=["kane", "lagrange"])
@pytest.mark.parametrize("coordinate", COORDINATES, ids=str)
def test_the_generalized_force_of_unit_loads_is_the_gradient(formulation, coordinate):
    chain, q = GENERAL.convert(mpmath.mpf), tuple(map(mpmath.mpf, Q))
    row = formulation.generalized_active_force(chain, q, coordinate.unit_loads(chain))
    gradient = (
        mpmath.diff(lambda x: place(coordinate, (x, q[1])), q[0]),
        mpmath.diff(lambda x: place(coordinate, (q[0], x)), q[1]),
    )
    assert max(abs(a - b) for a, b in zip(row, gradient, strict=True)) < mpmath.mpf(10) ** -20


def test_unit_loads_are_a_force_at_the_point_or_a_torque_in_the_joint():
    assert PointCoordinate("D", (0.6, 0.8)).unit_loads(GENERAL) == (Force(GENERAL.D, (0.6, 0.8)),)
    torques = JointCoordinate("B", -1).unit_loads(GENERAL)
    assert all(isinstance(load, Torque) for load in torques)
    on_link = {link: sum(x.moment for x in torques if x.link == link) for link in (1, 2)}
    assert on_link == {1: 1, 2: -1}


def test_values_have_the_size_of_a_radian_or_of_the_chain():
    chain = Chain.uniform_bars((1.0, 1.0), (0.003, 0.002))
    assert JointCoordinate("B").size(chain) == 1
    assert PointCoordinate("B", (1.0, 0.0)).size(chain) == 0.005
