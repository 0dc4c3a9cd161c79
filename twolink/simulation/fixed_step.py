"""Fixed-step methods, each with the order it declares.

The Gauss–Legendre methods (the implicit midpoint rule is the first of them) and the semi-implicit
Euler method are symplectic in the variables (q, p). Their equations are solved by fixed-point
iteration, until the iterates stop approaching each other: to rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twolink.errors import SimulationError

Array = NDArray[np.float64]
Rates = Callable[[float, Array], Array]
Step = Callable[[Rates, float, Array, float], Array]

_MOST_ITERATIONS = 100


@dataclass(frozen=True)
class FixedStep:
    """A method: its order, and its step from time t (s) over h (s)."""

    order: int
    step: Step


def _rk4(rates: Rates, t: float, x: Array, h: float) -> Array:
    k1 = rates(t, x)
    k2 = rates(t + h / 2, x + h / 2 * k1)
    k3 = rates(t + h / 2, x + h / 2 * k2)
    k4 = rates(t + h, x + h * k3)
    return np.asarray(x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))


def _semi_implicit_euler(rates: Rates, t: float, x: Array, h: float) -> Array:
    """The second pair by its rate at the old q and the new second pair; then q by its own."""

    def improved(new: Array) -> Array:
        rate = rates(t, np.array([x[0], x[1], new[2], new[3]]))
        return np.asarray(x + h * rate)

    return _fixed_point(improved, x + h * rates(t, x))


def _gauss_legendre(matrix: list[list[float]], weights: list[float]) -> Step:
    """Return the step of an implicit Runge–Kutta method with this tableau."""
    A, b = np.array(matrix), np.array(weights)
    c = A.sum(axis=1)

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
    raise SimulationError("an implicit step did not converge; allowed is a shorter step")


_R3, _R15 = np.sqrt(3.0), np.sqrt(15.0)

FIXED_STEP: dict[str, FixedStep] = {
    "rk4": FixedStep(4, _rk4),
    "semi-implicit-euler": FixedStep(1, _semi_implicit_euler),
    "implicit-midpoint": FixedStep(2, _gauss_legendre([[0.5]], [1.0])),
    "gauss-legendre-4": FixedStep(
        4,
        _gauss_legendre([[1 / 4, 1 / 4 - _R3 / 6], [1 / 4 + _R3 / 6, 1 / 4]], [1 / 2, 1 / 2]),
    ),
    "gauss-legendre-6": FixedStep(
        6,
        _gauss_legendre(
            [
                [5 / 36, 2 / 9 - _R15 / 15, 5 / 36 - _R15 / 30],
                [5 / 36 + _R15 / 24, 2 / 9, 5 / 36 - _R15 / 24],
                [5 / 36 + _R15 / 30, 2 / 9 + _R15 / 15, 5 / 36],
            ],
            [5 / 18, 4 / 9, 5 / 18],
        ),
    ),
}
