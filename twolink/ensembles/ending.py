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
        starts = np.array([*q, *np.broadcast_arrays(*second)])
        found = _Motions(
            order, np.full((4, PLACES + 1, len(cap)), np.nan), np.zeros(len(cap)), lost
        )
        sequence = np.argsort(lengths, kind="stable")
        left = sequence[~lost[sequence]]
        slopes, times = np.full_like(starts, np.nan), np.zeros(len(cap))
        states = slopes.copy()
        with self.system.integrator(order, WIDTH).lend() as integrator:
            for first in range(0, len(left), WIDTH):
                group = left[first : first + WIDTH]
                while len(group):
                    filled = group[np.arange(WIDTH) % len(group)]
                    fine = self._group(integrator, starts, cap, filled, found)[: len(group)]
                    if fine.all():
                        states[:, filled], slopes[:, filled] = integrator.tc[:, :2].swapaxes(0, 1)
                        times[filled] = integrator.time - integrator.last_h
                        break
                    # heyoka ends all lanes where one is no longer finite.
                    lost[group[~fine]] = True
                    group = group[fine]
        check_rates(self.lanes, states, slopes, times)
        return found

    def _group(
        self, integrator: Any, starts: Array, cap: Array, group: Any, found: _Motions
    ) -> Any:
        """Make the motions of a group, and return which are not lost, shape (WIDTH,)."""
        integrator.state[:] = starts[:, group]
        # Equations have no parameters after the last one that they use.
        integrator.pars[:] = self.numbers[: len(integrator.pars), group]
        integrator.set_time(0.0)
        times = np.repeat(np.linspace(0.0, self.lanes.duration, PLACES + 1)[:, None], WIDTH, axis=1)
        _, grid = integrator.propagate_grid(times, max_delta_t=cap[group], max_steps=MOST_STEPS)
        found.variables[:, :, group] = grid.transpose(1, 0, 2)
        outcomes, _, _, steps = zip(
            *(result[:4] for result in integrator.propagate_res), strict=True
        )
        found.steps[group] = steps
        ends = heyoka().taylor_outcome
        return np.array(
            [outcome not in (ends.err_nf_state, ends.step_limit) for outcome in outcomes]
        )
