"""Runs that lanes would judge by a difference that does not show their error.

Two runs side by side have one precision. They share the round-off of a pose in balance, from which
the motion grows, and that of loads whose terms nearly cancel. Such runs are made by themselves, by
their own defects.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import ROUNDING, Lanes
from twolink.ensembles.compiled import FORMULATION
from twolink.names import EquationsName
from twolink.simulation.smooth.changes import poses_near
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.load_sizes import LoadSizes, force_sizes
from twolink.simulation.smooth.longest_step import paces

Array = NDArray[np.float64]

# Times at which loads are looked at, in the pose of the start and in others.
_LOOKS = 9

# Round-off of loads, in roundings of the largest ones, above which their terms cancel, and in
# roundings of the speed over the longest step, above which it counts beside those of states.
_CANCELLING, _COUNTING = 8.0, 8.0


def shares_round_off(lanes: Lanes, *, carried: bool = False, of_time: bool = True) -> Any:
    """Return which runs have an error that two runs in float64 share, shape (n,).

    Where their own steps have `carried` the round-off of loads, only terms that cancel count, since
    float64 has too few digits for these. Loads are looked at over time if they are functions
    `of_time`.
    """
    chain, effects, q, u, duration = lanes
    longest, leaving = paces(chain, effects, tuple(q), tuple(u), duration)
    looks = _LOOKS if of_time else 1
    cancelling = _cancel(lanes, looks, longest, spread=not carried)
    return np.broadcast_to(leaving > 0, lanes.width) | cancelling


def round_off_of_loads(lanes: Lanes, *, of_time: bool) -> tuple[Array, Array]:
    """Return the round-off of generalized forces (N m), shape (2, n), near the start.

    The first is shared by like states, and the second independent in each. Loads are looked at
    over time if they are functions `of_time`.
    """
    shared, independent = np.zeros((2, 2, lanes.width))
    for in_pose in _looks(lanes, FORMULATION, _LOOKS if of_time else 1):
        for found in in_pose:
            shared = np.maximum(shared, ROUNDING * found.excess)
            independent = np.maximum(independent, ROUNDING * found.spread)
    return shared, independent


def _looks(lanes: Lanes, formulation: EquationsName, count: int) -> Iterator[Iterator[LoadSizes]]:
    """Yield the sizes of loads in some poses, in each at evenly spaced times.

    Loads may vanish, or not cancel, in the pose of the start.
    """
    chain, effects, start, speeds, duration = lanes
    for q, u in poses_near((start, speeds)):

        def at(t: float, q: Any = q, u: Any = u) -> LoadSizes:
            found = force_sizes(chain, effects, q, u, np.full(lanes.width, t))
            return found.given(chain, formulation, q)

        yield map(at, np.linspace(0.0, duration, count))


def _cancel(lanes: Lanes, looks: int, longest: Any, *, spread: bool) -> Any:
    """Return which runs have large loads whose terms nearly cancel, shape (n,).

    Their steps are at most the `longest` (s). With `spread` the round-off that is independent in
    each state counts as well.
    """
    found = np.zeros(lanes.width, bool)
    fastest = np.maximum(1.0, np.abs(lanes.u).max(axis=0))
    for in_pose in _looks(lanes, EQUATIONS[FORMULATION].in_speeds, looks):
        largest, beyond = np.zeros((2, lanes.width))
        for sizes in in_pose:
            largest = np.maximum(largest, (sizes.errors - sizes.excess).max(axis=0))
            own = sizes.excess + sizes.spread if spread else sizes.excess
            beyond = np.maximum(beyond, own.max(axis=0))
        found |= (longest * beyond > _COUNTING * fastest) & (beyond > _CANCELLING * largest)
    return found
