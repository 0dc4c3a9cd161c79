"""Runs that lanes would judge by a difference that does not show their error.

Two runs side by side have one precision. They share the round-off of a pose in balance, from which
the motion grows, and that of loads whose terms nearly cancel. Such runs are made by themselves, by
their own defects.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from twolink.ensembles.blocks import Lanes
from twolink.ensembles.compiled import FORMULATION
from twolink.simulation.smooth.balance import rates_of_balance
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.load_sizes import sizes_of_loads
from twolink.simulation.smooth.longest_step import longest_steps

# Times at which loads are looked at, in the pose of the start.
_LOOKS = 9

# Round-off of loads, in roundings of the largest ones, above which their terms cancel, and in
# roundings of the speed over the longest step, above which it counts beside those of states.
_CANCELLING, _COUNTING = 8.0, 8.0


def shares_round_off(lanes: Lanes, *, of_time: bool = True) -> Any:
    """Return which runs have an error that two runs in float64 share, shape (n,).

    Loads are looked at over time if they are functions `of_time`.
    """
    chain, effects, q, u, duration = lanes
    balanced = rates_of_balance(chain, effects, tuple(q), tuple(u), duration) > 0
    return np.broadcast_to(balanced, lanes.width) | _cancel(lanes, _LOOKS if of_time else 1)


def _cancel(lanes: Lanes, looks: int) -> Any:
    """Return which runs have large loads whose terms nearly cancel, shape (n,)."""
    chain, effects, q, u, duration = lanes
    largest, beyond = np.zeros((2, lanes.width))
    longest = longest_steps(chain, effects, tuple(q), tuple(u), duration)
    for t in np.linspace(0.0, duration, looks):
        times = np.full(lanes.width, t)
        found = sizes_of_loads(chain, effects, EQUATIONS[FORMULATION].in_speeds, q, u, times)
        largest = np.maximum(largest, (found.errors - found.excess).max(axis=0))
        beyond = np.maximum(beyond, (found.excess + found.spread).max(axis=0))
    counts = longest * beyond > _COUNTING * np.maximum(1.0, np.abs(u).max(axis=0))
    return counts & (beyond > _CANCELLING * largest)
