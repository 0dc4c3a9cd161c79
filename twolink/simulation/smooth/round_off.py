"""The round-off of a run that a second run in one precision may share.

Two runs have the same constants, the same momenta of the start, and loads whose terms cancel alike:
their difference does not show it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from twolink.chain import Chain
from twolink.effects import is_built_in
from twolink.integration.precisions import PRECISIONS
from twolink.names import EquationsName
from twolink.simulation.run import Array
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.load_sizes import ForceSizes, LoadSizes, force_sizes
from twolink.simulation.smooth.visited import VisitingRun, visited_by

MOST_ROUND_OFF = 16
"""The error that round-off leaves, in roundings times the growth, of motions where it is large."""

A_VALUE = 4
"""Roundings of a speed that is computed from momenta."""

# The number of times at which the round-off of built-in loads is looked at: they vary alike
# everywhere, and others may not.
_LOOKS = 65


def rounding(run: Any) -> Array:
    """Return the round-off (rad, rad/s) of q and u in float64 up to each time, shape (n,).

    Between two times values may be larger, so it is a whole rounding instead of half of one.
    """
    sizes = np.abs(np.concatenate([run.q, run.u])).max(axis=0).astype(float)
    return np.asarray(np.finfo(float).eps * np.maximum.accumulate(sizes))


def rounding_until(run: VisitingRun, times: Array) -> Array:
    """Return `rounding` up to each time (s), also of the largest values between them."""
    return np.asarray(np.finfo(float).eps * visited_by(run).largest(times, np.abs))


def conversions(run: VisitingRun, times: Array) -> Array:
    """Return the round-off (rad, rad/s) of values up to each time (s), shape (n,).

    They are converted from momenta and back.
    """
    return _of_conversions(run, visited_by(run).largest_of(times, _roundings(run)))


def sums(run: VisitingRun, times: Array) -> Array:
    """Return the round-off (rad, rad/s) of as many sums as the steps up to each time (s).

    Runs share that of the first speeds, which move the angles in proportion to the time.
    """
    roundings = _roundings(run)
    largest = visited_by(run).largest_of(times, roundings)
    count = run.steps * times / float(times[-1])
    return np.asarray(
        _of_conversions(run, largest) + largest * count + roundings[2:, 0].max() * times
    )


def sums_at_most(run: VisitingRun, duration: float) -> float:
    """Return a bound (rad, rad/s) on `sums` and `rounding_until` up to a duration (s), at once."""
    chain = run.scene.moving_chain
    q1, q2, u1, u2 = visited_by(run).sizes(np.abs).max(axis=1).tolist()
    angle, speed = max(q1, q2), max(u1, u2)
    rounded = EQUATIONS[run.formulation].largest_rounded_speed(chain, angle, speed)
    largest = PRECISIONS[run.precision].rounding * max(angle, speed, rounded)
    return _converted(run) + largest * (1 + A_VALUE + run.steps + duration)


def _of_conversions(run: VisitingRun, largest: Array) -> Array:
    """Return the round-off of conversions from that of the largest values, shape (n,)."""
    return np.asarray(_converted(run) + A_VALUE * largest)


def _converted(run: VisitingRun) -> float:
    """Return the error (rad, rad/s) of the start of a run, by conversions."""
    begun = np.concatenate([run.q[:, 0], run.u[:, 0]]).astype(float)
    return float(np.abs(begun - [*run.scene.q, *run.scene.u]).max())


@dataclass(frozen=True, eq=False)
class LoadsAlong:
    """The round-off that loads give to the rates along the motion of a `run`, at some times (s).

    `q` and `u` are the states there, shape (2, n), and `forces` the loads.
    """

    run: VisitingRun
    times: Array
    q: Array
    u: Array
    forces: ForceSizes

    @classmethod
    def along(cls, run: VisitingRun) -> LoadsAlong:
        """Return the round-off along a run, where it is known."""
        places, values = visited_by(run).everywhere
        looks = _LOOKS if all(map(is_built_in, run.scene.effects)) else len(places)
        some = slice(None) if looks >= len(places) else _evenly(len(places), looks)
        q, u, times = values[:2, some], values[2:, some], places[some]
        chain = run.scene.moving_chain.convert(float)
        return cls(run, times, q, u, force_sizes(chain, run.scene.effects, q, u, times))

    def errors(self, run: VisitingRun, times: Array, grown: Array) -> Array:
        """Return the round-off (rad, rad/s) of terms of loads that cancel, up to each time (s).

        It acts like an acceleration, beyond a rounding of the speeds on each step, which is in
        other terms: a chain at rest has none. And it grows like truncation errors of its size on
        each step, beyond a rounding of the state. `grown` is the error of a unit of truncation,
        which is relative to the state, or to 1 if that is larger.
        """
        step = float(times[-1]) / run.steps
        if step * self._most <= min(1.0, self._fastest):
            return np.zeros_like(times)
        of_speeds, of_run = self._rates(EQUATIONS[run.formulation].in_speeds), self._of_state
        beyond = np.maximum(step * of_speeds - self._fastest, 0.0) / step
        between = np.diff(self.times) * (beyond[1:] + beyond[:-1]) / 2
        moved = np.concatenate([[0.0], np.cumsum(between)])
        roundings = np.maximum.accumulate(np.maximum(step * of_run - 1.0, 0.0))
        place = np.searchsorted(self.times, times)
        carried = MOST_ROUND_OFF * grown * roundings[place]
        own = PRECISIONS[run.precision].rounding
        return np.asarray(own * (np.maximum(1.0, times) * moved[place] + carried))

    def errors_at_most(self, run: VisitingRun, duration: float, grown: float) -> float:
        """Return a bound (rad, rad/s) on `errors` up to a duration (s), at once."""
        step = duration / run.steps
        if step * self._most <= min(1.0, self._fastest):
            return 0.0
        moved, carried = duration * self._most, MOST_ROUND_OFF * grown * step * self._most
        return PRECISIONS[run.precision].rounding * (max(1.0, duration) * moved + carried)

    @cached_property
    def _most(self) -> float:
        """A bound on the roundings of the state per time (1/s), of speeds and of momenta."""
        formulation = self.run.formulation
        if EQUATIONS[formulation].in_speeds == formulation:
            sizes = self._sizes(formulation)
            return float((sizes.excess + sizes.spread).max(initial=0.0))
        largest = float((self.forces.excess + self.forces.spread).max(initial=0.0))
        return largest * max(1.0, EQUATIONS["momenta"].largest_speed(self.run.scene.moving_chain))

    @cached_property
    def _fastest(self) -> float:
        """The largest speed (rad/s)."""
        return float(np.abs(self.u).max())

    @property
    def _of_state(self) -> Array:
        """The roundings of the state of the run per time (1/s), shape (n,)."""
        formulation = self.run.formulation
        x = EQUATIONS[formulation].from_speeds(self._chain, tuple(self.q), tuple(self.u))
        size = max(1.0, float(np.abs(np.concatenate([self.q, x])).max()))
        return np.asarray(self._rates(formulation) / size)

    def _rates(self, formulation: EquationsName) -> Array:
        """Return the sizes per time (1/s) whose rounding is that of rates by loads, shape (n,)."""
        sizes = self._sizes(formulation)
        return np.asarray((sizes.excess + sizes.spread).max(axis=0))

    def _sizes(self, formulation: EquationsName) -> LoadSizes:
        """Return the round-off of the rates of equations; those of the run solve for their own."""
        if formulation == self.run.formulation:
            return self.forces.in_rates(self._chain, formulation, self.q, self.u)
        return self.forces.given(self._chain, formulation, self.q)

    @property
    def _chain(self) -> Chain:
        return self.run.scene.moving_chain.convert(float)


def _evenly(count: int, looks: int) -> Any:
    """Return the numbers of evenly spaced entries, of which there are more than looks."""
    return np.arange(looks) * (count - 1) // (looks - 1)


def _roundings(run: VisitingRun) -> Array:
    """Return the round-off (rad, rad/s) of q and u where a run is known, from the start on."""
    chain, own = run.scene.moving_chain.convert(float), PRECISIONS[run.precision].rounding

    def of(values: Array) -> Array:
        speeds = EQUATIONS[run.formulation].rounded_speeds(chain, values[:2], values[2:])
        return own * np.concatenate([np.abs(values[:2]), speeds])

    return visited_by(run).sizes(of)
