"""Bounds on the errors of runs in lanes, from their differences from judges.

The mechanism is that of `twolink.simulation.smooth.measure`: a run of order p is kept, and a second
run of order p + 4, the judge, has an error of at most half of it, so that twice their difference
bounds the error of the kept run; the round-off of sums and of the growth of errors is added.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.chain import Chain
from twolink.ensembles.blocks import ROUNDING, Lanes
from twolink.ensembles.compiled import FORMULATION
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.judging import MARGIN_OF_ORDERS, truncation
from twolink.simulation.smooth.moved_start import ON_EACH_STEP, ROUNDINGS, growth_of_moved
from twolink.simulation.smooth.round_off import A_VALUE, MOST_ROUND_OFF

Array = NDArray[np.float64]

LINEAR = 1e-2
"""The error (rad, rad/s) up to which errors grow in proportion; a larger one is unknown."""


class SoFar(NamedTuple):
    """Measures of runs up to a time: the largest of each, all of shape (…, n).

    `differences` from the judges and `sizes` of q and of the terms of u are in rad and rad/s,
    `growths` are those of errors.
    """

    differences: Array
    sizes: Array
    growths: Array

    @classmethod
    def at_the_start(cls, lanes: Lanes) -> SoFar:
        """Return the measures of runs that begin.

        The round-off of the first speeds, which all runs share, moves the angles by its product
        with the time.
        """
        chain, _, q, u, duration = lanes
        with np.errstate(all="ignore"):
            sizes = sizes_of(chain, np.concatenate([q, u]))
            moved = EQUATIONS[FORMULATION].rounded_speeds(chain, q, u).max(axis=0) * duration
        return cls(np.zeros(lanes.width), sizes, moved / MOST_ROUND_OFF)

    def of(self, which: Any) -> SoFar:
        """Return the measures of some rows, or of some runs."""
        return SoFar(*(rows[which] for rows in self))

    def with_states(
        self, chain: Chain, kept: Array, judged: Array, order: int, moves: Any = True
    ) -> SoFar:
        """Return the measures up to later times, shape (m, n), from q and u, (4, m, n), there.

        `kept` are the states of runs of an order. `moves`, shape (m, n), says where a run has not
        ended before; other states do not count.
        """
        apart = np.abs(judged - kept).max(axis=0)
        apart[np.isnan(apart)] = np.inf
        with np.errstate(all="ignore"):
            now = np.where(moves, [apart, sizes_of(chain, kept)], 0.0)
        differences = np.maximum.accumulate(np.maximum(now[0], self.differences))
        sizes = np.maximum.accumulate(np.maximum(now[1], self.sizes))
        return SoFar(differences, sizes, np.maximum(self.growths, differences / truncation(order)))

    def with_growth(self, apart: Array, later: Array | float = 0.0) -> SoFar:
        """Return the measures with the growth of errors of the start and of later steps, (m, n).

        `apart` are the distances at the times of the measures from runs of a moved start. The
        growth is infinite, as it is unknown, from where it is not in proportion any more. `later`
        is that of errors of later steps, where it may be larger.
        """
        largest = np.maximum.accumulate(np.where(np.isnan(apart), np.inf, apart))
        grown = ON_EACH_STEP * growth_of_moved(largest, ROUNDINGS * ROUNDING, LINEAR)
        growths = np.maximum(self.growths, np.maximum(grown, later))
        return self._replace(growths=growths)

    def bounds(self, steps: Array) -> Array:
        """Return bounds on the errors (rad, rad/s) of runs after some numbers of steps."""
        sums = (A_VALUE + steps) * ROUNDING * self.sizes
        grown = MOST_ROUND_OFF * ROUNDING * self.growths
        found = MARGIN_OF_ORDERS * self.differences + sums + grown
        return np.where(self.differences > LINEAR, np.inf, found)


def sizes_of(chain: Chain, states: Array) -> Array:
    """Return the largest angle (rad) or term of a speed (rad/s) of q and u, (4, …), shape (…)."""
    q, u = states[:2], states[2:]
    speeds = EQUATIONS[FORMULATION].rounded_speeds(chain, q, u)
    return np.asarray(np.maximum(np.abs(q), speeds).max(axis=0))


def states_of(chain: Chain, variables: Array) -> Array:
    """Return q (rad) and u (rad/s) of variables, both of shape (4, …)."""
    q, second = variables[:2], variables[2:]
    with np.errstate(all="ignore"):
        u = EQUATIONS[FORMULATION].to_speeds(chain, tuple(q), tuple(second))
    return np.array([*q, *u])


def states_at_ends(chain: Chain, variables: Array) -> Array:
    """Return q (rad) and u (rad/s), (4, m, n), of variables at the ends of steps, (m, 4, n)."""
    return states_of(chain, np.ascontiguousarray(variables.transpose(1, 0, 2)))
