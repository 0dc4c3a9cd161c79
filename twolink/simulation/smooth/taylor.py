"""Motion by Taylor series: a scene's equations compiled by heyoka, in any precision.

The equations are evaluated once on heyoka's expressions with exactly the loads of the scene, so the
compiled code has no other operations.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from twolink.chain import Chain
from twolink.errors import SimulationError
from twolink.integration.operations import Operations, of_taylor_step
from twolink.integration.outcomes import check_arrival, last_time
from twolink.integration.precisions import PRECISIONS, Code, PrecisionName
from twolink.names import EquationsName
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.compilation_thread import CompilationThread
from twolink.simulation.memo import Memo
from twolink.simulation.pool import IntegratorPool
from twolink.simulation.run import Array, MotionRun
from twolink.simulation.smooth.equations import EQUATIONS, expressions_of
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.simulation.smooth.visited import Visited
from twolink.times import merged
from twolink.values import Content

# The most ends of steps that are kept of a run. Of longer ones every second, fourth … is kept.
_MOST_ENDS = 400_000

# Steps that are observed together. Numbers of so many are still in the cache of a core when they
# are used again; five times as many took 1.6 to 3.4 times as long for each step.
_OBSERVED_AT_ONCE = 1024


def heyoka_is_here() -> bool:
    """Return whether heyoka can be imported."""
    try:
        heyoka()
    except SimulationError:
        return False
    return True


@dataclass(frozen=True, kw_only=True)
class TaylorRun(MotionRun):
    """A motion without events, by one run of one integrator, `compiled` for it to some code.

    It has the motion at the times that were `visited` if this was requested.
    """

    compiled: _Compiled | None = field(repr=False, compare=False)
    code: Code
    visited: Visited | None = field(default=None, repr=False, compare=False)

    @property
    def arithmetic(self) -> Operations:
        """The floating-point operations of the steps."""
        return of_taylor_step(self._code.pool.original).times(self.steps)

    @property
    def _code(self) -> _Compiled:
        """The compiled code of this run, recompiled if the run was stored."""
        return self.compiled or _compiled(
            *_key_of(self.scene, self.formulation, self.precision, self.order, self.code)
        )

    def dense(self) -> Callable[..., tuple[Any, Any]]:
        """Return q and u as functions of time (s): the polynomials of the steps of this run."""
        compiled = self._code

        def at(times: Any, side: str = "right") -> tuple[Any, Any]:
            # The run is repeated step for step, so that its steps need not be stored.
            moments, place = np.unique(times, return_inverse=True)
            ends = np.array([0.0, self.scene.duration])
            grid, places = np.unique(np.concatenate([ends, moments]), return_inverse=True)
            found = compiled.follow(
                self.scene, PRECISIONS[self.precision].array(grid), self.longest_step, None
            )
            assert found is not None
            return tuple(values[:, places[2:][place]] for values in (found.q, found.u))

        return at

    def step_times(self) -> Any:
        """Return the boundaries (s) of the steps, in float64."""
        return self._code.step_times(self.scene, self.longest_step)

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
) -> TaylorRun:
    """Return the motion of a scene by Taylor series at increasing times (s), the first of them 0.

    Truncation errors are at round-off, unless a lower `order` is given; `longest_step` (s) caps the
    step. A run that takes too many steps for its `code`, by default the first of the precision,
    begins anew with the next one: only the scene decides which code runs, as their round-off
    differs. With times to `visit` (s) the run has its motion there and at the ends of its steps. A
    thread may compile it `ahead`. Raises `SimulationError` if the motion cannot be
    integrated to the last time. `progress` receives the completed share, and `observe` the steps.
    """
    cap = longest_step or default_longest_step(scene)
    own = PRECISIONS[precision]
    every = times if visit is None else merged(times, visit)
    grid = own.array(every)
    compile_seconds = 0.0
    for used in own.codes[own.codes.index(code or own.codes[0]) :]:
        start = perf_counter()
        key = _key_of(scene, formulation, precision, order, used)
        if ahead is not None:
            ahead.wait(key)
        compiled = _compiled(*key)
        compile_seconds += perf_counter() - start
        start = perf_counter()
        found = compiled.follow(scene, grid, cap, progress, used.steps, observe, visit is not None)
        run_seconds = perf_counter() - start
        if found is not None:
            break
    assert found is not None
    visited, place = None, slice(None)
    if visit is not None:
        exact = own.number is float
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
        order=compiled.pool.original.order,
        operations=compiled.operations,
        compile_seconds=compile_seconds,
        run_seconds=run_seconds,
        compiled=compiled,
        code=used,
        visited=visited,
    )


def visited_by(run: TaylorRun) -> Visited:
    """Return the motion of a run that had times to visit, at these and at the ends of its steps."""
    assert run.visited is not None
    return run.visited


class Steps(NamedTuple):
    """Consecutive steps: starts and lengths (s), coefficients (n, 4, p + 1), and the last state.

    The starts are sums of two numbers in float64, `starts` and the small `rests`; all other numbers
    are in the precision of the run. The variables are those of the equations, q and u or q and p.
    """

    starts: Any
    rests: Any
    lengths: Any
    coefficients: Any
    end: Any

    def portions(self) -> Iterator[Steps]:
        """Yield the same steps, `_OBSERVED_AT_ONCE` at a time."""
        count = len(self.lengths)
        for first in range(0, count, _OBSERVED_AT_ONCE):
            after = first + _OBSERVED_AT_ONCE
            own = slice(first, after)
            end = self.end if after >= count else self.coefficients[after, :, 0].copy()
            yield Steps(
                self.starts[own], self.rests[own], self.lengths[own], self.coefficients[own], end
            )


Observer = Callable[[Steps], None]
"""A function that takes the steps of a run, some at a time; steps from 0 s begin a new run."""


class _Followed(NamedTuple):
    """q and u at the requested times, each of shape (2, n), and the number of steps.

    The `ends` of steps (s) and the values there, shape (4, m), are empty unless they are requested.
    """

    q: Any
    u: Any
    steps: int
    ends: tuple[Array, Any]


@dataclass(frozen=True)
class _Compiled:
    """Integrators for any start of a scene, in a precision, and the chain in that precision."""

    pool: IntegratorPool
    chain: Chain
    formulation: EquationsName
    precision: PrecisionName
    operations: int

    def follow(
        self,
        scene: Scene,
        grid: Any,
        cap: float,
        progress: Callable[[float], None] | None,
        most: float = math.inf,
        observe: Observer | None = None,
        visits: bool = False,
    ) -> _Followed | None:
        """Return the motion at the times of a grid (s), or None if it takes `most` steps.

        With `visits` it has the ends of steps.

        No step is longer than `cap` (s). Raises `IntegrationError` if the motion cannot be
        integrated to the last time.
        """
        outcomes = heyoka().taylor_outcome
        rows: list[Any] = []
        steps = 0
        with self.pool.lend() as integrator:
            self._start(integrator, scene)
            recorder = None if observe is None else _Recorder(integrator)
            ends = _Ends(integrator) if visits else None
            note = recorder or (None if ends is None else ends.note)
            parts = parts_of_run(integrator, self.precision, grid, cap, note)
            for outcome, taken, known in parts:
                rows.append(known)
                steps += taken
                if observe is not None and recorder is not None and taken:
                    observed = recorder.steps()
                    for portion in observed.portions():
                        observe(portion)
                    if ends is not None:
                        ends.add(observed.starts, observed.coefficients[:, :, 0])
                if ends is not None:
                    ends.take()
                if outcome == outcomes.step_limit and steps >= most:
                    return None
                if outcome == outcomes.step_limit and progress is not None:
                    progress(float(integrator.time) / scene.duration)
            reached = float(integrator.time)
        check_arrival(outcome, reached, scene.duration)
        q, u = self._motion(np.concatenate(rows).T)
        visited = np.zeros(0), np.concatenate([q, u])[:, :0]
        if ends is not None:
            visited = ends.times, np.concatenate(self._motion(ends.states.T))
        return _Followed(q, u, steps, visited)

    def _motion(self, variables: Any) -> tuple[Any, Any]:
        """Return q and u from the variables, shape (4, n)."""
        to_speeds = EQUATIONS[self.formulation].to_speeds
        return variables[:2], np.array(to_speeds(self.chain, variables[:2], variables[2:]))

    def step_times(self, scene: Scene, cap: float) -> Any:
        """Return the boundaries (s) of the steps of a motion, none longer than `cap` (s)."""
        kind, ends = PRECISIONS[self.precision].number, [0.0]

        def note(integrator: Any) -> bool:
            ends.append(float(integrator.time))
            return True

        with self.pool.lend() as integrator:
            self._start(integrator, scene)
            integrator.propagate_until(kind(scene.duration), max_delta_t=kind(cap), callback=note)
        return np.array(ends)

    def _start(self, integrator: Any, scene: Scene) -> None:
        """Set an integrator to the start of a scene."""
        kind = PRECISIONS[self.precision].number
        q, u = (tuple(map(kind, pair)) for pair in (scene.q, scene.u))
        second = EQUATIONS[self.formulation].from_speeds(self.chain, q, u)
        integrator.state[:] = [*q, *second]
        integrator.time = kind(0)


def parts_of_run(
    integrator: Any,
    precision: PrecisionName,
    grid: Any,
    cap: float,
    callback: Callable[[Any], bool] | None = None,
) -> Iterator[tuple[Any, int, Any]]:
    """Yield the outcome, the number of steps and the states at times (s) of each part of a run.

    An integrator of heyoka goes along a grid of times; no step is longer than `cap` (s), and
    `callback` is called after each. Its time is the last one that it has reached, also of a run
    that fails.
    """
    own = PRECISIONS[precision]
    ahead, begun = grid, 0
    while True:
        time, state = integrator.time, integrator.state.copy()
        outcome, _, _, taken, _, found = integrator.propagate_grid(
            ahead, max_delta_t=own.number(cap), max_steps=own.steps_at_once, callback=callback
        )
        if not np.isfinite(float(integrator.time)):
            # A step whose coefficients are not finite has no length.
            integrator.time = last_time(integrator, time, state, ahead[-1], own.number(cap))
        # After the first part, the first time is the end of the last part.
        known = np.array(found)[begun:]
        ahead = ahead[begun:][len(known) :]
        yield outcome, taken, known
        if outcome != heyoka().taylor_outcome.step_limit:
            return
        # The grid continues at exactly the time of the integrator. The next of its times may be
        # later by less than a rounding.
        reached = own.number(integrator.time)
        if len(ahead) and not ahead[0] > reached:
            reached = ahead[0] - own.number(own.rounding) * ahead[0]
        integrator.time = reached
        ahead, begun = np.concatenate([own.array([reached]), ahead]), 1


class _Ends:
    """The ends of the steps of a run: `times` (s) in float64, and `states`, shape (n, 4).

    `note` is a callback of heyoka's integrators, for runs that are not recorded otherwise.
    """

    def __init__(self, integrator: Any) -> None:
        """Store an integrator at the start of its run."""
        state = integrator.state
        self._kind, self._stride = state.dtype, 1
        self.times, self.states = np.zeros(0), np.zeros((0, 4), self._kind)
        noted: tuple[list[Any], list[bytes]] = [], []
        note_time, note_state, copied = noted[0].append, noted[1].append, state.tobytes
        self._noted = noted

        def note(integrator: Any) -> bool:
            note_time(integrator.time)
            note_state(copied())
            return True

        self.note = note

    def take(self) -> None:
        """Add the ends that were noted."""
        times, states = self._noted
        if times:
            joined: Any = np.ndarray((len(times), 4), self._kind, b"".join(states))
            self.add(np.array(times, self._kind), joined)
            times.clear()
            states.clear()

    def add(self, times: Any, states: Any) -> None:
        """Add ends, of which only some are kept if they are very many."""
        kept = slice(None, None, self._stride)
        self.times = np.concatenate([self.times, times[kept].astype(float)])
        self.states = np.concatenate([self.states, states[kept]])
        if len(self.times) > _MOST_ENDS:
            self.times, self.states = self.times[::2], self.states[::2]
            self._stride *= 2


class _Recorder:
    """A callback of heyoka's integrators that keeps the steps until they are fetched."""

    def __init__(self, integrator: Any) -> None:
        """Store an integrator at the start of its run."""
        # A view of the integrator's own memory, whose bytes are copied faster than numbers.
        self._integrator, self._coefficients = integrator, integrator.tc
        self._begin()

    def _begin(self) -> None:
        self._from = self._integrator.time
        self._lengths: list[Any] = []
        self._taken: list[bytes] = []

    def __call__(self, integrator: Any) -> bool:
        """Keep a step, and let the integrator continue."""
        self._lengths.append(integrator.last_h)
        self._taken.append(self._coefficients.tobytes())
        return True

    def steps(self) -> Steps:
        """Return the steps since the last call."""
        end = self._integrator.state.copy()
        lengths = np.array(self._lengths, end.dtype)
        # Equal steps are rounded alike: the sum of thousands in long doubles misses the times of
        # loads by more than a rounding of float64.
        longest = PRECISIONS["quadruple"]
        begin = longest.lengthened(np.array([self._from], end.dtype))
        exact = np.add.accumulate(np.concatenate([begin, longest.lengthened(lengths)]))[:-1]
        starts = exact.astype(float)
        rests = (exact - starts.astype(exact.dtype)).astype(float)
        shape = len(lengths), *self._coefficients.shape
        coefficients: Any = np.ndarray(shape, end.dtype, b"".join(self._taken))
        found = Steps(starts, rests, lengths, coefficients, end)
        self._begin()
        return found


def compile_ahead(
    thread: CompilationThread,
    scene: Scene,
    formulation: EquationsName,
    precision: PrecisionName,
    order: int,
) -> None:
    """Compile the integrators of a scene in a thread, unless they are there.

    A run that has the thread waits for them, and finds those of effects that are values.
    """
    code, *_ = PRECISIONS[precision].codes
    key = _key_of(scene, formulation, precision, order, code)
    _, effects, *_ = key
    if key not in _compiled and effects.is_value:
        thread.request(key, functools.partial(_compiled, *key))


_Key = tuple[Content, Content, EquationsName, PrecisionName, int, Code]


def _key_of(
    scene: Scene,
    formulation: EquationsName,
    precision: PrecisionName,
    order: int | None,
    code: Code,
) -> _Key:
    """Return the arguments of `_compiled` for a scene."""
    chain, effects = Content((scene.moving_chain,)), Content(scene.effects)
    return chain, effects, formulation, precision, order or PRECISIONS[precision].full_order, code


def _compile(
    chain: Content,
    effects: Content,
    formulation: EquationsName,
    precision: PrecisionName,
    order: int,
    code: Code,
) -> _Compiled:
    """Return compiled integrators, for scenes that differ only in their start."""
    hy = heyoka()
    kind = PRECISIONS[precision].number
    (given,) = chain.objects
    own = given.convert(kind)
    integrator = hy.taylor_adaptive(
        expressions_of(formulation, own, effects.objects, kind),
        np.array([kind(0)] * 4),
        tol=kind(PRECISIONS[precision].step_tolerance(order)),
        fp_type=kind,
        opt_level=code.level,
        compact_mode=code.compact,
    )
    operations = len(integrator.decomposition) - 8
    return _Compiled(IntegratorPool(integrator), own, formulation, precision, operations)


_compiled = Memo(_compile, 128)
