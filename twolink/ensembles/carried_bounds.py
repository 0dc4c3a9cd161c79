"""Bounds on the errors of states whose steps carry the region of their error.

The result is the state less the centre of the region. What is left is within the region. A part of
the correction is added to the bound, for all that the linearized motion does not show.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.error import LINEAR
from twolink.ensembles.lane_rows import Rows
from twolink.ensembles.step import OF_REGION

Array = NDArray[np.float64]

OF_CORRECTIONS = 0.1
"""The part of the largest correction that is added to the bound of an error."""


def corrected(rows: Rows) -> Array:
    """Return bounds on the errors of states that are corrected (rad, rad/s), shape (n,).

    They are infinite where the region is no longer finite: its largest size so far leaves NaN out.
    """
    finite = np.isfinite([*rows.centre, *rows.shape]).all(axis=0)
    return np.where(finite, rows.spread + OF_CORRECTIONS * rows.shift, np.inf)


def uncorrected(rows: Rows) -> Array:
    """Return bounds on the errors of states and steps so far (rad, rad/s), shape (n,).

    Those of the last steps are left out. Errors that are too large are infinite.
    """
    bounds = corrected(rows)
    return np.where(known(bounds), bounds + rows.shift, np.inf)


def of_last_steps(rows: Rows, tolerance: Any) -> Array:
    """Return bounds on the truncation errors of last steps that are not yet in their regions.

    The last terms of a step (rad/s) are larger: at most its tolerance, or a part of its region.
    """
    return np.where(rows.last > 0, np.maximum(tolerance, OF_REGION * rows.spread), 0.0)


def known(bounds: Array) -> Any:
    """Return which bounds are small enough for errors that grow in proportion."""
    return bounds <= LINEAR
