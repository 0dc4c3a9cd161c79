"""The ends of runs in lanes, each corrected by the error that its steps have carried.

The result is the state less the centre of the region of its error (`deviations`). What is left is
within the region. A part of the correction is added to the bound, for all that the linearized
motion does not show.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.alone import round_off_of_loads
from twolink.ensembles.blocks import ROUNDING, Ends, Lanes
from twolink.ensembles.compiled import FORMULATION, System
from twolink.ensembles.error import LINEAR, sizes_of, states_of
from twolink.ensembles.following import check_rates
from twolink.ensembles.marching import Begun, marched
from twolink.ensembles.step import ROWS, Rows, Settings, compiled_step
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.longest_step import longest_steps
from twolink.simulation.smooth.round_off import A_VALUE

Array = NDArray[np.float64]

OF_CORRECTIONS = 0.1
"""The part of the largest correction that is added to the bound of an error."""

# The tolerance of a step (rad/s) for an accuracy, by which nine of ten random falls over 10 s reach
# it, and the least one, at which round-off is larger.
_OF_ACCURACY, _LEAST = 1e-6, 1e-15

# The round-off of loads in other poses, relative to that in the pose of the start.
_OF_LOADS = 4.0


def carried_ends(
    system: System, lanes: Lanes, numbers: Array, accuracy: float
) -> tuple[Ends, Array, int]:
    """Return the ends of runs, which of them are lost, shape (n,), and the steps of the others.

    `numbers` are the parameters, shape (parameters, n). Runs that are not accurate enough (rad,
    rad/s) are made again by shorter steps if these can improve them.
    """
    tolerance = max(_OF_ACCURACY * accuracy, _LEAST)
    with np.errstate(all="ignore"):
        rows = _marched(system, lanes, numbers, tolerance)
        again = np.flatnonzero(_improves(Rows.of(rows), accuracy))
        if tolerance > _LEAST and len(again):
            own, q, u = numbers[:, again], lanes.q[:, again], lanes.u[:, again]
            other = _marched(system, system.lanes(own, q, u, lanes.duration), own, _LEAST)
            better = ~(_bounds(Rows.of(other)) >= _bounds(Rows.of(rows[:, again])))
            rows[:, again[better]] = other[:, better]
        return _ends(lanes, Rows.of(rows))


def _marched(system: System, lanes: Lanes, numbers: Array, tolerance: float) -> Array:
    """Return the last rows of runs, NaN for those that have no start or no end."""
    chain, effects, q, u, duration = lanes
    longest = longest_steps(chain, effects, tuple(q), tuple(u), duration)
    cap = np.broadcast_to(longest, q[0].shape)
    p = EQUATIONS[FORMULATION].from_speeds(chain, tuple(q), tuple(u))
    start = np.array([*q, *np.broadcast_arrays(*p)])
    going = np.isfinite(cap) & np.isfinite(start).all(axis=0)
    shared, independent = round_off_of_loads(lanes, of_time=system.depends_on_time)
    own = Settings(np.full_like(cap, tolerance), cap, *_OF_LOADS * shared, *_OF_LOADS * independent)
    parameters = np.concatenate([numbers, own])[:, going]
    rows = np.full((ROWS, lanes.width), np.nan)
    rows[:, going] = marched(compiled_step(system), Begun(start[:, going], parameters, duration))
    return rows


def _bounds(rows: Rows) -> Array:
    """Return bounds on the errors of states that are corrected (rad, rad/s), shape (n,).

    They are infinite where the region is no longer finite: its largest size so far leaves NaN out.
    """
    finite = np.isfinite([*rows.centre, *rows.shape]).all(axis=0)
    return np.where(finite, rows.spread + OF_CORRECTIONS * rows.shift, np.inf)


def _improves(rows: Rows, accuracy: float) -> Any:
    """Return which runs shorter steps may make accurate enough, or give a known error.

    The part of a region that is larger than its centre is round-off that has grown.
    """
    unknown = ~(_bounds(rows) <= LINEAR)
    return unknown | ((_bounds(rows) > accuracy) & (rows.spread - rows.shift <= accuracy))


def _ends(lanes: Lanes, rows: Rows) -> tuple[Ends, Array, int]:
    """Return the ends of runs from their last rows."""
    lost = ~np.isfinite(rows.state).all(axis=0)
    # After a last step of length 0 these are the rates in the state.
    check_rates(lanes, rows.state, rows.rates, lanes.duration)
    bounds = _bounds(rows)
    known = bounds <= LINEAR
    states = states_of(lanes.chain, np.where(known, rows.state - rows.centre, rows.state))
    errors = bounds + A_VALUE * ROUNDING * sizes_of(lanes.chain, states)
    errors = np.where(lost, np.nan, np.where(known, errors, np.inf))
    return Ends(states[:2], states[2:], errors), lost, int(rows.steps[~lost].sum())
