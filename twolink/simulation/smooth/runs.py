"""The runs of a smooth scene by Taylor series, with steps that pass no change of loads."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from twolink.effects import is_built_in
from twolink.errors import IntegrationError
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.interruptible import side_by_side
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.compilation_thread import CompilationThread
from twolink.simulation.run import Array
from twolink.simulation.shortened import CheckedRun, shortened_run
from twolink.simulation.smooth.bundle_plan import BundlePlan
from twolink.simulation.smooth.bundled import Bundled, bundled, can_be_compared
from twolink.simulation.smooth.changes import MOST_STEPS
from twolink.simulation.smooth.integrators import compile_ahead
from twolink.simulation.smooth.moved_start import ACROSS, FORWARD, ROUNDINGS, Move, growth_of_moved
from twolink.simulation.smooth.rates import compile_jacobians_ahead, wait_for_jacobians
from twolink.simulation.smooth.residuals import residuals_of
from twolink.simulation.smooth.steps import Observer, Steps
from twolink.simulation.smooth.taylor import TaylorRun, taylor_run
from twolink.simulation.smooth.visited import (
    Common,
    VisitingRun,
    compared,
    visited_by,
    with_middles,
)
from twolink.times import merged

# The largest error (rad, rad/s) that grows in proportion.
_LINEAR = 0.1

# The number of times that two runs are compared, and made again to be compared in each step.
_AGAIN = 3


@dataclass
class Runs:
    """The runs of a scene at some times (s), none of whose steps is longer than `longest_step` (s).

    A thread may compile `ahead`. `known` are those that may judge others; `made` are all, in the
    order of their ends. All `visit` the ends (s) of the steps of the last one in double precision.
    `progress` maps the name of a run to a function that receives its completed share.
    """

    scene: Scene
    times: Array
    formulation: EquationsName
    progress: Callable[[str], Callable[[float], None]]
    longest_step: float
    ahead: CompilationThread = field(default_factory=CompilationThread)
    known: dict[tuple[PrecisionName, int], TaylorRun] = field(default_factory=dict)
    made: list[VisitingRun] = field(default_factory=list)
    visit: Array = field(default_factory=lambda: np.zeros(0))

    def pair(
        self, precision: PrecisionName, orders: tuple[int, int]
    ) -> tuple[TaylorRun, TaylorRun, Common]:
        """Return the runs of two orders, and their difference in each step of the first one.

        Those of the longest precision are made in a thread each, as their steps need no
        interpreter, unless the first could shorten the steps of the second. The difference is
        infinite if the runs have no common times in some step, also when they are made again.
        """
        missing = [order for order in orders if (precision, order) not in self.known]
        *_, last = PRECISIONS
        is_fixed = all(map(is_built_in, self.scene.effects))
        if precision == last and is_fixed and len(missing) > 1:

            def made(order: int) -> Callable[[Callable[[], None]], TaylorRun]:
                return lambda go_on: self.new(precision, order, go_on=go_on)

            for order, run in zip(missing, side_by_side(*map(made, missing)), strict=True):
                self.known[precision, order] = run
        elif len(missing) > 1:
            self.expect(precision, missing[-1])
        first, second = (self.run(precision, order) for order in orders)
        for _ in range(_AGAIN):
            found = compared(visited_by(first), visited_by(second))
            if found.resolves(visited_by(first)):
                return first, second, found
            self.visit = merged(self.visit, visited_by(first).ends)
            first, second = (self.again(precision, order) for order in orders)
        return first, second, found.unknown()

    def grown_from_start(self, precision: PrecisionName, order: int) -> Array:
        """Return the growth of an error of the start up to each time, shape (n,), or infinity.

        Two other runs of this order start elsewhere. Their steps have nearly the same truncation
        errors, so that their distance from the known run is the growth of its start's.
        """
        known = visited_by(self.known[precision, order])
        part, visit = ROUNDINGS * PRECISIONS[precision].rounding, self.visit
        apart = np.zeros(len(self.times))
        for direction in (FORWARD, ACROSS):
            self.visit = known.ends
            other = self.new(precision, order, moved=Move(part, direction))
            apart = np.maximum(apart, compared(known, visited_by(other)).until(self.times))
        # Later runs are compared with the known one.
        self.visit = visit
        return np.asarray(growth_of_moved(apart, part, _LINEAR))

    @property
    def may_be_bundled(self) -> bool:
        """Whether lanes side by side can be compared often enough, and their steps are resolved."""
        return all(map(is_built_in, self.scene.effects)) and can_be_compared(
            self.scene.duration, self.longest_step, len(self.times)
        )

    def bundle(self, plan: BundlePlan) -> Bundled | None:
        """Return a motion by lanes side by side.

        Later ones are compared at more times where it changes fast. None if a lane does not reach
        the last time.
        """
        try:
            found = bundled(
                self.scene,
                self.times,
                plan,
                formulation=self.formulation,
                longest_step=self.longest_step,
                visit=self.visit,
                progress=self.progress(f"order {plan.order}, side by side"),
            )
        except IntegrationError:
            # A run of its own shows whether the motion itself fails.
            return None
        self.made.append(found.first)
        self.visit = found.lanes.places
        return found

    def expect(self, precision: PrecisionName, order: int) -> None:
        """Compile the integrators of a later run ahead of it."""
        compile_ahead(self.ahead, self.scene, self.formulation, precision, order)

    def expect_errors(self) -> None:
        """Compile the code for the errors of a later run ahead of it."""
        compile_jacobians_ahead(self.ahead, self.scene, self.formulation)

    def wait_for_errors(self) -> float:
        """Wait for what `expect_errors` compiles, and return the time (s) of it."""
        begun = perf_counter()
        wait_for_jacobians(self.ahead, self.scene, self.formulation)
        return perf_counter() - begun

    def run(self, precision: PrecisionName, order: int) -> TaylorRun:
        """Return the run of a precision and an order."""
        key = precision, order
        return self.known[key] if key in self.known else self.again(precision, order)

    def again(self, precision: PrecisionName, order: int) -> TaylorRun:
        """Return a new run of a precision and an order, which replaces the last one."""
        self.known[precision, order] = self.new(precision, order)
        return self.known[precision, order]

    def new(
        self,
        precision: PrecisionName,
        order: int,
        observe: Observer | None = None,
        go_on: Callable[[], None] | None = None,
        moved: Move | None = None,
    ) -> TaylorRun:
        """Return a new run of a precision and an order, with steps that pass no change of loads.

        Its start may be `moved`. Later runs visit the ends of its steps. It calls `go_on`
        now and then. Raises `UnseenError` if even the shortest steps do.
        """
        # Steps of another order and of longer numbers end elsewhere.
        visit = self.visit if precision == "double" else with_middles(self.visit)
        residuals = residuals_of(self.scene, self.formulation)
        report = self.progress(f"order {order}, {precision}")

        def advance(share: float) -> None:
            if go_on is not None:
                go_on()
            report(share)

        shortest = self.scene.duration / MOST_STEPS

        def made(longest: float) -> CheckedRun:
            self.longest_step = longest
            look = None if residuals is None else residuals.until_passed(longest, shortest)
            found = taylor_run(
                self.scene,
                self.times,
                formulation=self.formulation,
                precision=precision,
                order=order,
                longest_step=longest,
                visit=visit,
                ahead=self.ahead,
                progress=advance,
                observe=_together(observe, look),
                moved=moved,
            )
            self.made.append(found)
            return CheckedRun(found, math.inf if residuals is None else residuals.longest_step)

        run: TaylorRun = shortened_run(self.longest_step, shortest, made)
        if precision == "double":
            self.visit = visited_by(run).ends
        return run


def _together(*observers: Observer | None) -> Observer | None:
    """Return an observer that passes steps on to others, if there are any."""
    own = [each for each in observers if each is not None]

    def observe(steps: Steps) -> None:
        for each in own:
            each(steps)

    return observe if own else None
