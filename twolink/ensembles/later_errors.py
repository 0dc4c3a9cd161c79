"""The growth of errors of later steps in lanes, where it may exceed that of errors of the start.

It is that of `twolink.simulation.smooth.growth_along`, carried from step to step. The numbers of
the lanes differ, so that the derivatives of the rates are differences.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Lanes
from twolink.ensembles.compiled import FORMULATION
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.flows import exponentials
from twolink.simulation.smooth.growth_along import is_conservative

Array = NDArray[np.float64]

# The part of the largest variables by which they are changed for derivatives of the rates.
_CHANGE = 2.0**-17

# Up and down in each of the variables, shape (4, 8).
_SIGNS = np.concatenate([np.eye(4), -np.eye(4)], axis=1)


class LaterErrors:
    """The growth of independent errors of all steps so far, in each lane."""

    def __init__(self, lanes: Lanes) -> None:
        """Begin at the start: an error there is as large as the state."""
        q, u = tuple(lanes.q), tuple(lanes.u)
        second = EQUATIONS[FORMULATION].from_speeds(lanes.chain, q, u)
        self._lanes, self._acts = lanes, not is_conservative(lanes.effects)
        self._last = np.array(np.broadcast_arrays(*q, *second))
        self._sizes, self._largest = np.zeros((2, lanes.width)), np.zeros(lanes.width)
        start = self._own(self._last[:, None], np.empty((0, lanes.width), bool))
        self._spread = _diagonal(start[:, 0] ** 2)

    def until(self, times: Array, variables: Array, moves: Any) -> Array:
        """Return the growth up to the ends of steps, shape (n, lanes), from the variables there.

        Those have shape (4, n, lanes), and the times (s) at the starts and ends (n + 1, lanes).
        `moves` says in which steps a run has not ended before. The growth is infinite, as it is
        unknown, where it is not finite, and 0 where loads depend on the pose alone.
        """
        if not self._acts:
            return np.zeros(moves.shape)
        with np.errstate(all="ignore"):
            every = np.concatenate([self._last[:, None], variables], axis=1)
            own = self._own(every, moves)
            jacobians = self._jacobians(every, times, own)
            flows = _flows(jacobians, np.where(moves, np.diff(times, axis=0), 0.0))
            found = np.empty(moves.shape)
            for step, (flow, rows) in enumerate(zip(flows, jacobians[1:, :, :2], strict=True)):
                added = _diagonal(own[:, step + 1] ** 2)
                carried = flow @ self._spread @ flow.transpose(0, 2, 1) + added
                self._spread = np.where(moves[step][:, None, None], carried, self._spread)
                found[step] = np.where(moves[step], _deviation(self._spread, rows), 0.0)
        self._last = variables[:, -1]
        known = np.where(np.isfinite(found), found, np.inf)
        growths = np.maximum(np.maximum.accumulate(known, axis=0), self._largest)
        self._largest = growths[-1]
        return growths

    def _own(self, variables: Array, moves: Any) -> Array:
        """Return the size of an error of each variable, shape (4, n + 1, lanes).

        It is the largest so far, of the angles and of the other two.
        """
        moving = np.concatenate([np.ones((1, moves.shape[1]), bool), moves])
        sizes = np.where(moving, np.abs(variables), 0.0).reshape(2, 2, *moving.shape).max(axis=1)
        sizes[:, 0] = np.maximum(sizes[:, 0], self._sizes)
        angles, second = np.maximum.accumulate(sizes, axis=1)
        self._sizes = np.array([angles[-1], second[-1]])
        return np.repeat([np.maximum(1.0, angles), np.where(second > 0, second, 1.0)], 2, axis=0)

    def _jacobians(self, variables: Array, times: Array, own: Array) -> Array:
        """Return the derivatives of the rates by the variables, shape (n + 1, lanes, 4, 4)."""
        change = _CHANGE * own
        moved = variables[:, None] + _SIGNS[:, :, None, None] * change[:, None]
        chain, effects = self._lanes.chain, self._lanes.effects
        first, second = EQUATIONS[FORMULATION].rates(
            chain, effects, tuple(moved[:2]), tuple(moved[2:]), times
        )
        rates = np.array([np.broadcast_to(rate, moved.shape[1:]) for rate in (*first, *second)])
        slopes = (rates[:, :4] - rates[:, 4:]) / (2 * change)
        return np.ascontiguousarray(slopes.transpose(2, 3, 0, 1))


def _flows(jacobians: Array, lengths: Array) -> Array:
    """Return the flows over steps, shape (n, lanes, 4, 4), each lane by itself."""
    middle = (jacobians[1:] + jacobians[:-1]) / 2 * lengths[:, :, None, None]
    # Where a run has ended, its rates may be no numbers.
    middle[lengths == 0] = 0.0
    every = [exponentials(middle[:, lane])[0] for lane in range(middle.shape[1])]
    return np.stack(every, axis=1)


def _diagonal(entries: Array) -> Array:
    """Return matrices with these diagonals, shape (lanes, 4, 4), of shape (4, lanes)."""
    return np.asarray(entries.T[:, :, None] * np.eye(4))


def _deviation(spread: Array, rows: Array) -> Array:
    """Return the largest deviation of q (rad) and u (rad/s) in each lane, shape (lanes,).

    The first two rows of the Jacobians, shape (lanes, 2, 4), are the derivatives of u.
    """
    of_angles = np.einsum("ijj->ij", spread[:, :2, :2])
    of_speeds = np.einsum("ijk,ikl,ijl->ij", rows, spread, rows)
    # Round-off may leave a variance of zero below zero.
    return np.sqrt(np.maximum(np.concatenate([of_angles, of_speeds], axis=1), 0.0)).max(axis=1)
