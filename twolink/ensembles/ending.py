"""The ends of runs of a smooth scene in lanes, where nothing before the end is kept.

The error is measured as in `following`: twice the difference from a judge of four more orders, and
round-off. The two are compared at evenly spaced times, through which heyoka goes in one call: a
call of Python after each step would cost more than the step. The judge of a run serves as the next
kept run, where the first one is not accurate enough.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Ends, Lanes
from twolink.ensembles.compiled import FORMULATION, System
from twolink.ensembles.following import MOST_STEPS, check_rates, error_bounds
from twolink.optional import heyoka
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.measure import MORE_ORDERS, truncation
from twolink.simulation.smooth.taylor import longest_steps

Array = NDArray[np.float64]

WIDTH = 8
"""Runs that are integrated at once, in one register of AVX-512: the least cost of unrolled code."""

PLACES = 32
"""Intervals of a run at whose ends its error is measured."""


class _Motions(NamedTuple):
    """Motions of an order: variables at evenly spaced times, shape (4, places, n), and steps (n,).

    `lost` says which have no end, shape (n,).
    """

    order: int
    variables: Array
    steps: Array
    lost: Any

    def of(self, chosen: Any) -> _Motions:
        """Return some of the motions."""
        return _Motions(
            self.order, self.variables[:, :, chosen], self.steps[chosen], self.lost[chosen]
        )


@dataclass
class Ending:
    """Runs side by side, of which only the ends are wanted.

    `numbers` are the parameters, shape (parameters, n). `growths` are the growths of errors that
    pairs of lower orders have measured, shape (n,).
    """

    system: System
    lanes: Lanes
    numbers: Array
    growths: Array
    _judge: _Motions | None = None

    @classmethod
    def at_the_start(cls, system: System, lanes: Lanes, numbers: Array) -> Ending:
        """Return runs of which nothing is known."""
        return cls(system, lanes, numbers, np.zeros(lanes.width))

    def of(self, chosen: Any) -> Ending:
        """Return some of the runs, by their places, shape (m,)."""
        _, _, q, u, duration = self.lanes
        numbers = self.numbers[:, chosen]
        lanes = self.system.lanes(numbers, q[:, chosen], u[:, chosen], duration)
        judge = None if self._judge is None else self._judge.of(chosen)
        return Ending(self.system, lanes, numbers, self.growths[chosen], judge)

    def ends(self, order: int) -> tuple[Ends, Any, int]:
        """Return the ends by an order, which runs have none, shape (n,), and the steps taken."""
        if self._judge is not None and self._judge.order == order:
            kept, taken = self._judge, 0
        else:
            kept = self._motions(order, np.zeros(self.lanes.width, bool), self.growths)
            taken = int(kept.steps.sum())
        # Runs of like numbers of steps side by side wait least for each other.
        judge = self._motions(order + MORE_ORDERS, kept.lost, kept.steps)
        self._judge = judge
        states, judged = self._states(kept.variables), self._states(judge.variables)
        differences = np.abs(judged - states).max(axis=(0, 1))
        differences[np.isnan(differences)] = np.inf
        np.maximum(self.growths, differences / truncation(order), out=self.growths)
        sizes = np.abs(states).max(axis=(0, 1))
        errors = error_bounds(differences, sizes, kept.steps, self.growths)
        return Ends(states[:2, -1], states[2:, -1], errors), judge.lost, taken

    def _states(self, variables: Array) -> Array:
        """Return q and u, shape (4, places, n), of variables of this shape."""
        q, second = variables[:2], variables[2:]
        with np.errstate(all="ignore"):
            u = EQUATIONS[FORMULATION].to_speeds(self.lanes.chain, tuple(q), tuple(second))
        return np.array([*q, *u])

    def _motions(self, order: int, lost: Any, lengths: Array) -> _Motions:
        """Return the motions by an order, but for those lost; groups are of similar `lengths`."""
        chain, effects, q, u, duration = self.lanes
        with np.errstate(all="ignore"):
            cap = np.asarray(longest_steps(chain, effects, tuple(q), tuple(u), duration))
            second = EQUATIONS[FORMULATION].from_speeds(chain, tuple(q), tuple(u))
        lost = lost | ~np.isfinite(cap)
        sequence = np.argsort(lengths, kind="stable")
        left = sequence[~lost[sequence]]
        # Lanes without a run repeat others.
        slots = left[np.arange(-(-len(left) // WIDTH) * WIDTH) % max(1, len(left))]
        made = _Slots.of(len(slots))
        given = _Given(np.array([*q, *np.broadcast_arrays(*second)]), self.numbers, cap)
        times = np.repeat(np.linspace(0.0, duration, PLACES + 1)[:, None], WIDTH, axis=1)
        with self.system.integrator(order, WIDTH).lend() as integrator:
            for first in range(0, len(slots), WIDTH):
                lanes = slice(first, first + WIDTH)
                group, grid = slots[lanes], made.grid[:, :, lanes]
                while not (fine := _made(integrator, given.of(group), times, grid)).all():
                    # heyoka ends all lanes where one is no longer finite.
                    lost[group[~fine]] = True
                    if not fine.any():
                        break
                    group = np.where(fine, group, group[fine.argmax()])
                made.put(lanes, integrator)
        return self._in_order(order, left, made, lost)

    def _in_order(self, order: int, left: Any, made: _Slots, lost: Any) -> _Motions:
        """Return the motions of slots, each in the place of its run."""
        count, width = len(left), len(lost)
        steps, ends = np.zeros(width), np.full((9, width), np.nan)
        variables = np.full((4, PLACES + 1, width), np.nan)
        variables[:, :, left] = made.grid[:, :, :count].swapaxes(0, 1)
        steps[left], ends[:, left] = made.steps[:count], made.ends[:, :count]
        variables[:, :, lost] = ends[:, lost] = np.nan
        check_rates(self.lanes, ends[:4], ends[4:8], ends[8])
        return _Motions(order, variables, steps, lost)


class _Given(NamedTuple):
    """Starts of runs, (4, n), their parameters, (parameters, n), and longest steps (s), (n,)."""

    starts: Array
    numbers: Array
    cap: Array

    def of(self, group: Any) -> _Given:
        """Return those of some runs."""
        return _Given(self.starts[:, group], self.numbers[:, group], self.cap[group])


class _Slots(NamedTuple):
    """Motions in the order in which they are made: `grid` of shape (places, 4, n), steps (n,).

    `ends`, shape (9, n), has the variables, their rates, and the time (s) where the last step
    begins.
    """

    grid: Array
    steps: Array
    ends: Array

    @classmethod
    def of(cls, count: int) -> _Slots:
        """Return slots without motions."""
        return cls(np.empty((PLACES + 1, 4, count)), np.empty(count), np.empty((9, count)))

    def put(self, lanes: slice, integrator: Any) -> None:
        """Note the steps of the last run of an integrator."""
        coefficients = integrator.tc
        self.steps[lanes] = [result[3] for result in integrator.propagate_res]
        self.ends[:4, lanes], self.ends[4:8, lanes] = coefficients[:, 0], coefficients[:, 1]
        self.ends[8, lanes] = integrator.time - integrator.last_h


def _made(integrator: Any, given: _Given, times: Array, grid: Array) -> Any:
    """Make the motions of a group into a grid, and return which are not lost, shape (WIDTH,)."""
    integrator.state[:] = given.starts
    # Equations have no parameters after the last one that they use.
    integrator.pars[:] = given.numbers[: len(integrator.pars)]
    integrator.set_time(0.0)
    _, grid[:] = integrator.propagate_grid(times, max_delta_t=given.cap, max_steps=MOST_STEPS)
    ends = heyoka().taylor_outcome
    lost = ends.err_nf_state, ends.step_limit
    return np.array([result[0] not in lost for result in integrator.propagate_res])
