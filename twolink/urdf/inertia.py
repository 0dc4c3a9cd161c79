"""Moments of inertia that a rigid body can have."""

from __future__ import annotations

import math

from twolink.urdf.spatial import Matrix3

# Products of inertia written with few digits violate the inequality by rounding.
_ROUNDING = 1e-9


def principal_moments(inertia: Matrix3) -> tuple[float, float, float]:
    """Return the eigenvalues of a symmetric matrix (kg m²), the smallest first.

    By Jacobi's rotations, which keep a diagonal matrix to the last bit.
    """
    matrix = [list(row) for row in inertia]
    for _ in range(60):
        p, q = max(((0, 1), (0, 2), (1, 2)), key=lambda pair: abs(matrix[pair[0]][pair[1]]))
        off, largest = abs(matrix[p][q]), max(abs(matrix[i][i]) for i in range(3))
        if off <= 1e-17 * largest or not math.isfinite(off):
            break
        _rotate(matrix, p, q)
    a, b, c = sorted(matrix[i][i] for i in range(3))
    return a, b, c


def _rotate(matrix: list[list[float]], p: int, q: int) -> None:
    """Turn axes p and q so that their product of inertia vanishes."""
    half = (matrix[q][q] - matrix[p][p]) / 2
    tangent = matrix[p][q] / (half + math.copysign(math.hypot(half, matrix[p][q]), half))
    cosine = 1 / math.hypot(1, tangent)
    sine = cosine * tangent
    r = 3 - p - q
    app, aqq, apq = matrix[p][p], matrix[q][q], matrix[p][q]
    arp, arq = matrix[r][p], matrix[r][q]
    matrix[p][p], matrix[q][q] = app - tangent * apq, aqq + tangent * apq
    matrix[p][q] = matrix[q][p] = 0.0
    matrix[r][p] = matrix[p][r] = cosine * arp - sine * arq
    matrix[r][q] = matrix[q][r] = sine * arp + cosine * arq


def violates_triangle(moments: tuple[float, float, float]) -> bool:
    """Return whether the largest of three moments, sorted, exceeds the sum of the others."""
    smallest, middle, largest = moments
    return largest > (smallest + middle) * (1 + _ROUNDING)
