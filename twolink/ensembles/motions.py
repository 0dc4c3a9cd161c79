"""Motions of runs in lanes from place to place: evenly spaced times, all of them in one call."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Lanes
from twolink.ensembles.compiled import FORMULATION, PATH_UNIT, System
from twolink.ensembles.following import MOST_STEPS, check_rates
from twolink.errors import SimulationError
from twolink.integration.outcomes import failed_lanes
from twolink.simulation.pool import IntegratorPool
from twolink.simulation.smooth.equations import EQUATIONS

Array = NDArray[np.float64]

WIDTH = 8
"""Runs that are integrated at once, in one register of AVX-512: the least cost of unrolled code."""

# The relative error of the integral of a squared speed, which has the truncation of a step, is far
# below this at all orders.
OF_AN_INTEGRAL = 1e-3


class Given(NamedTuple):
    """Runs side by side: what all their motions have in common.

    `numbers` are the parameters, shape (parameters, n), `cap` the longest steps (s), (n,), and
    `times` those of the places (s).
    """

    system: System
    lanes: Lanes
    numbers: Array
    cap: Array
    times: Array

    def lanes_of(self, chosen: Any) -> Lanes:
        """Return the lanes of some runs, shape (m,)."""
        _, _, q, u, duration = self.lanes
        return self.system.lanes(self.numbers[:, chosen], q[:, chosen], u[:, chosen], duration)


@dataclass
class Motions:
    """Motions of an order: variables at the places, shape (variables, places, n).

    Those with `paths` have their two integrals as the last variables. Of shape (n,) are all `steps`
    and those `taken` last, whether a motion is `lost`, and the last place that it has `reached`.
    """

    order: int
    paths: bool
    variables: Array
    steps: Array
    taken: Array
    lost: Any
    reached: Any

    def of(self, chosen: Any) -> Motions:
        """Return some of the motions."""
        rows = (self.variables, self.steps, self.taken, self.lost, self.reached)
        return Motions(self.order, self.paths, *(each[..., chosen] for each in rows))

    def pool(self, system: System) -> IntegratorPool:
        """Return the integrators that make them."""
        return system.integrator(self.order, WIDTH, paths=self.paths)


def begun(runs: Given, order: int, *, paths: bool) -> Motions:
    """Return motions by an order at their starts."""
    chain, _, q, u, _ = runs.lanes
    with np.errstate(all="ignore"):
        second = EQUATIONS[FORMULATION].from_speeds(chain, tuple(q), tuple(u))
    width = runs.lanes.width
    variables = np.full((6 if paths else 4, len(runs.times), width), np.nan)
    variables[:4, 0] = [*q, *np.broadcast_arrays(*second)]
    variables[4:, 0] = 0.0
    steps, taken = np.zeros((2, width))
    lost = ~np.isfinite(runs.cap)
    return Motions(order, paths, variables, steps, taken, lost, np.zeros(width, int))


def go_on(runs: Given, motions: Motions, which: Any, places: slice, lengths: Array) -> None:
    """Continue some motions through places; runs of similar `lengths` are side by side.

    They wait least for each other.
    """
    sequence = which[np.argsort(lengths[which], kind="stable")]
    count = len(sequence)
    # Lanes without a run repeat others.
    slots = sequence[np.arange(-(-count // WIDTH) * WIDTH) % max(1, count)]
    times = np.repeat(runs.times[places, None], WIDTH, axis=1)
    made = _Made.of(len(slots) // WIDTH, len(times), len(motions.variables))
    starts = motions.variables[:, places.start]
    given = _Group(starts[:, slots], runs.numbers[:, slots], runs.cap[slots])
    with motions.pool(runs.system).lend() as integrator:
        for number in range(len(slots) // WIDTH):
            lanes = slice(number * WIDTH, (number + 1) * WIDTH)
            group, own = slots[lanes], given.of(lanes)
            while (lost := _lost(integrator, own, times, made.grid[number])).any():
                # heyoka ends all lanes where one is no longer finite.
                motions.lost[group[lost]] = True
                if lost.all():
                    break
                others = np.where(lost, lost.argmin(), np.arange(WIDTH))
                group, own = group[others], own.of(others)
            made.put(number, integrator, rates=places.start == 0)
    motions.variables[:, places, sequence] = _side_by_side(made.grid)[..., :count].swapaxes(0, 1)
    steps = made.steps.ravel()[:count]
    motions.taken[sequence] = steps
    motions.steps[sequence] += steps
    motions.reached[sequence] = places.stop - 1
    if places.start == 0:
        left = ~motions.lost[sequence]
        _check(runs, sequence[left], _side_by_side(made.ends)[:, :count][:, left])


def _check(runs: Given, which: Any, ends: Array) -> None:
    """Raise `SimulationError` unless the rates in a step are those of the formulas.

    `ends`, shape (2 variables + 1, n), has the variables, their rates, and the times (s).
    """
    whole = np.full((len(ends), runs.lanes.width), np.nan)
    whole[:, which] = ends
    rates = whole[len(ends) // 2 : -1]
    check_rates(runs.lanes, whole[:4], rates[:4], whole[-1])
    squares = PATH_UNIT * rates[:2] ** 2
    if len(rates) > 4 and (np.abs(rates[4:] - squares) > OF_AN_INTEGRAL * squares).any():
        raise SimulationError(
            "the integrals of squared speeds must have these as their rates; got others:"
            " please report this"
        )


class _Group(NamedTuple):
    """States of runs, (variables, n), their parameters, (parameters, n), and longest steps (s)."""

    states: Array
    numbers: Array
    cap: Array

    def of(self, group: Any) -> _Group:
        """Return those of some runs."""
        return _Group(self.states[:, group], self.numbers[:, group], self.cap[group])


class _Made(NamedTuple):
    """Motions in groups: `grid`, (groups, places, variables, WIDTH), and `steps`, (groups, WIDTH).

    `ends`, shape (groups, 2 variables + 1, WIDTH), has the variables, their rates, and the time (s)
    where the last step begins.
    """

    grid: Array
    steps: Array
    ends: Array

    @classmethod
    def of(cls, groups: int, places: int, variables: int) -> _Made:
        """Return memory for motions."""
        grid = np.empty((groups, places, variables, WIDTH))
        return cls(grid, np.empty((groups, WIDTH)), np.empty((groups, 2 * variables + 1, WIDTH)))

    def put(self, group: int, integrator: Any, *, rates: bool) -> None:
        """Note the steps of the last run of an integrator, and its rates if they are wanted."""
        self.steps[group] = [result[3] for result in integrator.propagate_res]
        if rates:
            variables, first = integrator.tc[:, 0], integrator.tc[:, 1]
            begin = integrator.time - integrator.last_h
            np.concatenate([variables, first, begin[None]], out=self.ends[group])


def _side_by_side(groups: Array) -> Array:
    """Return rows of groups, shape (groups, …, WIDTH), as rows of shape (…, n)."""
    rows = np.moveaxis(groups, 0, -2)
    return rows.reshape(*rows.shape[:-2], -1)


def _lost(integrator: Any, given: _Group, times: Array, grid: Array) -> Any:
    """Make the motions of a group into a grid, and return which are lost, shape (WIDTH,)."""
    integrator.state[:] = given.states
    if len(given.numbers):
        # Equations have no parameters after the last one that they use.
        integrator.pars[:] = given.numbers[: len(integrator.pars)]
    integrator.set_time(times[0, 0])
    _, grid[:] = integrator.propagate_grid(times, max_delta_t=given.cap, max_steps=MOST_STEPS)
    failed = failed_lanes(integrator)
    # Where a lane fails, all of them end. One that takes too many steps ends alone.
    return failed if failed.any() else ~np.isfinite(grid[-1]).all(axis=0)
