"""Motion by methods that evaluate only rates: those of SciPy, and the fixed-step methods."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.compilation import Compiled
from twolink.effects import Effect
from twolink.errors import IntegrationError, SimulationError
from twolink.integration.method import Array, Rates
from twolink.integration.methods import NUMERIC_METHODS, NumericName
from twolink.integration.operations import Operations, of_formula, of_rates, total
from twolink.integration.precisions import PrecisionName
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.pieces import pieces_of


@dataclass(frozen=True)
class NumericRun:
    """A motion at the requested times, and its cost.

    `q` (rad) and `u` (rad/s) have shape (2, n); the rates were evaluated `evaluations` times, and
    `arithmetic` are the floating-point operations of the whole run.
    """

    q: Array
    u: Array
    steps: int
    evaluations: int
    run_seconds: float
    arithmetic: Operations
    precision: PrecisionName = "double"


def numeric_run(
    scene: Scene,
    times: Array,
    *,
    method: NumericName,
    formulation: EquationsName,
    setting: float,
    progress: Callable[[float], None] | None = None,
) -> NumericRun:
    """Return the motion of a scene at increasing times (s), the first of them 0.

    `setting` is the value of the method's parameter: a tolerance, or a step (s). Raises
    `IntegrationError` if the method fails with it, and `SimulationError` for loads that are finite
    in no state.
    """
    equations, chain = EQUATIONS[formulation], scene.moving_chain.convert(float)
    chosen = NUMERIC_METHODS[method]
    variables = np.array([*scene.q, *equations.from_speeds(chain, scene.q, scene.u)], dtype=float)
    found, steps, evaluations, seconds = [variables[:, None]], 0, 0, 0.0
    arithmetic: list[Operations] = []
    for piece, effects in pieces_of(scene, times):
        formula = _formula(chain, effects, formulation)
        rates = _Counted(_rates(formula), scene.duration, progress)
        start = perf_counter()
        states, taken = chosen.integrate(rates, piece, variables.tolist(), setting)
        seconds += perf_counter() - start
        beside = chosen.beside_rates(taken, rates.count)
        arithmetic.append(of_rates(rates.count, of_formula(formula.operations), beside))
        steps, evaluations, variables = steps + taken, evaluations + rates.count, states[:, -1]
        found.append(states[:, 1:][:, np.isin(piece[1:], times)])
        if not np.isfinite(states).all():
            raise IntegrationError(
                f"{method} produced non-finite values at a {chosen.parameter} of {setting:.3g}"
            )
    whole = np.concatenate(found, axis=1)
    u = np.array(equations.to_speeds(chain, tuple(whole[:2]), tuple(whole[2:])))
    return NumericRun(whole[:2], u, steps, evaluations, seconds, total(arithmetic))


def _formula(chain: Chain, effects: tuple[Effect, ...], formulation: EquationsName) -> Compiled:
    """Return the equations' rates, compiled."""
    equations = EQUATIONS[formulation]

    def text(q: Pair, x: Pair, time: Pair) -> tuple[Pair, Pair]:
        return equations.rates(chain, effects, q, x, time[0])

    try:
        return Compiled(text)
    except (ArithmeticError, ValueError) as error:
        raise SimulationError(
            f"the loads must be finite in some state; in every state they end in: {error}"
        ) from error


def _rates(compiled: Compiled) -> Rates:
    """Return compiled rates as a function of time and variables."""

    def rates(t: float, variables: Array) -> Array:
        q1, q2, x1, x2 = variables.tolist()
        try:
            first, second = compiled((q1, q2), (x1, x2), (float(t), 0.0))
        except (ArithmeticError, ValueError) as error:
            raise IntegrationError(
                f"the motion could not be integrated beyond {t:.6g} s, where its rates are not"
                " finite"
            ) from error
        return np.array([*first, *second])

    return rates


class _Counted:
    """A function that counts its calls and reports progress."""

    _EVERY = 4096

    def __init__(
        self, rates: Rates, duration: float, progress: Callable[[float], None] | None
    ) -> None:
        self._rates, self._duration, self._progress = rates, duration, progress
        self.count = 0

    def __call__(self, t: float, variables: Array) -> Array:
        self.count += 1
        if self._progress is not None and self.count % self._EVERY == 0:
            self._progress(t / self._duration)
        return self._rates(t, variables)
