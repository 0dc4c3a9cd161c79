"""The ends of runs in lanes, each corrected by the error that its steps have carried."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.alone import round_off_of_loads
from twolink.ensembles.blocks import ROUNDING, Ends, Lanes
from twolink.ensembles.carried_bounds import corrected, known, of_last_steps
from twolink.ensembles.compiled import FORMULATION, System
from twolink.ensembles.error import sizes_of, states_of
from twolink.ensembles.following import check_rates
from twolink.ensembles.lane_rows import Rows, Settings
from twolink.ensembles.marching import Begun, marched
from twolink.ensembles.quantity import Accumulator
from twolink.ensembles.step import compiled_step
from twolink.ensembles.watching import Watch
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.longest_step import paces
from twolink.simulation.smooth.round_off import A_VALUE

Array = NDArray[np.float64]

# The tolerance of a step (rad/s) for an accuracy, by which six of seven random falls over 10 s
# reach it, and the least one, at which round-off is larger.
_OF_ACCURACY, _LEAST = 1e-6, 1e-15

# The round-off of loads in other poses, relative to that in the pose of the start.
_OF_LOADS = 4.0


def tolerances(accuracy: float) -> list[float]:
    """Return the tolerances of steps (rad/s) for an accuracy (rad, rad/s), the least one last."""
    first = max(_OF_ACCURACY * accuracy, _LEAST)
    return [first, _LEAST] if first > _LEAST else [first]


class Carried(NamedTuple):
    """Runs at their ends: bounds on their errors (rad, rad/s), and which of them are lost, (n,).

    `improvable` are those that shorter steps may make accurate enough, and `steps` is the number of
    steps of those that are not lost.
    """

    ends: Ends
    bounds: Array
    lost: Any
    improvable: Any
    steps: int


@np.errstate(all="ignore")
def carried_ends(
    system: System,
    lanes: Lanes,
    numbers: Array,
    tolerance: float,
    accuracy: float,
    accumulators: Sequence[Accumulator] = (),
    *,
    brief: bool = False,
) -> Carried:
    """Return the ends of runs by steps of a tolerance (rad/s), for an accuracy (rad, rad/s).

    `numbers` are the parameters, shape (parameters, n). Accumulators receive the steps that they
    ask for; runs that are `brief` end where these need no more.
    """
    runs = _begun(system, lanes, numbers, tolerance)
    if accumulators:
        watch = Watch(runs, accumulators, brief)
        rows = Rows.of(marched(compiled_step(system, paths=True), runs, watch))
        watch.show(system)
    else:
        rows = Rows.of(marched(compiled_step(system), runs))
    lost = ~np.isfinite(rows.state).all(axis=0)
    # The last step of a run that ends early is not yet in its region.
    bounds = corrected(rows) + of_last_steps(rows, tolerance)
    # The part of a region that is larger than its centre is round-off that has grown.
    improvable = (bounds > accuracy) & (rows.spread - rows.shift <= accuracy)
    return Carried(
        _ends(lanes, rows, bounds, lost),
        bounds,
        lost,
        ~known(bounds) | improvable,
        int(rows.steps[~lost].sum()),
    )


def _begun(system: System, lanes: Lanes, numbers: Array, tolerance: float) -> Begun:
    """Return the runs at their start, NaN for those that have none."""
    chain, effects, q, u, duration = lanes
    longest = paces(chain, effects, tuple(q), tuple(u), duration).longest_step
    cap = np.broadcast_to(longest, q[0].shape)
    p = EQUATIONS[FORMULATION].from_speeds(chain, tuple(q), tuple(u))
    start = np.array([*q, *np.broadcast_arrays(*p)])
    start[:, ~np.isfinite(cap)] = np.nan
    shared, independent = round_off_of_loads(lanes, of_time=system.depends_on_time)
    own = Settings(np.full_like(cap, tolerance), cap, *_OF_LOADS * shared, *_OF_LOADS * independent)
    return Begun(start, np.concatenate([numbers, own]), duration)


def _ends(lanes: Lanes, rows: Rows, bounds: Array, lost: Any) -> Ends:
    """Return the ends of runs from their last rows."""
    # After a last step of length 0 these are the rates in the state.
    at_the_end = np.where(rows.last == 0, rows.state, np.nan)
    check_rates(lanes, at_the_end, rows.rates, lanes.duration)
    fine = known(bounds)
    corrected_by = np.where(fine, rows.low - rows.centre, 0.0)
    states = states_of(lanes.chain, rows.state + corrected_by)
    errors = bounds + A_VALUE * ROUNDING * sizes_of(lanes.chain, states)
    errors = np.where(lost, np.nan, np.where(fine, errors, np.inf))
    return Ends(states[:2], states[2:], errors)
