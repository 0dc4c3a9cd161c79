"""Accelerations under constraints: the equation of motion with rows that must not move.

A chain has two degrees of freedom, so one constraint leaves one motion, and two leave none. Both
are solved in the motion that is left, so what a constraint bars is exactly zero.
"""

from __future__ import annotations

from typing import NamedTuple

from twolink.arithmetic import Matrix, Pair, Scalar

# Rows that are more nearly parallel than this bar the same motion, but for rounding.
_PARALLEL = 1e-9

# A speed below this part of its terms is the rounding of an exact zero.
_AT_REST = 1e-14


class Constraint(NamedTuple):
    """row · du + drift = 0, kept up by a multiple λ ≥ 0 or < 0 of the generalized force `force`."""

    row: Pair
    drift: Scalar
    force: Pair


def rests(row: Pair, u: Pair) -> bool:
    """Return whether the speed row · u is zero, but for the rounding of its terms."""
    first, second = row[0] * u[0], row[1] * u[1]
    return bool(abs(first + second) <= _AT_REST * (abs(first) + abs(second)))


def cramer(M: Matrix, r: Pair, det: Scalar) -> Pair:
    """Return M⁻¹ r, by Cramer's rule."""
    (M11, M12), (_, M22) = M
    return (M22 * r[0] - M12 * r[1]) / det, (M11 * r[1] - M12 * r[0]) / det


def solved_with_one(M: Matrix, r: Pair, constraint: Constraint) -> tuple[Pair, list[Scalar]]:
    """Return du and λ of M du = r + λ force, row · du = −drift.

    du is what the drift demands, along the row, and a motion across it, which the equation of
    motion across the force gives: so what a constraint bars is exactly zero.
    """
    (M11, M12), (_, M22) = M
    (x, y), drift, (X, Y) = constraint
    long = x * x + y * y
    barred = -drift * x / long, -drift * y / long
    rest = (
        r[0] - M11 * barred[0] - M12 * barred[1],
        r[1] - M12 * barred[0] - M22 * barred[1],
    )
    # Across the row is (y, −x), across the force (Y, −X).
    along = (Y * rest[0] - X * rest[1]) / (Y * (M11 * y - M12 * x) - X * (M12 * y - M22 * x))
    du = barred[0] + along * y, barred[1] - along * x
    missing = M11 * du[0] + M12 * du[1] - r[0], M12 * du[0] + M22 * du[1] - r[1]
    return du, [(X * missing[0] + Y * missing[1]) / (X * X + Y * Y)]


def solved_with_two(
    M: Matrix, r: Pair, one: Constraint, two: Constraint
) -> tuple[Pair, list[Scalar]]:
    """Return du and both λ of M du = r + Σ λ force, each row · du = −drift."""
    (M11, M12), (_, M22) = M
    (x1, y1), drift1, (X1, Y1) = one
    (x2, y2), drift2, (X2, Y2) = two
    rows = x1 * y2 - x2 * y1
    du = (y1 * drift2 - y2 * drift1) / rows, (x2 * drift1 - x1 * drift2) / rows
    missing = M11 * du[0] + M12 * du[1] - r[0], M12 * du[0] + M22 * du[1] - r[1]
    forces = X1 * Y2 - X2 * Y1
    return du, [
        (Y2 * missing[0] - X2 * missing[1]) / forces,
        (X1 * missing[1] - Y1 * missing[0]) / forces,
    ]


def parallel(constraints: list[Constraint]) -> bool:
    """Return whether two constraints bar the same motion."""
    if len(constraints) < 2:
        return False
    return same_way(constraints[0].row, constraints[1].row)


def same_way(first: Pair, second: Pair) -> bool:
    """Return whether two rows are parallel, but for rounding."""
    x1, y1, x2, y2 = (float(entry) for entry in (*first, *second))
    size = (abs(x1) + abs(y1)) * (abs(x2) + abs(y2))
    return abs(x1 * y2 - x2 * y1) <= _PARALLEL * size
