"""Fixed-step methods.

The Gauss–Legendre methods (the implicit midpoint rule is the first of them) and the semi-implicit
Euler method are symplectic in the variables (q, p). Their equations are solved by fixed-point
iteration until the change no longer decreases, at round-off.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from twolink.errors import IntegrationError
from twolink.integration.method import Array, NumericMethod, Rates
from twolink.integration.operations import Beside
from twolink.integration.tableaus import Tableau

Step = Callable[[Rates, float, Array, float], Array]

_MOST_ITERATIONS = 100

# An iteration has settled if it changes values by this part of them, or the state by so many
# roundings. A converging one multiplies a change of the state by less than 1.
_SETTLED, _ROUNDINGS = 1e-12, 64

# Largest number of steps of a run; the step is halved up to it.
_MOST_STEPS = 200_000
# Least number of steps of the first run.
_LEAST_STEPS = 200


@dataclass(frozen=True, kw_only=True)
class FixedStepMethod(NumericMethod):
    """A method that takes a `step` from time t (s) over h (s); the setting of its parameter is h.

    The step is shortened to divide the time between two samples. `beside` has the operations of the
    steps beside the rates.
    """

    parameter = "step"
    refinement = 0.5

    step: Step
    beside: Beside

    def coarsest(self, accuracy: float, duration: float, between_samples: float) -> float:
        """Return a step (s) that is not longer than the time between samples."""
        return min(between_samples, duration / _LEAST_STEPS)

    def finest(self, duration: float) -> float:
        """Return the step (s) of the largest number of steps."""
        return duration / _MOST_STEPS

    def integrate(
        self, rates: Rates, times: Array, start: list[float], setting: float
    ) -> tuple[Array, int]:
        """Return the variables at the times, and the number of steps."""
        variables = np.array(start)
        found, steps = [variables], 0
        for earlier, later in pairwise(times):
            count = max(1, int(np.ceil((later - earlier) / setting * (1 - 1e-12))))
            h = (later - earlier) / count
            # Numbers that overflow are refused by the rates or the caller, in a sentence.
            with np.errstate(all="ignore"):
                for index in range(count):
                    variables = self.step(rates, float(earlier + index * h), variables, float(h))
            steps += count
            found.append(variables)
        return np.array(found).T, steps

    def beside_rates(self, steps: int, evaluations: int) -> int:
        """Return the operations of a run beside its evaluations of the rates."""
        return self.beside(steps, evaluations)


def explicit(tableau: Tableau) -> Step:
    """Return the step of an explicit Runge–Kutta method, without products by zero."""
    weights = np.array(tableau.b)
    stages = [
        (c, [(a, j) for j, a in enumerate(row) if a])
        for c, row in zip(tableau.c, tableau.A, strict=True)
    ]

    def step(rates: Rates, t: float, x: Array, h: float) -> Array:
        slopes: list[Array] = []
        for c, row in stages:
            moved = x
            for a, j in row:
                moved = moved + (h * a) * slopes[j]
            slopes.append(rates(t + c * h, moved))
        return np.asarray(x + h * weights.dot(slopes))

    return step


def semi_implicit_euler(rates: Rates, t: float, x: Array, h: float) -> Array:
    """The second pair by its rate at the old q and the new second pair; then q by its own."""

    def improved(new: Array) -> Array:
        rate = rates(t, np.array([x[0], x[1], new[2], new[3]]))
        return np.asarray(x + h * rate)

    return _fixed_point(improved, x + h * rates(t, x), _rounding(x))


def implicit(tableau: Tableau) -> Step:
    """Return the step of an implicit Runge–Kutta method."""
    A, b, c = np.array(tableau.A), np.array(tableau.b), tableau.c

    def step(rates: Rates, t: float, x: Array, h: float) -> Array:
        def improved(slopes: Array) -> Array:
            stages = x + h * A @ slopes
            return np.array([rates(t + h * s, y) for s, y in zip(c, stages, strict=True)])

        guess = np.tile(rates(t, x), (len(b), 1))
        slopes = _fixed_point(improved, guess, _rounding(x) / abs(float(h)))
        return np.asarray(x + h * b @ slopes)

    return step


def _fixed_point(improved: Callable[[Array], Array], guess: Array, rounding: float) -> Array:
    """Iterate until the change no longer shrinks, and is round-off: of the values, or `rounding`.

    In a stiff motion near rest the slopes are differences of large terms that nearly cancel, whose
    round-off is that of the state.
    """
    smallest = np.inf
    for _ in range(_MOST_ITERATIONS):
        found = improved(guess)
        change = float(np.abs(found - guess).max())
        if not np.isfinite(change):
            break
        if change == 0:
            return found
        if change >= smallest and change <= max(_SETTLED * np.abs(found).max(), rounding):
            return found
        smallest, guess = min(smallest, change), found
    raise IntegrationError("the iteration of an implicit step did not converge")


def _rounding(x: Array) -> float:
    """Return the round-off that the iteration of a step may leave in a state."""
    return _ROUNDINGS * math.ulp(max(abs(float(number)) for number in x))
