"""Bounds on the errors of a run and of its correction, from errors that are carried along it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from twolink.simulation.run import Array
from twolink.simulation.smooth.linear import Linear

# The factor on the standard deviation of the round-off of the estimate.
_DEVIATIONS = 3.5

# Allowance for the linearization and for the place on a step where its defect arises.
_MARGIN = 1.25

# The largest errors for which the motion is linearized: of angles (rad), and of speeds as a part of
# the largest speed, or of 1 rad/s.
_LINEAR = 1e-5

# The parts of the error that a correction leaves. Of round-off: 1e-3 was the most in random runs.
# Of truncation: its form on a step is known to some hundredths. Of values within a step, in x⁴ for
# h J of size x. The linearization itself leaves a part that is proportional to the error.
_LEFT, _LEFT_OF_TRUNCATION, _LEFT_WITHIN = 0.005, 0.05, 0.02

# The part of the difference of errors that are carried by flows of fourth and of sixth order: the
# latter were wrong by at most a sixth of it, and by a fiftieth in most random motions.
_OF_FLOWS = 0.3

# The largest size of the logarithm of a step's flow, h J, for which the series in it serve; and the
# part of it for which shorter steps are made.
_LARGEST_EXPONENT, _AIM = 2.5, 0.9


class ErrorBounds(NamedTuple):
    """Bounds (rad, rad/s) at the ends of steps (s), each of shape (n,).

    Of the error, of the error after a correction, of the part of the latter that is not round-off
    of the estimate, and the standard deviation of that round-off; and the estimated error itself.
    `longest_step` (s) is the longest over which errors are carried, infinite if all are.
    """

    ends: Array
    errors: Array
    corrected: Array
    left: Array
    noise: Array
    estimates: Array
    longest_step: float

    def known_where(self, known: Any) -> ErrorBounds:
        """Return bounds that are infinite where the errors are not known."""
        errors, corrected = (np.where(known, x, np.inf) for x in (self.errors, self.corrected))
        return self._replace(errors=errors, corrected=corrected)


def error_bounds(
    linear: Linear,
    carried: tuple[Array, Array],
    fastest: float,
    values: Array,
    within: Array,
) -> ErrorBounds:
    """Return bounds from errors of q and x, (n + 1, 4, 7), and covariances, (n + 1, 4, 4).

    The first of the errors is the estimate, and the last two are the part of it by truncation and
    its difference from that by flows of a lower order. The sizes of the others are a part of its
    bound. `fastest` (rad/s) is the largest speed. `values` are the
    round-off of a value, and `within` the errors within steps that are not at their ends, both of
    shape (n,).
    """
    errors, covariances = carried
    # The rates of q are u, whose error may have its peak within a step.
    rows = linear.jacobians[[0, 2], :, :2]
    speeds = rows @ np.stack([errors[:-1], errors[1:]])
    every = np.abs(np.concatenate([errors[1:, :2], *speeds], axis=1).transpose(2, 1, 0))
    noise = _deviations(linear, covariances)
    estimated, truncated, of_flows = every[0], every[5].max(axis=0), _OF_FLOWS * every[6]
    unseen = every[1:5].sum(axis=0) + _DEVIATIONS * noise
    errors = _MARGIN * estimated + of_flows + unseen
    seen, deviation = estimated.max(axis=0), noise.max(axis=0)
    lost = _LEFT + _LEFT_WITHIN * linear.exponents**4
    lost += (_MARGIN - 1) * _part_of_range(_MARGIN * estimated, fastest)
    left = seen * lost + _LEFT_OF_TRUNCATION * truncated + of_flows.max(axis=0)
    far = linear.exponents > _LARGEST_EXPONENT
    small = (_part_of_range(errors, fastest) <= 1) & ~far
    shorter = _AIM * _LARGEST_EXPONENT * (linear.lengths / linear.exponents)[far]
    return ErrorBounds(
        ends=linear.starts + linear.lengths,
        errors=np.where(small, errors.max(axis=0) + within, np.inf),
        corrected=np.where(small, left + within + unseen.max(axis=0) + values, np.inf),
        left=left + within,
        noise=deviation,
        estimates=seen,
        longest_step=float(shorter.min(initial=math.inf)),
    )


def _deviations(linear: Linear, covariances: Array) -> Array:
    """Return the standard deviations of q (rad), and of u (rad/s) within steps, shape (6, n).

    The covariances of the variables at the ends of the steps have shape (n + 1, 4, 4).
    """
    rows = linear.jacobians[[0, 2], :, :2]
    spread = rows @ np.stack([covariances[:-1], covariances[1:]])
    of_speeds = np.einsum("ijkl,ijkl->ikj", spread, rows).reshape(4, -1)
    of_angles = np.einsum("ijj->ji", covariances[1:, :2, :2])
    # Round-off may leave a variance of zero below zero.
    return np.sqrt(np.maximum(np.concatenate([of_angles, of_speeds]), 0.0))


def of_values(linear: Linear, deviations: Array) -> Array:
    """Return the largest change of q (rad) and u (rad/s) by changes of q and x, (n, 4): (n,)."""
    speeds = np.abs(linear.jacobians[1, :, :2]) @ deviations[:, :, None]
    both = np.maximum(deviations[:, :2], speeds[:, :, 0])
    return np.maximum(both[:, 0], both[:, 1])


def _part_of_range(errors: Array, fastest: float) -> Array:
    """Return errors of q and u, shape (6, n), as a part of the largest that may be linearized."""
    angles, speeds = errors[:2].max(axis=0), errors[2:].max(axis=0)
    return np.asarray(np.maximum(angles, speeds / max(1.0, fastest)) / _LINEAR)
