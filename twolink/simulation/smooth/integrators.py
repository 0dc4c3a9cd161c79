"""The integrators of a scene by Taylor series, compiled by heyoka.

The equations are evaluated once on heyoka's expressions with exactly the loads of the scene, so the
compiled code has no other operations.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from twolink.chain import Chain
from twolink.errors import SimulationError
from twolink.integration.outcomes import check_arrival, last_time
from twolink.integration.precisions import PRECISIONS, Code, PrecisionName
from twolink.names import EquationsName
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.compilation_thread import CompilationThread
from twolink.simulation.memo import Memo
from twolink.simulation.pool import IntegratorPool
from twolink.simulation.run import Array
from twolink.simulation.smooth.equations import EQUATIONS, expressions_of
from twolink.simulation.smooth.moved_start import Move, moved_start
from twolink.simulation.smooth.steps import Observer, StepNotes
from twolink.values import Content


def heyoka_is_here() -> bool:
    """Return whether heyoka can be imported."""
    try:
        heyoka()
    except SimulationError:
        return False
    return True


class Followed(NamedTuple):
    """q and u at the requested times, each of shape (2, n), and the number of steps.

    The `ends` of steps (s) and the values there, shape (4, m), are empty unless they are requested.
    """

    q: Any
    u: Any
    steps: int
    ends: tuple[Array, Any]


@dataclass(frozen=True)
class Integrators:
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
        moved: Move | None = None,
    ) -> Followed | None:
        """Return the motion at the times of a grid (s), or None if it takes `most` steps.

        With `visits` it has the ends of steps. The start may be `moved`. No step is
        longer than `cap` (s). Raises `IntegrationError` if the motion cannot be integrated to the
        last time.
        """
        outcomes = heyoka().taylor_outcome
        rows: list[Any] = []
        steps = 0
        with self.pool.lend() as integrator:
            self._start(integrator, scene, moved)
            notes = StepNotes(integrator, observe, ends=visits)
            parts = parts_of_run(integrator, self.precision, grid, cap, notes.callback)
            for outcome, taken, known in parts:
                rows.append(known)
                steps += taken
                notes.take()
                if outcome == outcomes.step_limit and steps >= most:
                    return None
                if outcome == outcomes.step_limit and progress is not None:
                    progress(float(integrator.time) / scene.duration)
            reached = float(integrator.time)
        check_arrival(outcome, reached, scene.duration)
        q, u = self._motion(np.concatenate(rows).T)
        ends, states = notes.ends
        return Followed(q, u, steps, (ends, np.concatenate(self._motion(states.T))))

    def _motion(self, variables: Any) -> tuple[Any, Any]:
        """Return q and u from the variables, shape (4, n)."""
        to_speeds = EQUATIONS[self.formulation].to_speeds
        return variables[:2], np.array(to_speeds(self.chain, variables[:2], variables[2:]))

    def step_times(self, scene: Scene, cap: float, moved: Move | None = None) -> Any:
        """Return the boundaries (s) of the steps of a motion, none longer than `cap` (s)."""
        kind, ends = PRECISIONS[self.precision].number, [0.0]

        def note(integrator: Any) -> bool:
            ends.append(float(integrator.time))
            return True

        with self.pool.lend() as integrator:
            self._start(integrator, scene, moved)
            integrator.propagate_until(kind(scene.duration), max_delta_t=kind(cap), callback=note)
        return np.array(ends)

    def _start(self, integrator: Any, scene: Scene, moved: Move | None) -> None:
        """Set an integrator to the start of a scene, or to one that is moved."""
        kind = PRECISIONS[self.precision].number
        q, u = (tuple(map(kind, pair)) for pair in (scene.q, scene.u))
        if moved is not None:
            q, u = moved_start(q, u, moved)
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
    scene_key = key_of(scene, formulation, precision, order)
    key = scene_key.of(code)
    if key not in INTEGRATORS and scene_key.effects.is_value:
        thread.request(key, functools.partial(INTEGRATORS, *key))


class Key(NamedTuple):
    """The arguments of `INTEGRATORS` for a scene, all but the code."""

    chain: Content
    effects: Content
    formulation: EquationsName
    precision: PrecisionName
    order: int

    def of(self, code: Code) -> tuple[Any, ...]:
        """Return the arguments for some code."""
        return (*self, code)


def key_of(
    scene: Scene, formulation: EquationsName, precision: PrecisionName, order: int | None
) -> Key:
    """Return the key of a scene and an order, by default the full one of the precision."""
    chain, effects = Content((scene.moving_chain,)), Content(scene.effects)
    return Key(chain, effects, formulation, precision, order or PRECISIONS[precision].full_order)


def _compile(
    chain: Content,
    effects: Content,
    formulation: EquationsName,
    precision: PrecisionName,
    order: int,
    code: Code,
) -> Integrators:
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
    return Integrators(IntegratorPool(integrator), own, formulation, precision, operations)


INTEGRATORS = Memo(_compile, 128)
"""The integrators of the last scenes, by the values of `key_of`."""
