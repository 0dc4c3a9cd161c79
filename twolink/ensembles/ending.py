"""The ends of runs of a smooth scene in lanes, and steps before the end only where they are needed.

The error is measured as in `following`: twice the difference from a judge of four more orders, and
round-off. The two are compared at evenly spaced times, the places, through which heyoka goes in one
call: a call of Python after each step would cost more than the step. The judge of a run serves as
the next kept run, where the first one is not accurate enough.

Where angles are watched, the judge integrates the squares of both speeds as well. By the inequality
of Cauchy and Schwarz an angle turns between two places by no more than the root of their distance
in time times the integral of its squared speed. Few intervals remain in which an angle may reach a
level; they are looked at step by step (`looking`). A run ends where nothing more of it counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Ends, Lanes, Spans
from twolink.ensembles.compiled import FORMULATION, PATH_UNIT, System
from twolink.ensembles.following import MOST_STEPS, check_rates, error_bounds
from twolink.ensembles.looking import CloserLook, Intervals
from twolink.ensembles.quantity import Accumulator
from twolink.errors import SimulationError
from twolink.simulation.pool import IntegratorPool
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.measure import MORE_ORDERS, truncation
from twolink.simulation.smooth.taylor import longest_steps

Array = NDArray[np.float64]

WIDTH = 8
"""Runs that are integrated at once, in one register of AVX-512: the least cost of unrolled code."""

PLACES = 32
"""Intervals of a run at whose ends its error is measured."""

# Intervals after which runs may end early: fewer cost more calls, and more cost steps in vain.
_IN_A_PART = 8

# Intervals that are looked at together, which bounds their memory.
_LOOKS = 512

# The relative error of the integral of a squared speed, which has the truncation of a step, is far
# below this at all orders.
_OF_AN_INTEGRAL = 1e-3

# Paths (rad) so short that errors of the integral need not be small beside it.
_SHORT = 1e-4


@dataclass
class _Motions:
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

    def of(self, chosen: Any) -> _Motions:
        """Return some of the motions."""
        rows = (self.variables, self.steps, self.taken, self.lost, self.reached)
        return _Motions(self.order, self.paths, *(each[..., chosen] for each in rows))

    def pool(self, system: System) -> IntegratorPool:
        """Return the integrators that make them."""
        return system.integrator(self.order, WIDTH, paths=self.paths)


class _Known(NamedTuple):
    """What the errors of runs depend on, as `error_bounds` has it: up to now, shape (…, n)."""

    differences: Array
    sizes: Array
    growths: Array

    def note(self, which: Any, others: Sequence[Array]) -> None:
        """Raise all for some runs, which may come more than once."""
        for own, new in zip(self, others, strict=True):
            np.maximum.at(own, which, new)


@dataclass
class Ending:
    """Runs side by side, of which only the ends are wanted, and what accumulators ask for.

    `numbers` are the parameters, shape (parameters, n). `growths` are the growths of errors that
    pairs of lower orders have measured, shape (n,). With `paths` angles are watched between places,
    and runs that are `brief` end where all is known.
    """

    system: System
    lanes: Lanes
    numbers: Array
    growths: Array
    paths: bool = False
    brief: bool = False
    _judge: _Motions | None = None
    _cap: Array = field(init=False)
    _times: Array = field(init=False)

    def __post_init__(self) -> None:
        """Compute the longest steps (s), shape (n,), and the times of the places (s)."""
        chain, effects, q, u, duration = self.lanes
        with np.errstate(all="ignore"):
            self._cap = np.asarray(longest_steps(chain, effects, tuple(q), tuple(u), duration))
        self._times = np.linspace(0.0, duration, PLACES + 1)

    @classmethod
    def at_the_start(
        cls,
        system: System,
        lanes: Lanes,
        numbers: Array,
        *,
        paths: bool = False,
        brief: bool = False,
    ) -> Ending:
        """Return runs of which nothing is known."""
        return cls(system, lanes, numbers, np.zeros(lanes.width), paths, brief)

    def of(self, chosen: Any) -> Ending:
        """Return some of the runs, by their places, shape (m,)."""
        judge = None if self._judge is None else self._judge.of(chosen)
        own = self._lanes_of(chosen), self.numbers[:, chosen], self.growths[chosen]
        return Ending(self.system, *own, self.paths, self.brief, judge)

    def ends(self, order: int, accumulators: Sequence[Accumulator] = ()) -> tuple[Ends, Any, int]:
        """Return the ends by an order, which runs have none, shape (n,), and the steps taken.

        Accumulators receive the steps that they ask for.
        """
        again = self._judge is not None and self._judge.order == order
        kept = self._judge if again and self._judge else self._begun(order, paths=False)
        judge = self._judge = self._begun(order + MORE_ORDERS, paths=self.paths)
        taken = -kept.steps.sum()
        width = self.lanes.width
        known = _Known(np.zeros(width), np.zeros(width), self.growths)
        asked: list[Intervals] = []
        going, done = np.flatnonzero(~kept.lost), np.zeros(width, bool)
        stride = _IN_A_PART if self.brief else PLACES
        for first in range(0, PLACES, stride):
            places = slice(first, first + stride + 1)
            if not again:
                self._go_on(kept, going, places, kept.taken)
            going = going[~kept.lost[going] & (kept.reached[going] >= first + stride)]
            self._go_on(judge, going, places, kept.steps if again else kept.taken)
            going = going[~judge.lost[going]]
            found, errors = self._compared(kept, judge, going, places, known)
            if self.paths and len(going):
                asked.append(self._asked(kept, judge, going, places, found, errors, accumulators))
            known.note(going, [rows[-1] for rows in found])
            if self.brief:
                done = np.logical_and.reduce([each.known() for each in accumulators])
                going = going[~done[going]]
        lost = kept.lost | judge.lost | ((judge.reached < PLACES) & ~done)
        self._look(kept, judge, asked, accumulators, known, lost)
        states = self._states(self.lanes, kept.variables[:4, -1])
        errors = error_bounds(known.differences, known.sizes, kept.steps, known.growths)
        taken += kept.steps.sum()
        return Ends(states[:2], states[2:], np.where(lost, np.nan, errors)), lost, int(taken)

    def _begun(self, order: int, *, paths: bool) -> _Motions:
        """Return motions by an order at their starts."""
        chain, _, q, u, _ = self.lanes
        with np.errstate(all="ignore"):
            second = EQUATIONS[FORMULATION].from_speeds(chain, tuple(q), tuple(u))
        width = self.lanes.width
        variables = np.full((6 if paths else 4, PLACES + 1, width), np.nan)
        variables[:4, 0] = [*q, *np.broadcast_arrays(*second)]
        variables[4:, 0] = 0.0
        steps, taken = np.zeros((2, width))
        lost = ~np.isfinite(self._cap)
        return _Motions(order, paths, variables, steps, taken, lost, np.zeros(width, int))

    def _go_on(self, motions: _Motions, runs: Any, places: slice, lengths: Array) -> None:
        """Continue some motions through places; runs of similar `lengths` are side by side.

        They wait least for each other.
        """
        sequence = runs[np.argsort(lengths[runs], kind="stable")]
        count = len(sequence)
        # Lanes without a run repeat others.
        slots = sequence[np.arange(-(-count // WIDTH) * WIDTH) % max(1, count)]
        times = np.repeat(self._times[places, None], WIDTH, axis=1)
        made = _Made.of(len(slots) // WIDTH, len(times), len(motions.variables))
        starts = motions.variables[:, places.start]
        given = _Given(starts[:, slots], self.numbers[:, slots], self._cap[slots])
        with motions.pool(self.system).lend() as integrator:
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
        motions.variables[:, places, sequence] = _side_by_side(made.grid)[..., :count].swapaxes(
            0, 1
        )
        steps = made.steps.ravel()[:count]
        motions.taken[sequence] = steps
        motions.steps[sequence] += steps
        motions.reached[sequence] = places.stop - 1
        if places.start == 0:
            left = ~motions.lost[sequence]
            self._check(sequence[left], _side_by_side(made.ends)[:, :count][:, left])

    def _check(self, runs: Any, ends: Array) -> None:
        """Raise `SimulationError` unless the rates in a step are those of the formulas.

        `ends`, shape (2 variables + 1, n), has the variables, their rates, and the times (s).
        """
        whole = np.full((len(ends), self.lanes.width), np.nan)
        whole[:, runs] = ends
        rates = whole[len(ends) // 2 : -1]
        check_rates(self.lanes, whole[:4], rates[:4], whole[-1])
        squares = PATH_UNIT * rates[:2] ** 2
        if len(rates) > 4 and (np.abs(rates[4:] - squares) > _OF_AN_INTEGRAL * squares).any():
            raise SimulationError(
                "the integrals of squared speeds must have these as their rates; got others:"
                " please report this"
            )

    def _compared(
        self, kept: _Motions, judge: _Motions, runs: Any, places: slice, known: _Known
    ) -> tuple[_Known, Array]:
        """Return what is known of errors at places, and the bounds on them: shape (places, n)."""
        lanes = self._lanes_of(runs)
        states, judged = (
            self._states(lanes, each.variables[:4, places, runs]) for each in (kept, judge)
        )
        differences = np.abs(judged - states).max(axis=0)
        differences[np.isnan(differences)] = np.inf
        sizes = np.abs(states).max(axis=0)
        before = _Known(*(rows[runs] for rows in known))
        differences = np.maximum.accumulate(np.maximum(differences, before.differences))
        sizes = np.maximum.accumulate(np.maximum(sizes, before.sizes))
        growths = np.maximum(before.growths, differences / truncation(kept.order))
        errors = error_bounds(differences, sizes, kept.steps[runs], growths)
        return _Known(differences, sizes, growths), errors

    def _asked(
        self,
        kept: _Motions,
        judge: _Motions,
        runs: Any,
        places: slice,
        found: _Known,
        errors: Array,
        accumulators: Sequence[Accumulator],
    ) -> Intervals:
        """Return the intervals between places whose steps are needed."""
        variables = judge.variables[:, places, runs]
        lengths = np.diff(self._times[places])[:, None]
        squares = (1 + _OF_AN_INTEGRAL) * lengths * np.diff(variables[4:], axis=1) / PATH_UNIT
        paths = np.sqrt(np.maximum(squares, 0.0) + _SHORT**2)
        spans = Spans(runs, variables[:2], paths, errors[1:])
        needed = np.zeros(errors[1:].shape, bool)
        for each in accumulators:
            needed |= each.open_spans(spans)
        first, lanes = np.nonzero(needed)
        place, which = places.start + first, runs[lanes]
        return Intervals(
            which,
            self._times[place],
            self._times[place + 1],
            kept.variables[:, place, which],
            judge.variables[:, place, which],
            found.differences[first, lanes],
            found.sizes[first, lanes],
            kept.steps[which],
            found.growths[first, lanes],
        )

    def _look(
        self,
        kept: _Motions,
        judge: _Motions,
        asked: Sequence[Intervals],
        accumulators: Sequence[Accumulator],
        known: _Known,
        lost: Any,
    ) -> None:
        """Give the steps of intervals to the accumulators, and note what they show of errors."""
        if not asked:
            return
        intervals = Intervals(*(np.concatenate(rows, axis=-1) for rows in zip(*asked, strict=True)))
        pools = kept.pool(self.system), judge.pool(self.system)
        for first in range(0, len(intervals.which), _LOOKS):
            part = intervals.of(slice(first, first + _LOOKS))
            which = part.which
            lanes, numbers = self._lanes_of(which), self.numbers[:, which]
            look = CloserLook(kept.order, *pools, lanes, numbers, self._cap[which], part)
            for block in look.blocks():
                for each in accumulators:
                    each.add(block)
            now = look.intervals
            known.note(which, (now.differences, now.sizes, now.growths))
            lost[which[look.lost]] = True

    def _lanes_of(self, chosen: Any) -> Lanes:
        """Return the lanes of some runs, shape (m,)."""
        _, _, q, u, duration = self.lanes
        return self.system.lanes(self.numbers[:, chosen], q[:, chosen], u[:, chosen], duration)

    def _states(self, lanes: Lanes, variables: Array) -> Array:
        """Return q and u of variables, both of shape (4, …, n)."""
        q, second = variables[:2], variables[2:]
        with np.errstate(all="ignore"):
            u = EQUATIONS[FORMULATION].to_speeds(lanes.chain, tuple(q), tuple(second))
        return np.array([*q, *u])


class _Given(NamedTuple):
    """States of runs, (variables, n), their parameters, (parameters, n), and longest steps (s)."""

    states: Array
    numbers: Array
    cap: Array

    def of(self, group: Any) -> _Given:
        """Return those of some runs."""
        return _Given(self.states[:, group], self.numbers[:, group], self.cap[group])


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


def _lost(integrator: Any, given: _Given, times: Array, grid: Array) -> Any:
    """Make the motions of a group into a grid, and return which are lost, shape (WIDTH,)."""
    integrator.state[:] = given.states
    if len(given.numbers):
        # Equations have no parameters after the last one that they use.
        integrator.pars[:] = given.numbers[: len(integrator.pars)]
    integrator.set_time(times[0, 0])
    _, grid[:] = integrator.propagate_grid(times, max_delta_t=given.cap, max_steps=MOST_STEPS)
    # A lane that is lost or has taken too many steps does not come to the last place.
    return ~np.isfinite(grid[-1]).all(axis=0)
