"""Fixed-step methods and their orders.

The Gauss–Legendre methods (the implicit midpoint rule is the first of them) and the semi-implicit
Euler method are symplectic in the variables (q, p). Their equations are solved by fixed-point
iteration until the change no longer decreases, at round-off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twolink.errors import SimulationError
from twolink.simulation.smooth.tableaus import GAUSS_LEGENDRE, RK4, Tableau

Array = NDArray[np.float64]
Rates = Callable[[float, Array], Array]
Step = Callable[[Rates, float, Array, float], Array]

_MOST_ITERATIONS = 100


@dataclass(frozen=True)
class FixedStep:
    """A method: its order, and its step from time t (s) over h (s)."""

    order: int
    step: Step


def _explicit(tableau: Tableau) -> Step:
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


def _semi_implicit_euler(rates: Rates, t: float, x: Array, h: float) -> Array:
    """The second pair by its rate at the old q and the new second pair; then q by its own."""

    def improved(new: Array) -> Array:
        rate = rates(t, np.array([x[0], x[1], new[2], new[3]]))
        return np.asarray(x + h * rate)

    return _fixed_point(improved, x + h * rates(t, x))


def _implicit(tableau: Tableau) -> Step:
    """Return the step of an implicit Runge–Kutta method."""
    A, b, c = np.array(tableau.A), np.array(tableau.b), tableau.c

    def step(rates: Rates, t: float, x: Array, h: float) -> Array:
        def improved(slopes: Array) -> Array:
            stages = x + h * A @ slopes
            return np.array([rates(t + h * s, y) for s, y in zip(c, stages, strict=True)])

        slopes = _fixed_point(improved, np.tile(rates(t, x), (len(b), 1)))
        return np.asarray(x + h * b @ slopes)

    return step


def _fixed_point(improved: Callable[[Array], Array], guess: Array) -> Array:
    """Iterate until the change no longer shrinks."""
    smallest = np.inf
    for _ in range(_MOST_ITERATIONS):
        found = improved(guess)
        change = float(np.abs(found - guess).max())
        if not np.isfinite(change):
            break
        if change == 0 or (change >= smallest and change <= 1e-12 * np.abs(found).max()):
            return found
        smallest, guess = min(smallest, change), found
    raise SimulationError("an implicit step did not converge; the step must be shorter")


FIXED_STEP: dict[str, FixedStep] = {
    "rk4": FixedStep(4, _explicit(RK4)),
    "semi-implicit-euler": FixedStep(1, _semi_implicit_euler),
    "implicit-midpoint": FixedStep(2, _implicit(GAUSS_LEGENDRE[2])),
    "gauss-legendre-4": FixedStep(4, _implicit(GAUSS_LEGENDRE[4])),
    "gauss-legendre-6": FixedStep(6, _implicit(GAUSS_LEGENDRE[6])),
}
