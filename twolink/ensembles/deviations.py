"""The error of a run in lanes, carried from step to step: an ellipsoid in q and p, as expressions.

The error (true state subtracted) lies in a region with a `centre` e and a `shape` P: all sums of e
and of a deviation d with dᵀ P⁻¹ d ≤ 1. Over a step both are carried by the flow Φ of the linearized
motion, to Φ e and Φ P Φᵀ, exactly as the error is. A step adds an estimate of its truncation error
to the centre. What is not known of that is a part of it that may have the same sign on all steps:
the region grows by the sum of two ellipsoids, in the smallest ellipsoid that contains it for a
given weight of the axes. Round-off has any sign, and adds to P as a variance does.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from twolink.ensembles.comparisons import largest, size, total
from twolink.optional import heyoka

Vector = list[Any]
Matrix = list[Vector]

UNKNOWN = 0.1
"""The unknown part of the truncation error of a step, relative to its estimate.

The estimate takes the defect for a power of the time: it is wrong by (N + 1) / (N + 2) where the
next power is larger, and by h |J| / (N + 2) as the defect is carried during the step.
"""

# Squared sizes (rad²) that are added so that no size is zero.
_TINY = 1e-80

INDICES = [(i, j) for i in range(4) for j in range(i, 4)]
"""The places of the entries of a symmetric matrix that are stored, in their order."""


class Region(NamedTuple):
    """The centre (4) and the shape (4 × 4, symmetric) of the region of an error."""

    centre: Vector
    shape: Matrix

    @classmethod
    def of(cls, centre: Vector, entries: Vector) -> Region:
        """Return a region of the entries of its shape in the order of `INDICES`."""
        known = dict(zip(INDICES, entries, strict=True))
        shape = [[known[min(i, j), max(i, j)] for j in range(4)] for i in range(4)]
        return cls(centre, shape)

    @property
    def entries(self) -> Vector:
        """The entries of the shape in the order of `INDICES`."""
        return [self.shape[i][j] for i, j in INDICES]

    def with_step(
        self, truncation: Vector, shared: Vector, independent: Vector, weights: Vector
    ) -> Region:
        """Return the region with the errors of one more step.

        `truncation` is estimated, sizes of errors in `shared` may have the same sign on all steps,
        and those in `independent` have any sign. `weights` are those of squared components, which
        make their units alike.
        """
        centre = [a + b for a, b in zip(self.centre, truncation, strict=True)]
        added = [size * size for size in shared]
        old = _size([self.shape[i][i] for i in range(4)], weights)
        new = _size(added, weights)
        grown, share = (old + new) / old, (old + new) / new
        shape = [[grown * entry for entry in row] for row in self.shape]
        for i in range(4):
            shape[i][i] = shape[i][i] + (share * added[i] + independent[i] * independent[i])
        return Region(centre, shape)

    def carried(self, flow: Matrix) -> Region:
        """Return the region after the flow of a step."""
        across = product(self.shape, transposed(flow))
        shape: Matrix = [[None] * 4 for _ in range(4)]
        for i, j in INDICES:
            entry = total([a * row[j] for a, row in zip(flow[i], across, strict=True)])
            shape[i][j] = shape[j][i] = entry
        return Region(of_vector(flow, self.centre), shape)

    def shift(self, rows: Matrix) -> Any:
        """Return the largest size of the centre in some directions."""
        return largest(*map(size, of_vector(rows, self.centre)))

    def spread(self, rows: Matrix) -> Any:
        """Return the largest distance from the centre in some directions."""
        squares = [total(_products(row, of_vector(self.shape, row))) for row in rows]
        return heyoka().sqrt(largest(*squares))


def _size(squares: Vector, weights: Vector) -> Any:
    return heyoka().sqrt(total(_products(squares, weights)) + _TINY)


def product(one: Matrix, other: Matrix) -> Matrix:
    """Return the product of two matrices."""
    columns = transposed(other)
    return [[total(_products(row, column)) for column in columns] for row in one]


def of_vector(matrix: Matrix, vector: Vector) -> Vector:
    """Return the product of a matrix and a vector."""
    return [total(_products(row, vector)) for row in matrix]


def transposed(matrix: Matrix) -> Matrix:
    """Return the transpose of a matrix."""
    return [list(column) for column in zip(*matrix, strict=True)]


def _products(one: Vector, other: Vector) -> Vector:
    return [a * b for a, b in zip(one, other, strict=True)]
