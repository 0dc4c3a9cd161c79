"""Motion without events by Taylor series, in any precision: one run of one integrator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from twolink.integration.operations import Operations, of_taylor_step
from twolink.integration.precisions import PRECISIONS, Code, PrecisionName
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.compilation_thread import CompilationThread
from twolink.simulation.run import Array
from twolink.simulation.smooth.integrators import INTEGRATORS, Followed, Integrators, Key, key_of
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.simulation.smooth.moved_start import Move
from twolink.simulation.smooth.steps import Observer
from twolink.simulation.smooth.visited import Visited, VisitingRun
from twolink.times import merged


@dataclass(frozen=True, kw_only=True)
class TaylorRun(VisitingRun):
    """A motion without events, by one run of one integrator, `compiled` for it to some code.

    That of a judge may start elsewhere: its start is `moved` (`moved_start`).
    """

    compiled: Integrators | None = field(repr=False, compare=False)
    code: Code
    moved: Move | None = None

    @property
    def arithmetic(self) -> Operations:
        """The floating-point operations of the steps."""
        return of_taylor_step(self._code.pool.original).times(self.steps)

    @property
    def _code(self) -> Integrators:
        """The compiled code of this run, recompiled if the run was stored."""
        return self.compiled or INTEGRATORS(
            *key_of(self.scene, self.formulation, self.precision, self.order).of(self.code)
        )

    def dense(self) -> Callable[..., tuple[Any, Any]]:
        """Return q and u as functions of time (s): the polynomials of the steps of this run."""
        own = self._code

        def at(times: Any, side: str = "right") -> tuple[Any, Any]:
            # The run is repeated step for step, so that its steps need not be stored.
            moments, place = np.unique(times, return_inverse=True)
            ends = np.array([0.0, self.scene.duration])
            grid, places = np.unique(np.concatenate([ends, moments]), return_inverse=True)
            exact = PRECISIONS[self.precision].array(grid)
            found = own.follow(self.scene, exact, self.longest_step, None, moved=self.moved)
            assert found is not None
            return tuple(values[:, places[2:][place]] for values in (found.q, found.u))

        return at

    def step_times(self) -> Any:
        """Return the boundaries (s) of the steps, in float64."""
        return self._code.step_times(self.scene, self.longest_step, self.moved)

    def __getstate__(self) -> dict[str, Any]:
        """Return the run without its compiled code, which is recompiled on demand."""
        return {**self.__dict__, "compiled": None}


def taylor_run(
    scene: Scene,
    times: Any,
    *,
    formulation: EquationsName,
    precision: PrecisionName = "double",
    order: int | None = None,
    longest_step: float | None = None,
    code: Code | None = None,
    visit: Array | None = None,
    ahead: CompilationThread | None = None,
    progress: Callable[[float], None] | None = None,
    observe: Observer | None = None,
    moved: Move | None = None,
) -> TaylorRun:
    """Return the motion of a scene by Taylor series at increasing times (s), the first of them 0.

    Truncation errors are at round-off, unless a lower `order` is given; `longest_step` (s) caps the
    step. A run that takes too many steps for its `code`, by default the first of the precision,
    begins anew with the next one: only the scene decides which code runs, as their round-off
    differs. With times to `visit` (s) the run has its motion there and at the ends of its steps. A
    thread may compile it `ahead`. The start may be `moved`. Raises `SimulationError` if
    the motion cannot be integrated to the last time. `progress` receives the completed share, and
    `observe` the steps.
    """
    cap = longest_step or default_longest_step(scene)
    every = times if visit is None else merged(times, visit)
    key = key_of(scene, formulation, precision, order)
    first = PRECISIONS[precision].codes.index(code or PRECISIONS[precision].codes[0])
    made = _made(scene, key, first, every, cap, ahead, progress, observe, visit is not None, moved)
    found, place, visited = made.motion, slice(None), None
    if visit is not None:
        exact = PRECISIONS[precision].number is float
        visited = Visited(every, np.concatenate([found.q, found.u]), *found.ends, exact)
        place = np.searchsorted(every, times)
    return TaylorRun(
        scene=scene,
        formulation=formulation,
        precision=precision,
        longest_step=cap,
        q=found.q[:, place],
        u=found.u[:, place],
        steps=found.steps,
        order=made.compiled.pool.original.order,
        operations=made.compiled.operations,
        compile_seconds=made.compile_seconds,
        run_seconds=made.run_seconds,
        compiled=made.compiled,
        code=made.code,
        moved=moved,
        visited=visited,
    )


class _Made(NamedTuple):
    """A motion, the integrators and the code that made it, and the times (s) that it took."""

    motion: Followed
    compiled: Integrators
    code: Code
    compile_seconds: float
    run_seconds: float


def _made(
    scene: Scene,
    key: Key,
    first: int,
    times: Any,
    cap: float,
    ahead: CompilationThread | None,
    progress: Callable[[float], None] | None,
    observe: Observer | None,
    visits: bool,
    moved: Move | None,
) -> _Made:
    """Return the motion at times (s) by the code for its number of steps, from the `first` on."""
    own = PRECISIONS[key.precision]
    grid, compile_seconds = own.array(times), 0.0
    for code in own.codes[first:]:
        start = perf_counter()
        if ahead is not None:
            ahead.wait(key.of(code))
        compiled = INTEGRATORS(*key.of(code))
        compile_seconds += perf_counter() - start
        start = perf_counter()
        found = compiled.follow(scene, grid, cap, progress, code.steps, observe, visits, moved)
        run_seconds = perf_counter() - start
        if found is not None:
            return _Made(found, compiled, code, compile_seconds, run_seconds)
    raise AssertionError("the last code takes any number of steps")
