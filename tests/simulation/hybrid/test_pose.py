"""Poses against the gradients and the mass matrix of two uniform bars, and compiled formulas."""

import math

import numpy as np
import pytest

from tests.simulation.hybrid import BARS
from twolink import kane, lagrange
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.simulation.hybrid.pose import Pose, PoseFormulas

Q = (0.7, -0.4)
UP, ALONG = PointCoordinate("D", (0.0, -1.0)), PointCoordinate("D", (1.0, 0.0))
COORDINATES = (
    UP, PointCoordinate("C2", (0.6, 0.8)), PointCoordinate("B", (-0.8, 0.6)),
    PointCoordinate("C1", (1.0, 0.0)), JointCoordinate("A", -1), JointCoordinate("B"),
)  # fmt: skip


def inertia():
    c = math.cos(Q[1] - Q[0])
    return np.array([[4 / 3, c / 2], [c / 2, 1 / 3]])


@pytest.fixture(params=[False, True], ids=["plain", "compiled"])
def pose(request):
    return Pose(BARS, lagrange, Q, PoseFormulas(BARS, lagrange, compiled=request.param))


def test_a_row_is_the_gradient_of_its_coordinate_and_is_computed_once(pose):
    assert pose.row(UP) == pytest.approx((-math.cos(Q[0]), -math.cos(Q[1])))
    assert pose.row(UP) is pose.row(UP)
    assert pose.inertia is pose.inertia


def test_the_value_of_a_coordinate_in_another_pose(pose):
    assert pose.value(UP, (0.0, 0.5)) == pytest.approx(-math.sin(0.5))


def test_responses_are_those_of_the_inverse_mass_matrix(pose):
    along, up = -np.sin(Q), -np.cos(Q)
    assert pose.response(pose.row(UP), pose.row(ALONG)) == pytest.approx(
        up @ np.linalg.solve(inertia(), along)
    )
    assert pose.impulse_response((2.0, -3.0)) == pytest.approx(
        np.linalg.solve(inertia(), [2.0, -3.0])
    )


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_compiled_formulas_have_the_bits_of_the_plain_ones(formulation, random):
    for _ in range(10):
        numbers = random.uniform(0.1, 2.0, 10).tolist()
        m1, m2, L1, L2, a1, b1, a2, b2, I1, I2 = numbers
        chain = Chain((m1, m2), (L1, L2), ((a1, b1), (a2, b2)), (I1, I2))
        plain, compiled = (PoseFormulas(chain, formulation, compiled=c) for c in (False, True))
        q = tuple(random.uniform(-3.0, 3.0, 2).tolist())
        assert compiled.inertia(q) == plain.inertia(q)
        for coordinate in COORDINATES:
            assert compiled.of(coordinate).row(q) == plain.of(coordinate).row(q)
            assert compiled.of(coordinate).value(q) == plain.of(coordinate).value(q)


def test_formulas_are_compiled_once_for_equal_chains_and_coordinates():
    again = Chain.uniform_bars()
    one, two = (PoseFormulas(chain, kane, compiled=True) for chain in (BARS, again))
    assert one.inertia is two.inertia
    assert one.of(UP).row is two.of(PointCoordinate("D", (0.0, -1.0))).row


def test_poses_of_other_numbers_are_not_compiled():
    """A pose of its own evaluates the formulas in numbers of any type."""
    q = tuple(np.longdouble(angle) for angle in Q)
    own = Pose(BARS.convert(np.longdouble), lagrange, q)
    assert isinstance(own.row(UP)[0], np.longdouble)
    assert float(own.inertia[1]) == pytest.approx(4 / 9 - inertia()[0, 1] ** 2)
