"""Long runs of many initial states at once: each method as a stream of states over time."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.accuracy.step_maps import (
    Array,
    FixedMethod,
    SemiImplicitEuler,
    StageIteration,
    StepMap,
    scipy_tableau,
    step_map,
)
from twolink.integration.precisions import PRECISIONS
from twolink.integration.tableaus import GAUSS_LEGENDRE, RK4, Tableau
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.smooth.equations import MomentumEquations
from twolink.simulation.smooth.longest_step import default_longest_step

# Number of float64 values in the widest SIMD registers.
LANES = 8

# Steps of a series between two reports: some milliseconds of work.
_STEPS_AT_ONCE = 2000

Stream = Callable[[Array, Callable[[float], None]], Iterator[tuple[float, Array]]]
"""States at times (s), and a callback that receives the time (s) reached between them."""


@dataclass(frozen=True)
class LongMethod:
    """A method and the expected exponent of its energy error over time.

    `share` is its step relative to the radius of convergence of the motion's series, 0 for Taylor
    series, which choose their own. Shares are chosen so that the errors of methods are distinct.
    `fixed` is the fixed-step method, or the name of a SciPy tableau.
    """

    name: str
    family: str
    order: int
    expected: float
    share: float = 0.0
    fixed: FixedMethod | str | None = None
    starts: int = LANES


@dataclass(frozen=True)
class LongRun:
    """A method that is ready to run from states (4, n).

    `stream` yields times (s) and states (4, n) close to the given times, and calls a function with
    the time (s) that is reached between them; `step` returns the step (s), for Taylor series the
    mean so far. Implicit equations are iterated `iterations` times per step, and `unfinished`
    returns the change of states by one more iteration, in roundings.
    """

    stream: Stream
    step: Callable[[], float]
    iterations: int = 0
    unfinished: Callable[[Array], float] = lambda states: 0.0


# Symplectic methods conserve an energy near to the true one, over times exponentially long in 1/h
# (Hairer, Lubich and Wanner, Geometric Numerical Integration, 2006, section IX.8); with others it
# drifts at a constant rate. Random rounding gives a random walk (Brouwer, On the
# accumulation of errors in numerical integration, 1937).
_BOUNDED, _RANDOM_WALK, _LINEAR = 0.0, 0.5, 1.0
_FULL = PRECISIONS["double"].full_order
_COARSE = 11

LONG_METHODS = (
    LongMethod("semi-implicit-euler", "symplectic", 1, _BOUNDED, 0.03, SemiImplicitEuler()),
    LongMethod("implicit-midpoint", "symplectic", 2, _BOUNDED, 0.06, GAUSS_LEGENDRE[2]),
    LongMethod("gauss-legendre-4", "symplectic", 4, _BOUNDED, 0.12, GAUSS_LEGENDRE[4]),
    LongMethod("gauss-legendre-6", "symplectic", 6, _BOUNDED, 0.15, GAUSS_LEGENDRE[6]),
    LongMethod("rk4", "runge-kutta", 4, _LINEAR, 0.03, RK4),
    LongMethod("RK45", "runge-kutta", 5, _LINEAR, 0.03, "RK45"),
    LongMethod("DOP853", "runge-kutta", 8, _LINEAR, 0.10, "DOP853"),
    LongMethod(f"taylor-{_COARSE}", "taylor", _COARSE, _LINEAR),
    LongMethod(f"taylor-{_FULL}", "taylor", _FULL, _RANDOM_WALK, starts=2 * LANES),
)


def prepared(method: LongMethod, scene: Scene, radius: float, states: Array) -> LongRun:
    """Return a method, compiled and ready to run from states (q1, q2, p1, p2) of shape (4, n).

    `radius` (s) is the radius of convergence of the motion's series. The first `method.starts` of
    `states` are initial states; all of them are visited by the motion, and implicit equations are
    solved to rounding there. Raises `SimulationError` if they do not converge.
    """
    starts = np.array(states[:, : method.starts], order="C")
    if method.fixed is None:
        return _by_series(scene, method.order, starts)
    fixed = scipy_tableau(method.fixed) if isinstance(method.fixed, str) else method.fixed
    return _by_maps(scene, fixed, _legible(method.share * radius), starts, states)


def _legible(h: float) -> float:
    """Return a step rounded to two digits."""
    return float(f"{h:.1e}")


def _by_maps(scene: Scene, method: FixedMethod, h: float, starts: Array, visited: Array) -> LongRun:
    if isinstance(method, Tableau) and method.explicit:
        return LongRun(_map_stream(step_map(scene, method, h), starts), lambda: h)
    stages = StageIteration(scene, method, h)
    iterations = stages.needed(visited)
    return LongRun(
        _map_stream(step_map(scene, method, h, iterations=iterations), starts),
        lambda: h,
        iterations,
        lambda states: stages.change(np.concatenate([visited, states], axis=1), iterations),
    )


def _map_stream(steps: StepMap, starts: Array) -> Stream:
    length = steps.steps * steps.h

    def stream(times: Array, report: Callable[[float], None]) -> Iterator[tuple[float, Array]]:
        states, done = starts, 0

        def reached(further: int) -> None:
            report((done + further) * length)

        for calls in np.unique(np.ceil(times / length).astype(int)):
            states = steps.advance(states, int(calls) - done, reached)
            done = int(calls)
            yield done * length, states

    return stream


def _by_series(scene: Scene, order: int, starts: Array) -> LongRun:
    """Run many initial states as `simulation.smooth.taylor` runs one, with its tolerance and cap.

    If the integration of one fails, its whole batch is NaN from there on.
    """
    hy = heyoka()
    equations, chain = MomentumEquations(), scene.moving_chain.convert(float)
    q1, q2, p1, p2 = hy.make_vars("q1", "q2", "p1", "p2")
    dq, dp = equations.rates(chain, scene.effects, (q1, q2), (p1, p2), 0.0)
    system = list(zip((q1, q2, p1, p2), (*dq, *dp), strict=True))
    parts = [np.array(starts[:, k : k + LANES]) for k in range(0, starts.shape[1], LANES)]
    first = hy.taylor_adaptive_batch(
        system, parts[0], tol=PRECISIONS["double"].step_tolerance(order)
    )
    integrators = [first, *(copy.deepcopy(first) for _ in parts[1:])]
    for integrator, part in zip(integrators, parts, strict=True):
        integrator.state[:] = part
    cap = [default_longest_step(scene)] * LANES
    taken = _Taken()
    reached, unfinished = hy.taylor_outcome.time_limit, hy.taylor_outcome.step_limit

    def advance(integrator: Any, time: float, report: Callable[[float], None]) -> None:
        """Integrate to a time (s) in parts, so that signals are answered between them."""
        while True:
            integrator.propagate_until([time] * LANES, max_delta_t=cap, max_steps=_STEPS_AT_ONCE)
            taken.steps += sum(result[3] for result in integrator.propagate_res)
            ends = {result[0] for result in integrator.propagate_res}
            if not ends <= {reached, unfinished}:
                integrator.state[:] = np.nan
                return
            if unfinished not in ends:
                return
            report(float(np.min(integrator.time)))

    def stream(times: Array, report: Callable[[float], None]) -> Iterator[tuple[float, Array]]:
        for time in times:
            for integrator in integrators:
                advance(integrator, float(time), report)
            taken.time = float(time) * LANES * len(integrators)
            yield float(time), np.concatenate([one.state for one in integrators], axis=1)

    return LongRun(stream, lambda: taken.time / max(taken.steps, 1))


@dataclass
class _Taken:
    """The number of steps of all initial states together and the time (s) they cover."""

    steps: int = 0
    time: float = 0.0


def many_starts(scene: Scene, count: int, *, spread: float, seed: int) -> Any:
    """Return states (q1, q2, p1, p2), shape (4, n), around a scene's initial state.

    Angles have normal deviations of `spread` (rad), speeds are the scene's; the first state is
    exact.
    """
    equations, chain = MomentumEquations(), scene.moving_chain.convert(float)
    scatter = spread * np.random.default_rng(seed).standard_normal((2, count))
    scatter[:, 0] = 0.0
    q = np.array(scene.q, dtype=float)[:, None] + scatter
    u = np.array(scene.u, dtype=float)[:, None] + 0 * scatter
    return np.array([*q, *equations.from_speeds(chain, tuple(q), tuple(u))])
