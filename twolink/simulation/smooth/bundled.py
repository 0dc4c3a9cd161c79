"""The lanes of a bundle, whose differences measure their errors.

Let e be the truncation error of the first lane. The truncation errors of the steps of lane k are
R_k times as large, 300 and 900 times for the two that follow. Errors of steps add up with the
growth of the motion, so that the error of lane k is about R_k e, and its distance from the first
lane, D_k, differs from it by e alone. But where a few fast steps make all the error, it depends on
the places of the steps, and may happen to vanish: by a factor of 100 in one of a hundred motions.
The steps of two lanes end at different places, so that max_k D_k / R_k is an estimate of e.

The last lane has the steps of the first one, and starts elsewhere, by a part δ of the angles and
speeds. Its distance from the first lane, divided by δ, is the growth G of an error of the start.
The third lane is moved in another direction, as an error along one of them may by chance have no
part that grows: G is also what its distance has beyond its truncation errors, which have a ratio to
the second lane's. An error on each step grows by more, seven times at the median: E is at least
what G lets expect. And round-off grows by G also where truncation errors do not show it, as they
are far smaller than those of the order, in steps at the cap, or keep a symmetry of the motion, such
as links that spin folded. Where loads depend on speeds or time, errors of later steps may grow by
more (`growth_along`).

The second lane has an error of at most D_1 + e: nearly its distance, as E is a small part of it.
The first lane has e, and is the result if only it has the accuracy. The bounds have margins
(`bundle_plan`), which `benchmarks.lanes` measures.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.smooth.bundle_plan import (
    ESTIMATED,
    Bounds,
    BundlePlan,
    Known,
    Start,
    bounds,
    growth_of,
    missed_by_step,
)
from twolink.simulation.smooth.bundles import (
    FIRST,
    LONGEST,
    MOVED,
    RATIOS,
    SECOND,
    Followed,
)
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.growth_along import RoundOffGrowth, growth_along, is_conservative
from twolink.simulation.smooth.judging import truncation
from twolink.simulation.smooth.lane_run import LaneRun, Lanes, lanes
from twolink.simulation.smooth.moved_start import ACROSS, FORWARD, ON_EACH_STEP, Move, moved_start
from twolink.simulation.smooth.visited import largest_until
from twolink.times import merged

# The least ratio of the truncation errors of two lanes that tells those of both: it is smaller than
# that of `RATIOS` where a variable has become larger than the size of the first lane.
_LEAST_PART = 0.25

# The largest distance of two lanes over which errors grow in proportion: of angles (rad), and of
# speeds as a part of the largest speed, or of 1 rad/s.
_LINEAR = 0.1

# A factor on the growth that errors show which are too large to grow in proportion: it was larger
# in one of ten random motions. A larger one would leave too little room for lanes.
_SATURATED = 4.0

# The distance of the third lane by truncation errors, in the second lane's times their ratio, at
# most: a larger part of it comes from its start.
_OF_TRUNCATION = 1.2

# The same where its start is certainly the larger part.
_FAR_BEYOND = 20.0

# The distance of the third lane by its start, in that of the last lane by its own, in most motions.
_OF_START = 4.0

# The order divided by the length of a step, in longest ones, in most motions.
_OF_A_STEP = 100.0

# The part of a step by which steps at the cap differ.
_EVEN = 0.01

# Even times of comparison, at least, and in each time in which the motion changes at its start. One
# costs an eighth of a step, and where they are too few the lanes run again.
_COMPARED, _IN_A_LONGEST_STEP = 128, 16

# Even times of comparison, at most: more are where steps end, if a motion is as fast everywhere.
_MOST_EVEN = 1024

# The longest motion in longest steps, and the most requested times.
_MOST_LONGEST_STEPS, _MOST_COMPARED = 2500, 20_000


@dataclass(frozen=True, eq=False)
class Bundled:
    """The `lanes` of a bundle with a `plan`, as runs at some `times` (s), and their errors.

    The starts of the third and the last lane are `moved` by this part of the variables.
    """

    lanes: Lanes
    plan: BundlePlan
    times: Array
    moved: float

    @cached_property
    def first(self) -> LaneRun:
        """The first lane, as a run."""
        return self.lanes.run(FIRST, self.times)

    @cached_property
    def second(self) -> LaneRun:
        """The second lane, as a run."""
        return self.lanes.run(SECOND, self.times)

    @property
    def found(self) -> Followed:
        """The motions of all lanes."""
        return self.lanes.found

    @property
    def grid(self) -> Array:
        """The times (s) at which the lanes are compared."""
        return self.lanes.grid

    @property
    def largest(self) -> float:
        """The largest variable of the motion, at least 1."""
        return max(1.0, self.found.largest)

    @cached_property
    def _apart(self) -> Array:
        """The distances of all lanes from the first, shape (lanes, 4, n)."""
        return np.abs(self.found.motions - self.found.motions[FIRST])

    @cached_property
    def estimates(self) -> Array:
        """The estimated truncation error of the first lane so far, at the times of the grid.

        It is unknown where the truncation errors of the lanes do not have their ratios.
        """
        longest = self._lengths.max()
        if longest - self._lengths.min() <= _EVEN * longest:
            # At the cap all steps are shorter than those of the order.
            return self._by_lanes
        # In most motions the growth on each step is larger than that from the start.
        of_start = ESTIMATED * self._truncated * self._grown_from_start
        return np.asarray(np.maximum(self._by_lanes, of_start))

    @cached_property
    def _by_lanes(self) -> Array:
        """The estimates that the lanes of larger truncation errors give alone."""
        coarser = slice(SECOND, LONGEST + 1)
        ratios = np.maximum(self.plan.size * RATIOS[coarser], self.largest) / self._size
        if ratios[0] < _LEAST_PART * RATIOS[SECOND]:
            return np.full(len(self.grid), math.inf)
        largest = self._apart[coarser].max(axis=1)
        # What may come from the start of the third lane is no estimate of truncation errors.
        of_start = _OF_START * np.maximum.accumulate(self._apart[MOVED].max(axis=0))
        largest[-1][largest[-1] <= of_start] = 0.0
        return np.asarray(np.maximum.accumulate((largest / ratios[:, None]).max(axis=0)))

    @cached_property
    def _grown_from_start(self) -> Array:
        """The growth of an error of the start so far, at the times of the grid."""
        return np.asarray(np.maximum.accumulate(self._apart[MOVED].max(axis=0)) / self.moved)

    @property
    def estimate(self) -> float:
        """The estimated truncation error of the first lane (rad, rad/s) over the whole motion."""
        return float(self.estimates[-1])

    @cached_property
    def distance(self) -> float:
        """The distance of the second lane from the first (rad, rad/s) over the whole motion."""
        return float(self._apart[SECOND].max())

    @property
    def growth(self) -> float | None:
        """The error of a run with an error of 1 on each step; None if it is unknown."""
        return float(self._growths[-1]) if math.isfinite(self.estimate) else None

    def grown_at(self, times: Array) -> Array:
        """Return the growth up to each time (s), shape (n,)."""
        return largest_until(times, self.grid, self._growths)

    def round_off_growth_at(self, times: Array) -> RoundOffGrowth:
        """Return the growth of errors of the start and of later steps up to each time (s)."""
        return RoundOffGrowth(*(largest_until(times, self.grid, each) for each in self._growth))

    @cached_property
    def _grown_across(self) -> Array:
        """The growth of an error of the start in another direction, at the times of the grid.

        That of the third lane's start, beside truncation errors in proportion to the second one's.
        """
        return self._grown_beyond(_OF_TRUNCATION)

    def _grown_beyond(self, of_truncation: float) -> Array:
        """Return the growth that the third lane shows beyond a part of its truncation errors."""
        second, third = self._apart[SECOND].max(axis=0), self._apart[LONGEST].max(axis=0)
        ratio = of_truncation * RATIOS[LONGEST] / RATIOS[SECOND]
        beyond = np.maximum.accumulate(third) - ratio * np.maximum.accumulate(second)
        return np.maximum(beyond, 0.0) / self.moved

    @cached_property
    def _growth(self) -> RoundOffGrowth:
        """The growth of errors of the start and of later steps, at the times of the grid."""
        scene, of_steps = self.first.scene, np.zeros(len(self.grid))
        if not is_conservative(scene.effects):
            states = self.found.motions[FIRST]
            of_steps = growth_along(scene, self.first.formulation, self.grid, states)
        return RoundOffGrowth(np.maximum(self._grown_from_start, self._grown_across), of_steps)

    @cached_property
    def of_round_off(self) -> float:
        """The error of a run with a round-off of 1 on each step, over the whole motion."""
        return float(max(self._growths[-1], self._growth.on_each_step[-1]))

    @cached_property
    def _growths(self) -> Array:
        """The growth so far, at the times of the grid: truncation errors are relative to the state.

        Where steps are shorter than those of the order, or a symmetry of the motion is kept by its
        truncation errors, that of an error of the start is larger.
        """
        of_steps = growth_of(self.estimates, self._truncated)
        return np.asarray(np.maximum(of_steps, ON_EACH_STEP * self._grown_from_start))

    @cached_property
    def _truncated(self) -> float:
        """The truncation error of a step of the first lane, as a part of the largest variable."""
        return float(self._size / self.largest * truncation(self.plan.order))

    @property
    def _size(self) -> float:
        """The size of the state that the steps of the first lane had."""
        return max(self.plan.size, self.largest)

    @cached_property
    def bounds(self) -> Bounds | None:
        """The bounds on the errors of the first two lanes; None if they are unknown."""
        if self.growth is None or not self.is_linear:
            return None
        motion = self.found.motions[FIRST]
        if not (motion != motion[:, :1]).any():
            # A chain that stays at rest has no error beside the round-off of its place.
            return Bounds(0.0, 0.0)
        of_step = self._speed * missed_by_step(self.plan.order, self._size)
        return bounds(self.estimate, self.distance, self.of_round_off, of_step)

    @property
    def _speed(self) -> float:
        """The error of q or u (rad, rad/s) by one of 1 in a variable, which a step misses."""
        shortest = float(self._lengths.min())
        rates = self.plan.order / self.lanes.longest_step, self.plan.order / shortest
        equations = EQUATIONS[self.first.formulation]
        return _of_variables(equations.largest_speed(self.first.scene.moving_chain), rates)

    @cached_property
    def _lengths(self) -> Array:
        """The lengths (s) of the steps of the first lane, the shortest, but the last one.

        That may be a part of one.
        """
        return np.diff(self.lanes.places)[:-1]

    @property
    def known(self) -> Known:
        """The motion as this bundle shows it.

        Lanes of smaller truncation errors show the growth across better, unless it is far larger.
        """
        growth, across = self.growth, float(self._grown_beyond(_FAR_BEYOND)[-1])
        if growth is not None and not self.is_linear:
            # Distances end at the size of the motion.
            growth *= _SATURATED
        of_round_off = max(self._growths[-1], self._growth.of_steps[-1], ON_EACH_STEP * across)
        return Known(growth, self.largest, float(of_round_off))

    def is_coarser_than(self, plan: BundlePlan) -> bool:
        """Return whether another plan has smaller truncation errors, or those here are unknown."""
        own = self._size * truncation(self.plan.order)
        return self.growth is None or plan.size * truncation(plan.order) < own

    @property
    def is_linear(self) -> bool:
        """Whether the errors of all lanes are so small that they grow in proportion."""
        fastest = max(1.0, float(np.abs(self.found.motions[FIRST, 2:]).max()))
        angles, speeds = self._apart[:, :2].max(), self._apart[:, 2:].max()
        return bool(max(angles, speeds / fastest) <= _LINEAR)


def bundled(
    scene: Scene,
    times: Array,
    plan: BundlePlan,
    *,
    formulation: EquationsName,
    longest_step: float,
    visit: Array,
    progress: Callable[[float], None] | None = None,
) -> Bundled:
    """Return the motions of all lanes at rising times (s), the first of them 0.

    No step is longer than `longest_step` (s). The lanes are compared at those times, and at times
    to `visit` (s), which are evenly spaced if there are none. Raises `IntegrationError` if a lane
    does not reach the last time.
    """
    if not len(visit):
        even = math.ceil(_IN_A_LONGEST_STEP * scene.duration / longest_step)
        count = min(max(_COMPARED, even), _MOST_EVEN)
        visit = np.linspace(0.0, scene.duration, count + 1)
    part = plan.offset
    found = lanes(
        scene,
        merged(times, visit),
        formulation=formulation,
        order=plan.order,
        size=plan.size,
        longest_step=longest_step,
        progress=progress,
        moved=(
            moved_start(scene.q, scene.u, Move(part, ACROSS)),
            moved_start(scene.q, scene.u, Move(part, FORWARD)),
        ),
    )
    return Bundled(found, plan, times, part)


def _of_variables(by_momenta: float, rates: tuple[float, float]) -> float:
    """Return the error of q or u by one of 1 in a variable, of a term that a series omits.

    One of 1 in the second pair of variables is an error `by_momenta` of u. Speeds are the
    derivatives of angles: a term τ^p of angles is one of p/h times τ^(p-1) in speeds, with the
    smallest and the largest of these `rates` (1/s). So momenta of small masses, and angles beside
    large momenta, miss less than the largest variable.
    """
    slowest, fastest = rates
    return max(min(1.0, by_momenta / slowest), min(by_momenta, fastest))


def start_of(scene: Scene, formulation: EquationsName, longest_step: float) -> Start:
    """Return what the start of a motion shows, whose longest step (s) is known."""
    chain, equations = scene.moving_chain.convert(float), EQUATIONS[formulation]
    variables = *scene.q, *equations.from_speeds(chain, scene.q, scene.u)
    by_momenta, rate = equations.largest_speed(scene.moving_chain), _OF_A_STEP / longest_step
    speed = _of_variables(by_momenta, (rate, rate))
    return Start(max(1.0, *(abs(float(x)) for x in variables)), speed)


def can_be_compared(duration: float, longest_step: float, count: int) -> bool:
    """Return whether a motion over a duration (s), at a `count` of times, is short for a bundle.

    All lanes are evaluated at all times, in longer than another run takes if these are very many.
    """
    return duration <= _MOST_LONGEST_STEPS * longest_step and count <= _MOST_COMPARED
