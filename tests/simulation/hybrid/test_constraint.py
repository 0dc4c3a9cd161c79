"""Accelerations under constraints, against NumPy's solution of the KKT system and exact numbers."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.simulation.hybrid import BARS
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate, PointCoordinate
from twolink.contact.elements import Constraint
from twolink.simulation.hybrid.constraint import (
    are_answered,
    cramer,
    is_answered,
    is_immobile,
    parallel,
    same_line,
    solved_with_one,
    solved_with_two,
)

wholes = st.integers(-9, 9).map(Fraction)
whole_pairs = st.tuples(wholes, wholes)


def positive_definite(a, b, c):
    """Return the product of a triangular matrix with itself: (a, b; 0, c) transposed."""
    return (a * a, a * b), (a * b, b * b + c * c)


matrices = st.builds(
    positive_definite, st.integers(1, 9).map(Fraction), wholes, st.integers(1, 9).map(Fraction)
)


def determinant(M):
    return M[0][0] * M[1][1] - M[0][1] * M[1][0]


def kkt(M, r, *constraints):
    """Return du and the multipliers of M du − Σ λ force = r, row · du = −bias."""
    n = len(constraints)
    A = np.zeros((2 + n, 2 + n))
    A[:2, :2] = np.array(M, float)
    right = [*map(float, r)]
    for k, (row, bias, force) in enumerate(constraints):
        A[:2, 2 + k] = [-float(x) for x in force]
        A[2 + k, :2] = [float(x) for x in row]
        right.append(-float(bias))
    solution = np.linalg.solve(A, right)
    return solution[:2], solution[2:]


def missing(M, r, du, multipliers, constraints):
    """Return M du − r − Σ λ force, and row · du + bias of each constraint."""
    rest = [M[i][0] * du[0] + M[i][1] * du[1] - r[i] for i in (0, 1)]
    for factor, (_, _, force) in zip(multipliers, constraints, strict=True):
        rest = [rest[i] - factor * force[i] for i in (0, 1)]
    return [*rest, *(c.row[0] * du[0] + c.row[1] * du[1] + c.bias for c in constraints)]


@given(matrices, whole_pairs)
def test_cramers_rule_solves_exactly(M, r):
    x = cramer(M, r, determinant(M))
    assert missing(M, r, x, (), ()) == [0, 0]


def test_cramers_rule_is_numpys_solution(random):
    for _ in range(50):
        L = random.normal(size=(2, 2))
        M, r = L @ L.T + np.eye(2), random.normal(size=2)
        found = cramer(tuple(map(tuple, M)), tuple(r), np.linalg.det(M))
        assert found == pytest.approx(np.linalg.solve(M, r), rel=1e-12, abs=1e-12)


@given(matrices, whole_pairs, whole_pairs, wholes, whole_pairs)
def test_one_constraint_is_kept_exactly(M, r, row, bias, force):
    """In exact numbers nothing is missing, for any force that can keep the constraint up."""
    assume(row != (0, 0))
    assume(force != (0, 0))
    response = sum(a * b for a, b in zip(row, cramer(M, force, determinant(M)), strict=True))
    assume(response != 0)
    constraint = Constraint(row, bias, force)
    du, multipliers = solved_with_one(M, r, constraint)
    assert missing(M, r, du, multipliers, (constraint,)) == [0, 0, 0]


@given(matrices, whole_pairs, whole_pairs, wholes, whole_pairs, whole_pairs, wholes, whole_pairs)
def test_two_constraints_are_kept_exactly(M, r, row1, bias1, force1, row2, bias2, force2):
    assume(row1[0] * row2[1] != row1[1] * row2[0])
    assume(force1[0] * force2[1] != force1[1] * force2[0])
    constraints = Constraint(row1, bias1, force1), Constraint(row2, bias2, force2)
    du, multipliers = solved_with_two(M, r, *constraints)
    assert missing(M, r, du, multipliers, constraints) == [0, 0, 0, 0]


@pytest.mark.parametrize("count", [1, 2])
def test_constrained_solutions_are_those_of_the_kkt_system(random, count):
    for _ in range(100):
        L = random.normal(size=(2, 2))
        M = tuple(map(tuple, L @ L.T + np.eye(2)))
        r = tuple(random.normal(size=2))
        constraints = [
            Constraint(tuple(row), float(random.normal()), tuple(row + 0.2 * random.normal(size=2)))
            for row in np.eye(2) + 0.3 * random.normal(size=(2, 2))
        ][:count]
        solved = solved_with_one if count == 1 else solved_with_two
        du, multipliers = solved(M, r, *constraints)
        expected_du, expected_multipliers = kkt(M, r, *constraints)
        assert du == pytest.approx(expected_du, rel=1e-10, abs=1e-10)
        assert multipliers == pytest.approx(expected_multipliers, rel=1e-10, abs=1e-10)


def test_a_constrained_joint_has_exactly_zero_acceleration(random):
    """Rounding may not let a stuck joint creep: link 1 stays, or both links turn alike."""
    for _ in range(50):
        L = random.normal(size=(2, 2))
        M, r = tuple(map(tuple, L @ L.T + np.eye(2))), tuple(random.normal(size=2))
        at_A, at_B = ((1, 0), 0, (1, 0)), ((-1, 1), 0, (-1, 1))
        assert solved_with_one(M, r, Constraint(*at_A))[0][0] == 0
        du, _ = solved_with_one(M, r, Constraint(*at_B))
        assert du[0] == du[1]
        assert solved_with_two(M, r, Constraint(*at_A), Constraint(*at_B))[0] == (0, 0)


@pytest.mark.parametrize("scale", [1e-12, 1.0, -3.0, 1e12])
def test_multiples_of_a_row_are_parallel(scale):
    assert parallel((0.3, -0.7), (0.3 * scale, -0.7 * scale), 1.0)


def test_rows_apart_by_a_rounding_are_parallel_and_by_a_millionth_are_not():
    assert parallel((1.0, 2.0), (1.0, 2.0 + 1e-14), 1.0)
    assert not parallel((1.0, 2.0), (1.0, 2.0 + 1e-6), 1.0)
    assert not parallel((1e-8, 2e-8), (1e8, 2e8 + 100.0), 1e-8)


def test_a_zero_row_is_parallel_to_every_row():
    assert parallel((0.0, 0.0), (1.0, 2.0), 1.0)


A, B = JointCoordinate("A"), JointCoordinate("B")
ELBOW, FIRST, SECOND, END = (PointCoordinate(name, (0.6, 0.8)) for name in ("B", "C1", "C2", "D"))


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (A, A, True),
        (A, JointCoordinate("A", -1), True),
        (A, B, False),
        (B, JointCoordinate("B", -1), True),
        (A, ELBOW, True),
        (FIRST, ELBOW, True),
        (B, ELBOW, False),
        (A, END, False),
        (SECOND, END, False),
        (END, END, True),
        (END, PointCoordinate("D", (-0.6, -0.8)), True),
        (END, PointCoordinate("D", (0.8, -0.6)), False),
    ],
)
def test_coordinates_that_move_together_in_every_pose(first, second, expected):
    """Different points of link 2 move along one line in some poses only."""
    assert same_line(first, second, BARS) is expected
    assert same_line(second, first, BARS) is expected


def test_a_mass_centre_at_the_end_is_the_end():
    chain = Chain.point_masses((1.0, 1.0), (1.0, 1.0))
    assert same_line(SECOND, END, chain)
    assert same_line(FIRST, ELBOW, chain)


def test_a_mass_centre_at_the_joint_moves_with_link_1():
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (0.1, 0.1))
    assert same_line(SECOND, A, chain)


@pytest.mark.parametrize(
    ("force", "expected"),
    [((1.0, 1.0), True), ((2.0, -1.0), False), ((2.0, -1.0 + 1e-15), False),
     ((2.0, -1.0 + 1e-14), True), ((2.0, -1.0 - 1e-14), True)],
)  # fmt: skip
def test_a_force_that_does_not_accelerate_along_the_row_does_not_answer_it(force, expected):
    """The inertias are 2 and 1, so that 2 and −1 accelerate (1, 1) by 1 − 1."""
    M = (2.0, 0.0), (0.0, 1.0)
    assert is_answered(M, Constraint((1.0, 1.0), 0.0, force), 2.0**-52) is expected


def test_rows_that_are_round_off_of_a_stretched_pose_have_no_direction():
    """Half of the length of a chain is a lever, and 1e-12 of it is one only along the other row."""
    assert parallel((1.0, -1.0), (1.743e-13, -1.745e-13), 0.65)
    assert not parallel((1.0, -1.0), (1.743e-13, 1.745e-13), 0.65)


def test_a_point_in_the_base_does_not_move():
    in_base = Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.5, 0.0)), (0.1, 0.1))
    centre, elbow = PointCoordinate("C1", (0.0, 1.0)), PointCoordinate("B", (0.0, 1.0))
    assert is_immobile(centre, in_base)
    assert not is_immobile(centre, BARS)
    assert not is_immobile(elbow, in_base)
    assert not is_immobile(JointCoordinate("A", 1), in_base)


@pytest.mark.parametrize(
    ("forces", "expected"),
    [
        (((1.0, 2.0), (0.5, 1.0)), False),
        (((0.1, 0.3), (0.3, 0.9 * (1 + 2.0**-52))), False),
        (((0.1, 0.3), (0.3, 0.9 * (1 + 1e-13))), True),
        (((1.0, 0.0), (0.0, 1.0)), True),
        (((1e-9, 0.0), (1.0, 1.0)), True),
    ],
)
def test_two_forces_along_one_line_enforce_one_constraint(forces, expected):
    """To round-off, whatever their sizes."""
    one, other = (Constraint(row, 0, f) for row, f in zip(((1, 0), (0, 1)), forces, strict=True))
    assert are_answered(one, other, 2.0**-52) is expected
