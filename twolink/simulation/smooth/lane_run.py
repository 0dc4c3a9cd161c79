"""The motions of the lanes of a bundle, each of which is a run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np

from twolink.integration.operations import Operations, of_taylor_step
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Array, Lane, Recipe
from twolink.simulation.smooth.bundles import BUNDLES, FIRST, LONGEST, Bundle, Followed, Starts
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.simulation.smooth.visited import Visited, VisitingRun
from twolink.times import merged
from twolink.values import Content

# The longest steps, those of the third lane, without a comparison. Each is less than 0.4 of
# the radius of convergence of the series, in half of which an error that grows changes little.
_STEPS_BETWEEN = 2


@dataclass(frozen=True, kw_only=True)
class LaneRun(VisitingRun):
    """The motion of a `lane` of a bundle, `compiled` for it.

    `ends` has the times (s) at which its steps end, and `lane_steps` the number of steps of each
    lane.
    """

    lane: Lane
    ends: Array = field(repr=False, compare=False)
    lane_steps: tuple[int, ...]
    compiled: Bundle | None = field(repr=False, compare=False)

    @property
    def recipe(self) -> Recipe:
        """The settings that repeat the run."""
        return Recipe(self.order, float(self.longest_step), lane=self.lane)

    @property
    def lanes(self) -> int:
        """The number of motions that were integrated side by side."""
        return len(self.lane_steps)

    @property
    def arithmetic(self) -> Operations:
        """The floating-point operations of the steps of all lanes, also of those that wait."""
        return of_taylor_step(self._code.pool.original).times(self.lanes * max(self.lane_steps))

    @property
    def evaluations(self) -> int:
        """The evaluated terms of the series, each of all lanes at once."""
        return max(self.lane_steps) * self.order * self.operations

    @property
    def _code(self) -> Bundle:
        """The compiled code of this run, recompiled if the run was stored."""
        return self.compiled or _bundle_of(self.scene, self.formulation, self.order)

    def dense(self) -> Callable[..., tuple[Any, Any]]:
        """Return q and u as functions of time (s): the polynomials of the steps of the lane."""

        def at(times: Any, side: str = "right") -> tuple[Any, Any]:
            # The run is repeated step for step, so that its steps need not be stored.
            moments, place = np.unique(times, return_inverse=True)
            found = self._code.follow(self.scene, moments, self.lane.size, self.longest_step)
            values = found.motions[self.lane.number][:, place]
            return values[:2], values[2:]

        return at

    def step_times(self) -> Array:
        """Return the boundaries (s) of the steps of the lane."""
        return np.asarray(merged([0.0], self.ends))

    def __getstate__(self) -> dict[str, Any]:
        """Return the run without its compiled code, which is recompiled on demand."""
        return {**self.__dict__, "compiled": None}


@dataclass(frozen=True, eq=False)
class Lanes:
    """The motions of all lanes of a bundle at the times of a grid (s), and their cost (s)."""

    scene: Scene
    compiled: Bundle
    longest_step: float
    size: float
    grid: Array
    found: Followed
    compile_seconds: float
    run_seconds: float

    @property
    def is_resolved(self) -> bool:
        """Whether the lanes are compared so often that their distance has no peaks between."""
        known = np.searchsorted(self.grid, self.boundaries(LONGEST), side="right")
        return not (known[_STEPS_BETWEEN:] == known[:-_STEPS_BETWEEN]).any()

    @cached_property
    def places(self) -> Array:
        """Times (s) at which later lanes are to be compared: the ends of the first lane's steps.

        The first lane has the shortest steps, and is the nearest to the motion of later ones.
        """
        return self.boundaries(FIRST)

    def boundaries(self, lane: int) -> Array:
        """Return where the steps of a lane begin and end (s): it waits where others go on."""
        ends = np.concatenate([[-1.0, 0.0], self.found.ends[lane]])
        return ends[1:][ends[1:] > ends[:-1]]

    def run(self, number: int, times: Array) -> LaneRun:
        """Return a lane as a run, at some times (s) of the grid."""
        own, place = self.found.motions[number], np.searchsorted(self.grid, times)
        return LaneRun(
            scene=self.scene,
            formulation=self.compiled.formulation,
            precision="double",
            longest_step=self.longest_step,
            q=own[:2, place],
            u=own[2:, place],
            steps=self.found.steps[number],
            order=self.compiled.order,
            operations=self.compiled.operations,
            compile_seconds=self.compile_seconds,
            run_seconds=self.run_seconds,
            lane=Lane(number, self.size),
            visited=Visited(self.grid, own, np.zeros(0), np.zeros((4, 0)), exact=True),
            ends=self.found.ends[number],
            lane_steps=self.found.steps,
            compiled=self.compiled,
        )


def lanes(
    scene: Scene,
    grid: Array,
    *,
    formulation: EquationsName,
    order: int,
    size: float,
    longest_step: float | None = None,
    progress: Callable[[float], None] | None = None,
    moved: Starts | None = None,
) -> Lanes:
    """Return the motions of all lanes at rising times of a grid (s), the first of them 0.

    The first lane has the `size` of its state, and no step is longer than `longest_step` (s). The
    third and the last lane start from angles (rad) and speeds (rad/s) that are `moved`. Raises
    `IntegrationError` if a lane does not reach the end.
    """
    cap = longest_step or default_longest_step(scene)
    begun = perf_counter()
    compiled = _bundle_of(scene, formulation, order)
    compile_seconds = perf_counter() - begun
    begun = perf_counter()
    found = compiled.follow(scene, grid, size, cap, progress, moved)
    seconds = perf_counter() - begun
    return Lanes(scene, compiled, cap, size, grid, found, compile_seconds, seconds)


def _bundle_of(scene: Scene, formulation: EquationsName, order: int) -> Bundle:
    """Return compiled code for a scene."""
    chain, effects = Content((scene.moving_chain,)), Content(scene.effects)
    return BUNDLES(chain, effects, formulation, order)
