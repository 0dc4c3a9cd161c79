"""Accelerations under one or two constraints.

A chain has two degrees of freedom: one constraint leaves one, and two leave none. The equations are
solved in the remaining motion, so that the constrained speed is exactly zero.
"""

from __future__ import annotations

from typing import Any

from twolink.arithmetic import Matrix, Pair, Scalar
from twolink.chain import Chain
from twolink.contact.coordinates import ConstraintCoordinate, JointCoordinate, PointCoordinate
from twolink.contact.elements import Constraint
from twolink.simulation.hybrid.tolerances import NO_LEVER, NO_RESPONSE, PARALLEL


def cramer(M: Matrix, r: Pair, det: Scalar) -> Pair:
    """Return M⁻¹ r, by Cramer's rule."""
    (M11, M12), (_, M22) = M
    return (M22 * r[0] - M12 * r[1]) / det, (M11 * r[1] - M12 * r[0]) / det


def solved_with_one(M: Matrix, r: Pair, constraint: Constraint) -> tuple[Pair, tuple[Scalar, ...]]:
    """Return du and λ of M du = r + λ force, row · du = −bias.

    du is the sum of a part along the row, given by the bias, and a part across it, given by the
    equation of motion across the force.
    """
    (M11, M12), (_, M22) = M
    (x, y), bias, (X, Y) = constraint
    long = x * x + y * y
    barred = -bias * x / long, -bias * y / long
    rest = (
        r[0] - M11 * barred[0] - M12 * barred[1],
        r[1] - M12 * barred[0] - M22 * barred[1],
    )
    # Across the row is (y, −x), across the force (Y, −X).
    along = (Y * rest[0] - X * rest[1]) / (Y * (M11 * y - M12 * x) - X * (M12 * y - M22 * x))
    du = barred[0] + along * y, barred[1] - along * x
    missing = M11 * du[0] + M12 * du[1] - r[0], M12 * du[0] + M22 * du[1] - r[1]
    return du, ((X * missing[0] + Y * missing[1]) / (X * X + Y * Y),)


def solved_with_two(
    M: Matrix, r: Pair, one: Constraint, two: Constraint
) -> tuple[Pair, tuple[Scalar, ...]]:
    """Return du and both λ of M du = r + Σ λ force, each row · du = −bias."""
    (M11, M12), (_, M22) = M
    (x1, y1), bias1, (X1, Y1) = one
    (x2, y2), bias2, (X2, Y2) = two
    rows = x1 * y2 - x2 * y1
    du = (y1 * bias2 - y2 * bias1) / rows, (x2 * bias1 - x1 * bias2) / rows
    missing = M11 * du[0] + M12 * du[1] - r[0], M12 * du[0] + M22 * du[1] - r[1]
    forces = X1 * Y2 - X2 * Y1
    return du, (
        (Y2 * missing[0] - X2 * missing[1]) / forces,
        (X1 * missing[1] - Y1 * missing[0]) / forces,
    )


def is_answered(M: Matrix, constraint: Constraint, rounding: float) -> bool:
    """Return whether the force of a constraint accelerates the chain along its row.

    Friction may cancel that to round-off, as where a slide begins to jam (Painlevé): no force then
    enforces the constraint.
    """
    (M11, M12), (_, M22) = M
    (x, y), _, (X, Y) = constraint
    return _exceed_round_off((Y * M11 * y, -Y * M12 * x, -X * M12 * y, X * M22 * x), rounding)


def are_answered(one: Constraint, other: Constraint, rounding: float) -> bool:
    """Return whether the forces of two constraints are independent, so that they enforce both.

    Friction may turn the forces of two contacts into one line, as in a corner of a right angle with
    a coefficient of 1.
    """
    (X1, Y1), (X2, Y2) = one.force, other.force
    return _exceed_round_off((X1 * Y2, -X2 * Y1), rounding)


def _exceed_round_off(terms: tuple[Scalar, ...], rounding: float) -> bool:
    """Return whether a sum of terms is more than their round-off."""
    return bool(abs(sum(terms)) > NO_RESPONSE * rounding * sum(map(abs, terms)))


def parallel(first: Pair, second: Pair, lever: float) -> bool:
    """Return whether two rows of a chain of length `lever` (m) are parallel within round-off.

    Near a singular pose a row is short, and its direction is round-off of the pose. The criterion
    is therefore the component of the shorter row perpendicular to the longer one.
    """
    x1, y1, x2, y2 = (float(entry) for entry in (*first, *second))
    one, other = abs(x1) + abs(y1), abs(x2) + abs(y2)
    known = max(PARALLEL * min(one, other), NO_LEVER * lever)
    return abs(x1 * y2 - x2 * y1) <= known * max(one, other)


def same_line(first: ConstraintCoordinate, second: ConstraintCoordinate, chain: Chain) -> bool:
    """Return whether the speeds of two coordinates are proportional in every pose.

    This holds for points of link 1 and the joint A, and for one point along one line.
    """
    one, other = _motion(first, chain), _motion(second, chain)
    if one[0] != other[0]:
        return False
    (x1, y1), (x2, y2) = one[1], other[1]
    return bool(x1 * y2 == x2 * y1)


def is_immobile(coordinate: ConstraintCoordinate, chain: Chain) -> bool:
    """Return whether a coordinate is that of a point in A, which does not move."""
    if not isinstance(coordinate, PointCoordinate):
        return False
    point = coordinate.of(chain)
    return bool(point.link == 1 and point.along == 0 and point.across == 0)


def _motion(coordinate: ConstraintCoordinate, chain: Chain) -> tuple[Any, Pair]:
    """Return the motion along a coordinate: of a joint, or of a point of link 2 along a vector."""
    if isinstance(coordinate, JointCoordinate):
        return coordinate.joint, (1, 0)
    assert isinstance(coordinate, PointCoordinate)
    point = coordinate.of(chain)
    if point.link == 1 or (point.along == 0 and point.across == 0):
        return "A", (1, 0)
    return point, coordinate.vector
