"""One step of a method as a compiled map of the state, x to Φ(x), for many initial states at once.

A million steps in Python take minutes. Here several successive steps are written with heyoka's
expressions, by the same tableaus as `twolink.integration.fixed_step`, and compiled as one
function of the state (q, p). The equations must be autonomous.

A compiled step has no convergence loop. Implicit stages are iterated a fixed number of times, large
enough that one more iteration changes nothing: `StageIteration` determines it along the motion.
Unconverged stages would cause an energy drift (Hairer, McLachlan and Razakarivony, Achieving
Brouwer's law with implicit Runge–Kutta methods, 2008).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.errors import SimulationError
from twolink.integration.tableaus import Tableau
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.smooth.equations import MomentumEquations

Array = NDArray[np.float64]
Variables = list[Any]
Rates = Callable[[Variables], Variables]

_MOST_ITERATIONS = 60
# Compile time is proportional to the number of unrolled evaluations of the rates.
_RATES_IN_A_MAP = 48

# Some milliseconds of work.
_CALLS_BETWEEN_REPORTS = 4096


@dataclass(frozen=True)
class SemiImplicitEuler:
    """The symplectic Euler method: p by its rate at the old q and the new p, then q.

    Hairer, Lubich and Wanner, Geometric Numerical Integration (2006), section VI.3, theorem 3.3.
    """


FixedMethod = Tableau | SemiImplicitEuler


def scipy_tableau(name: str) -> Tableau:
    """Return the tableau of SciPy's RK45 or DOP853 without the error estimate."""
    from scipy import integrate

    method: Any = getattr(integrate, name)
    return Tableau(
        A=tuple(tuple(float(a) for a in row) for row in method.A[:, : len(method.B)]),
        b=tuple(float(b) for b in method.B),
    )


@dataclass(frozen=True)
class StepMap:
    """A number of steps of a method, of h (s) each, as one compiled function.

    `iterations` is the number of iterations of implicit equations per step, 0 for explicit methods.
    """

    h: float
    steps: int
    iterations: int
    compiled: Callable[..., Any]

    def advance(
        self, states: Array, calls: int, progress: Callable[[int], None] | None = None
    ) -> Array:
        """Return states (q1, q2, p1, p2), of shape (4, n), after `calls` calls of the map.

        `progress` receives the number of calls that are done, now and then.
        """
        here, there = np.array(states, order="C"), np.empty_like(states, order="C")
        for done in range(calls):
            self.compiled(inputs=here, outputs=there)
            here, there = there, here
            if progress is not None and done % _CALLS_BETWEEN_REPORTS == 0:
                progress(done)
        return here


def step_map(
    scene: Scene,
    method: FixedMethod,
    h: float,
    *,
    iterations: int = 0,
    steps: int | None = None,
) -> StepMap:
    """Return the map of a method with step h (s) on a scene's equations in (q, p).

    It takes a number of steps at once; the default limits the compile time. Raises
    `SimulationError` if heyoka is not installed.
    """
    hy, variables, rates = _system(scene)
    stages = 1 if isinstance(method, SemiImplicitEuler) else len(method.b)
    steps = steps or max(1, _RATES_IN_A_MAP // (stages * (iterations + 1)))
    moved = variables
    for _ in range(steps):
        moved = _step(method, rates, moved, h, iterations)
    return StepMap(h, steps, iterations, hy.cfunc(moved, variables))


class StageIteration:
    """The fixed-point iteration of an implicit method's stages.

    `needed` counts the iterations for given states, `change` the effect of one more.
    """

    def __init__(self, scene: Scene, method: FixedMethod, h: float) -> None:
        """Compile one iteration of a method with step h (s)."""
        hy, variables, rates = _system(scene)
        guess = _guess(method, rates, variables)
        symbols = hy.make_vars(*(f"k{i}_{j}" for i in range(len(guess)) for j in range(4)))
        stages = [list(symbols[4 * i : 4 * i + 4]) for i in range(len(guess))]
        improved = _flat(_improved(method, rates, variables, h, stages))
        self._h = h
        self._once = hy.cfunc(improved, [*variables, *symbols])
        self._first = hy.cfunc(_flat(guess), variables)

    def needed(self, states: Array) -> int:
        """Return the number of iterations after which the slopes of all states (4, n) are constant.

        The remaining change is rounding, which no longer shrinks. Raises `SimulationError` if
        the iteration does not converge.
        """
        smallest = np.inf
        for count, (change, largest) in enumerate(self._changes(states), start=1):
            if not np.isfinite(change):
                break
            if change == 0 or (change >= smallest and change <= 1e-12 * largest):
                return count
            smallest = min(smallest, change)
        raise SimulationError(
            f"an implicit step of {self._h:.3g} s does not converge in {_MOST_ITERATIONS} "
            "iterations; use a shorter step"
        )

    def change(self, states: Array, iterations: int) -> float:
        """Return the largest change of states (4, n) by one more iteration.

        Its unit is a rounding: the distance from 1 to the next number, times the largest variable.
        """
        change = next(c for n, (c, _) in enumerate(self._changes(states)) if n == iterations)
        return self._h * change / float(np.spacing(1.0) * np.abs(states).max())

    def _changes(self, states: Array) -> Iterator[tuple[float, float]]:
        """Return the largest change of a slope and the largest slope at each iteration."""
        guess = self._first(states)
        for _ in range(_MOST_ITERATIONS):
            found = self._once(np.concatenate([states, guess]))
            yield float(np.abs(found - guess).max()), float(np.abs(found).max())
            guess = found


def _system(scene: Scene) -> tuple[Any, Variables, Rates]:
    """Return heyoka, the variables q1, q2, p1, p2, and their rates as expressions."""
    hy = heyoka()
    equations, chain = MomentumEquations(), scene.moving_chain.convert(float)

    def rates(x: Variables) -> Variables:
        dq, dp = equations.rates(chain, scene.effects, (x[0], x[1]), (x[2], x[3]), 0.0)
        return [*dq, *dp]

    return hy, list(hy.make_vars("q1", "q2", "p1", "p2")), rates


def _step(method: FixedMethod, rates: Rates, x: Variables, h: float, iterations: int) -> Variables:
    if isinstance(method, Tableau) and method.explicit:
        slopes: list[Variables] = []
        for row in method.A:
            slopes.append(rates(_moved(x, h, row, slopes)))
        return _moved(x, h, method.b, slopes)
    stages = _guess(method, rates, x)
    for _ in range(iterations):
        stages = _improved(method, rates, x, h, stages)
    return _moved(x, h, (1.0,) if isinstance(method, SemiImplicitEuler) else method.b, stages)


def _guess(method: FixedMethod, rates: Rates, x: Variables) -> list[Variables]:
    """Return the initial guess of an implicit method: the slopes at the step's start."""
    count = 1 if isinstance(method, SemiImplicitEuler) else len(method.b)
    return [rates(x)] * count


def _improved(
    method: FixedMethod, rates: Rates, x: Variables, h: float, stages: list[Variables]
) -> list[Variables]:
    """Return the slopes of an implicit method after one iteration."""
    if isinstance(method, SemiImplicitEuler):
        new = _moved(x, h, (1.0,), stages)
        return [rates([x[0], x[1], new[2], new[3]])]
    return [rates(_moved(x, h, row, stages)) for row in method.A]


def _moved(x: Variables, h: float, factors: Sequence[float], slopes: list[Variables]) -> Variables:
    """Return x + h Σ factor · slope; the increment is summed first, so that x rounds once."""
    used = [(f, slope) for f, slope in zip(factors, slopes, strict=False) if f]
    if not used:
        return x
    return [x[i] + h * sum(f * slope[i] for f, slope in used) for i in range(4)]


def _flat(stages: list[Variables]) -> Variables:
    return [entry for stage in stages for entry in stage]
