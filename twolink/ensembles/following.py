"""Runs of a smooth scene in lanes, each with the measured error of its trajectory.

The error is bounded as in `error`; a run and its judge are compared at the end of every step.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import ROUNDING, Block, Ends, Lanes
from twolink.ensembles.compiled import FORMULATION, LANES, System
from twolink.ensembles.error import SoFar, states_at_ends, states_of
from twolink.ensembles.later_errors import LaterErrors
from twolink.ensembles.speeds import Speeds, derivatives, truncation_within
from twolink.errors import SimulationError
from twolink.integration.outcomes import failed_lanes
from twolink.simulation.smooth.equations import EQUATIONS, sizes_of_momentum_rates
from twolink.simulation.smooth.judging import MORE_ORDERS
from twolink.simulation.smooth.longest_step import paces
from twolink.simulation.smooth.moved_start import ACROSS, FORWARD, ROUNDINGS, Move, moved_start

Array = NDArray[np.float64]

# Steps that are kept at once. Their number is a part of the result: the last step of a run differs
# by a rounding where it begins a block.
_STEPS = 128

# A run of more steps than these is ended: it would take a minute.
MOST_STEPS = 4_000_000

PLACES = 64
"""Intervals of a run in each of which the growth of errors is known."""

# The time (s) between two places at which the judge is asked where a run has ended.
_BEYOND = 1e-9

# The largest relative difference of the rates of the compiled system and of the scene's formulas.
_SAME_RATES = 1e-9


class LostError(Exception):
    """Some lanes cannot be followed to the end: a mask of shape (lanes,)."""

    def __init__(self, lanes: Any) -> None:
        """Store the mask."""
        super().__init__()
        self.lanes = lanes


class Part(NamedTuple):
    """Steps of an integrator: times at their starts and ends (s), (n + 1, lanes).

    `lengths` (s) are of shape (n, lanes), `coefficients` of shape (n, variables, p + 1, lanes), and
    `end`, of shape (variables, lanes), has the variables at the end.
    """

    times: Array
    lengths: Array
    coefficients: Array
    end: Array


class Recorder:
    """A callback that keeps the steps of an integrator, and ends a part after some steps."""

    def __init__(self, integrator: Any) -> None:
        """Make memory for the steps."""
        self._views = integrator.tc, integrator.last_h, integrator.time
        self._coefficients = np.empty((_STEPS, *integrator.tc.shape))
        self._lengths = np.empty((_STEPS, *integrator.last_h.shape))
        self._times = np.empty((_STEPS + 1, *integrator.time.shape))
        self._begin(integrator)

    def _begin(self, integrator: Any) -> None:
        self._times[0] = integrator.time
        self._count = 0

    def __call__(self, integrator: Any) -> bool:
        """Keep a step of all lanes."""
        place = self._count
        self._coefficients[place], self._lengths[place], self._times[place + 1] = self._views
        self._count = place + 1
        return self._count < _STEPS

    def part(self, integrator: Any, until: float | Array, cap: Array) -> Part:
        """Return the next steps towards a time (s), at most `_STEPS`, in memory that is reused."""
        self._begin(integrator)
        integrator.propagate_until(until, max_delta_t=cap, callback=self, write_tc=True)
        _check(~failed_lanes(integrator))
        n = self._count
        return Part(
            self._times[: n + 1], self._lengths[:n], self._coefficients[:n], integrator.state
        )


@dataclass
class Follower:
    """Runs in lanes, by an order and that of its judge, to the end or until one is lost.

    `growths` are the growths of errors up to evenly spaced times that a pair of a lower order has
    measured, shape (places, lanes); after the runs they are those that this pair has measured.
    """

    system: System
    lanes: Lanes
    numbers: Array
    order: int
    growths: Array | None = None
    ends: Ends | None = None
    steps: int = 0

    def blocks(self) -> Iterator[Block]:
        """Yield the steps of all runs. Raises `LostError` for lanes that do not reach the end."""
        chain, effects, q, u, duration = self.lanes
        with np.errstate(all="ignore"):
            cap = paces(chain, effects, tuple(q), tuple(u), duration).longest_step
        _check(np.isfinite(cap))
        before, variables = np.zeros(LANES), np.empty((4, LANES))
        compare = _Comparison(self)
        kept_pool, judge_pool = (
            self.system.integrator(order) for order in (self.order, self.order + MORE_ORDERS)
        )
        with (
            kept_pool.lend() as kept,
            judge_pool.lend() as judge,
            kept_pool.lend() as forward,
            kept_pool.lend() as across,
        ):
            self._start(kept)
            self._start(judge)
            for direction, other in ((FORWARD, forward), (ACROSS, across)):
                self._start(other, moved=Move(ROUNDINGS * ROUNDING, direction))
            recorder = Recorder(kept)
            while (before < duration).any():
                part = recorder.part(kept, duration, cap)
                if not self.steps:
                    first = part.coefficients[0]
                    check_rates(self.lanes, first[:, 0], first[:, 1], 0.0)
                self.steps += len(part.lengths)
                moves = np.diff(part.times, axis=0) > 0
                beside = (through(each, part.times, cap) for each in (judge, forward, across))
                errors = compare.errors(part, moves, *beside)
                lengths = np.where(moves, part.lengths, 0.0)
                speeds = partial(self._speeds, part, lengths, errors)
                yield Block(
                    part.times[:-1], lengths, part.coefficients[:, :2], errors, speeds=speeds
                )
                ended = (part.times[-1] >= duration) & (before < duration)
                variables[:, ended] = _at_the_end(part, moves)[:, ended]
                before = part.times[-1].copy()
                _check((before >= duration) | (self.steps < MOST_STEPS))
        self.growths = np.maximum.accumulate(compare.growths, axis=0)
        states = states_of(chain, variables)
        self.ends = Ends(states[:2], states[2:], compare.so_far)

    def _speeds(self, part: Part, lengths: Array, errors: Array) -> Speeds:
        """Return the speeds on steps, with the bounds on the errors up to the end of each."""
        ends = states_at_ends(self.lanes.chain, _ends_of_steps(part))[2:].swapaxes(0, 1)
        coefficients = derivatives(part.coefficients[:, :2], lengths, ends)
        clocks = np.zeros_like(coefficients[:, 0])
        clocks[:, 1] = lengths
        none, cuts = np.zeros_like(lengths), truncation_within(coefficients)
        return Speeds(part.times[:-1], clocks, coefficients, cuts, errors, none, lengths > 0)

    def _start(self, integrator: Any, moved: Move | None = None) -> None:
        """Set an integrator to the starts, or to others that are moved."""
        chain, q, u = self.lanes.chain, tuple(self.lanes.q), tuple(self.lanes.u)
        if moved is not None:
            q, u = moved_start(q, u, moved)
        second = EQUATIONS[FORMULATION].from_speeds(chain, q, u)
        integrator.state[:] = [*q, *second]
        # Equations have no parameters after the last one that they use.
        integrator.pars[:] = self.numbers[: len(integrator.pars)]
        integrator.set_time(0.0)


class _Comparison:
    """The error of a kept run so far, from its differences from the judge, in each lane."""

    def __init__(self, follower: Follower) -> None:
        self._chain, self._duration = follower.lanes.chain, follower.lanes.duration
        self._order, self._known = follower.order, follower.growths
        self._measured = SoFar.at_the_start(follower.lanes)
        self._later = LaterErrors(follower.lanes)
        self._steps = np.zeros(LANES)
        self.growths = np.zeros((PLACES + 1, LANES))
        self.so_far = np.zeros(LANES)

    def errors(self, kept: Part, moves: Any, judged: Array, *moved: Array) -> Array:
        """Return the bounds on the error (rad, rad/s) up to the end of each step (n, lanes).

        `moves` says in which steps a run has not ended before, shape (n, lanes); `judged` has the
        variables of the judge at the ends of the steps, shape (n, 4, lanes), and `moved` those of
        runs from starts nearby.
        """
        first, second, *others = (
            states_at_ends(self._chain, rows) for rows in (_ends_of_steps(kept), judged, *moved)
        )
        measured = self._measured.with_states(self._chain, first, second, self._order, moves)
        apart = np.where(moves, np.abs(np.array(others) - first).max(axis=(0, 1)), 0.0)
        later = self._later.until(kept.times, _ends_of_steps(kept).swapaxes(0, 1), moves)
        measured = measured.with_growth(apart, later)
        steps = np.cumsum(moves, axis=0) + self._steps
        self._measured, self._steps = measured.of(-1), steps[-1]
        # The first of the evenly spaced times that is not before the end of a step.
        place = np.ceil(kept.times[1:] * (PLACES / self._duration)).astype(int)
        place, lanes = np.minimum(place, PLACES), np.arange(LANES)
        if self._known is not None:
            growths = np.maximum(measured.growths, self._known[place, lanes])
            measured = measured._replace(growths=growths)
        np.maximum.at(self.growths, (place, lanes), measured.growths)
        found = measured.bounds(steps)
        self.so_far = found[-1]
        return found


def check_rates(lanes: Lanes, states: Array, compiled: Array, times: Any) -> None:
    """Raise `SimulationError` unless the compiled rates are those of the formulas.

    Formulas with parameters could take another branch than with a run's own numbers. States and
    rates have shape (4, lanes); the parts of each scene have been read for the lanes.
    """
    own = np.empty_like(states)
    with np.errstate(all="ignore"):
        first, second = EQUATIONS[FORMULATION].rates(
            lanes.chain, lanes.effects, tuple(states[:2]), tuple(states[2:]), times
        )
        for place, rate in enumerate((*first, *second)):
            own[place] = rate
        terms = sizes_of_momentum_rates(lanes.chain, states[:2], states[2:])
        sizes = np.abs(own).max(axis=0) + np.abs(states).max(axis=0) + terms.max(axis=0)
        others = ~(np.abs(compiled - own) <= _SAME_RATES * sizes)
    # A motion that has diverged may have no rates.
    if (others & np.isfinite(sizes)).any():
        raise SimulationError(
            "the compiled rates of an ensemble must be those of the formulas; got others: "
            "please report this"
        )


def _ends_of_steps(part: Part) -> Array:
    """Return the variables at the end of each step, shape (n, variables, lanes)."""
    return np.concatenate([part.coefficients[1:, :, 0], part.end[None]])


def _at_the_end(part: Part, moves: Any) -> Array:
    """Return the variables after the last step of each run, shape (4, lanes).

    While other lanes go on, an integrator may move a run that has ended by a rounding of the time.
    """
    states = _ends_of_steps(part)
    last = len(moves) - 1 - np.argmax(moves[::-1], axis=0)
    return np.asarray(states[last, :, np.arange(LANES)].T)


def through(integrator: Any, times: Array, cap: Array) -> Array:
    """Return the variables of the judge at the ends of steps, shape (n, 4, lanes).

    `times` (s), shape (n + 1, lanes), begin where the judge is. A lane that has ended goes on a
    little, since times must rise; its values are not used.
    """
    grid = times + _BEYOND * np.cumsum(np.diff(times, axis=0, prepend=-1.0) <= 0, axis=0)
    # At exactly the first time.
    integrator.set_time(grid[0])
    _, found = integrator.propagate_grid(grid, max_delta_t=cap)
    _check(~failed_lanes(integrator))
    return np.asarray(found[1:])


def _check(fine: Any) -> None:
    """Raise `LostError` unless a condition holds in all lanes."""
    if not fine.all():
        raise LostError(np.logical_not(fine))
