"""Starts in the balance of an unstable pose, such as a chain that stands upright.

The motion begins by the round-off of the pose and grows exponentially. A series of the state, which
is large, hardly sees it: steps would be as long as the run, and two runs in one precision round the
state alike, whatever their orders.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from twolink.chain import Chain
from twolink.effects import Effect
from twolink.simulation.run import Array
from twolink.simulation.smooth.equations import EQUATIONS

# The part of the rate of growth below which the pace of the motion is that of a balanced pose.
_SLOW = 1e-2

# Change of an angle (rad) and of a speed (rad/s) for the derivatives of accelerations.
_CHANGE = 1e-6

# The changes of q1, q2, u1 and u2 in each of the states that are evaluated: none, and one of them
# up or down. Shape (4, 9).
_CHANGES = _CHANGE * np.concatenate([np.zeros((4, 1)), np.eye(4), -np.eye(4)], axis=1)


def rates_of_balance(
    chain: Chain, effects: tuple[Effect, ...], q: Any, u: Any, duration: float
) -> Any:
    """Return the rates (1/s) at which starts in balance leave it, and 0 for all others.

    q (rad), u (rad/s) and the numbers of chain and effects may be those of runs side by side,
    shape (lanes,).
    """
    lanes = np.broadcast_shapes(*map(np.shape, (*q, *u)))
    places, rates = np.empty((4, 9, *lanes)), np.empty((2, 9, *lanes))
    for place, start in zip(places, (*q, *u), strict=True):
        place[:] = start
    moved, found = places.reshape(4, 9, -1), rates.reshape(2, 9, -1)
    moved += _CHANGES[:, :, None]
    with np.errstate(all="ignore"):
        given = (places[0], places[1]), (places[2], places[3])
        _, (rates[0], rates[1]) = EQUATIONS["lagrange"].rates(chain, effects, *given, 0.0)
        slopes = (found[:, 1:5] - found[:, 5:]).transpose(2, 0, 1) / (2 * _CHANGE)
        speeds, accelerations = np.abs(moved[2:, 0]), np.abs(found[:, 0])
        paces = np.maximum(speeds.max(axis=0), np.sqrt(accelerations.max(axis=0)))
        growth = _growth(slopes, paces)
        balanced = (paces < _SLOW * growth) & (growth * duration > 1)
    return np.where(balanced, growth, 0.0).reshape(lanes)


def _growth(slopes: Array, paces: Array) -> Array:
    """Return the largest real parts of the eigenvalues (1/s) of motions of slow pace, 0 of others.

    `slopes`, shape (n, 2, 4), are the derivatives of accelerations by q and u.
    """
    growth = np.zeros(len(slopes))
    # The norm bounds the square of the growth by forces, or the growth by damping.
    bound = np.abs(slopes).sum(axis=2).max(axis=1)
    slow = np.flatnonzero(paces < _SLOW * np.maximum(np.sqrt(bound), bound))
    slow = slow[np.isfinite(slopes[slow]).all(axis=(1, 2))]
    if len(slow):
        linear = np.zeros((len(slow), 4, 4))
        linear[:, :2, 2:] = np.eye(2)
        linear[:, 2:] = slopes[slow]
        growth[slow] = np.linalg.eigvals(linear).real.max(axis=1)
    return growth
