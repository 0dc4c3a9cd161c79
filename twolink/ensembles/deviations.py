"""The error of a run in lanes, carried from step to step: an ellipsoid in q and p, as expressions.

The error (true state subtracted) lies in a region with a `centre` e and a `shape` P: all sums of e
and of a deviation d with dᵀ P⁻¹ d ≤ 1. Over a step both are carried by the flow Φ of the linearized
motion, to Φ e and Φ P Φᵀ, exactly as the error is. A step adds an estimate of its truncation error
to the centre. What is not known of that is a part of it that may have the same sign on all steps:
the region grows by the sum of two ellipsoids, in the smallest ellipsoid that contains it for given
units of the axes. Round-off has any sign, and adds to P as a variance does.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.comparisons import largest, size, total
from twolink.optional import heyoka

Vector = NDArray[Any]
Matrix = NDArray[Any]

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
    """The centre, shape (4,), and the shape, (4, 4) and symmetric, of the region of an error."""

    centre: Vector
    shape: Matrix

    @classmethod
    def of(cls, centre: Any, entries: Any) -> Region:
        """Return a region of the entries of its shape in the order of `INDICES`."""
        shape = np.empty((4, 4), object)
        for (i, j), entry in zip(INDICES, entries, strict=True):
            shape[i, j] = shape[j, i] = entry
        return cls(np.array(list(centre), object), shape)

    @property
    def entries(self) -> list[Any]:
        """The entries of the shape in the order of `INDICES`."""
        return [self.shape[i, j] for i, j in INDICES]

    def with_step(
        self, truncation: Vector, shared: Vector, independent: Vector, units: Vector
    ) -> Region:
        """Return the region with the errors of one more step, all of shape (4,).

        `truncation` is estimated, sizes of errors in `shared` may have the same sign on all steps,
        and those in `independent` have any sign. `units` make components alike: errors of a unit.
        """
        added = shared * shared
        old, new = _size(self.shape.diagonal(), units), _size(added, units)
        shape = self.shape * ((old + new) / old)
        shape[np.diag_indices(4)] += added * ((old + new) / new) + independent * independent
        return Region(self.centre + truncation, shape)

    def carried(self, flow: Matrix) -> Region:
        """Return the region after the flow of a step."""
        across = self.shape @ flow.T
        entries = [flow[i] @ across[:, j] for i, j in INDICES]
        return Region.of(flow @ self.centre, entries)

    def shift(self, rows: Matrix) -> Any:
        """Return the largest size of the centre in some directions, the rows of a matrix."""
        return largest(*map(size, rows @ self.centre))

    def spread(self, rows: Matrix) -> Any:
        """Return the largest distance from the centre in some directions."""
        return heyoka().sqrt(largest(*(row @ (self.shape @ row) for row in rows)))


def _size(squares: Vector, units: Vector) -> Any:
    return heyoka().sqrt(total(list(squares / (units * units))) + _TINY)
