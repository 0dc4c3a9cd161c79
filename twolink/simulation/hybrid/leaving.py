"""The motion by a small constant load in a mode: it grows, is held back, or neither."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.contact.states import ContactState
from twolink.simulation.hybrid.constraint import parallel
from twolink.simulation.hybrid.dynamics import mode_solution
from twolink.simulation.hybrid.jet import Jet
from twolink.simulation.hybrid.mode import Leaving
from twolink.simulation.hybrid.noise import size_of, vanishes
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import CHANGED_STATE, NO_GROWTH, ROUNDED_SLOPE

Array = NDArray[np.float64]


def leaving(system: HybridSystem, state: HybridState, states: Sequence[ContactState]) -> Leaving:
    """Return how a small change of a state goes on in a mode, by the linearized motion.

    It is that along the directions that the mode leaves free. Only a chain at rest is held back,
    but for the speed at which roundings of a start vanish. The growth is infinite where
    accelerations are not finite.
    """
    free = _free_directions(system, state, states)
    if not len(free):
        return Leaving(0.0, math.inf)
    try:
        with np.errstate(all="ignore"):
            # They differ where a load has a kink.
            every = [_slopes(system, state, states, sign) for sign in (-1, 1)]
            found = [_by_slopes(system, state, free, slopes) for slopes in every]
    except (ArithmeticError, ValueError):
        # Functions of floats raise errors where those of arrays return NaN.
        return Leaving(math.inf, 0.0)
    return Leaving.worst(found)


def _by_slopes(system: HybridSystem, state: HybridState, free: Array, slopes: Any) -> Leaving:
    """Return how a small change goes on along free directions, by derivatives of accelerations."""
    terms = _characteristic(_along(free, slopes), _along(np.abs(free), np.abs(slopes)))
    exact = [_beyond_rounding(own, size, system.rounding) for own, size in terms]
    if not all(map(math.isfinite, exact)):
        return Leaving(math.inf, 0.0)
    found = np.roots(exact)
    grows = found.real > NO_GROWTH * np.abs(found)
    growth = float(found.real[grows].max(initial=0.0))
    # The last one is zero where no force acts along a free direction.
    held = exact[-1] and size_of(state.u) <= system.scales.of_rounded_start
    slowest = float(np.abs(found).min()) if held else 0.0
    return Leaving(growth, slowest, float(np.abs(found).max(initial=0.0)))


def _free_directions(
    system: HybridSystem, state: HybridState, states: Sequence[ContactState]
) -> Array:
    """Return the changes of q that a mode leaves free, shape (k, 2)."""
    pose = system.pose(state.q)
    rows = [pose.row(coordinate) for coordinate in system.held(tuple(states))]
    rows = [row for row in rows if not vanishes(system, row)]
    if not rows:
        return np.eye(2)
    if any(not parallel(rows[0], row, pose.lever) for row in rows[1:]):
        return np.zeros((0, 2))
    x, y = map(float, rows[0])
    return np.array([[-y, x]]) / math.hypot(x, y)


def _slopes(
    system: HybridSystem, state: HybridState, states: Sequence[ContactState], sign: int
) -> Any:
    """Return the derivatives of u' (1/s², 1/s) by q and u in a mode, shape (2, 4).

    They are those on one side of the state, of this sign, at a distance of some roundings.
    """
    change = system.number(sign * CHANGED_STATE)
    dents: list[Any] = [own.plastic if own is not None else None for own in state.compliant]
    found = np.zeros((2, 4), dtype=object)
    given = (*state.q, *state.u)
    for place in range(len(given)):
        moved = [
            Jet((x + change, 0 * x + 1) if k == place else (x, 0 * x)) for k, x in enumerate(given)
        ]
        q1, q2, u1, u2 = moved
        solution = mode_solution(
            Pose(system.chain, system.formulation, (q1, q2)), system.effects, system.elements,
            states, dents, (u1, u2), Jet((state.t, 0 * state.t)),
        )  # fmt: skip
        for row, own in enumerate(solution.du):
            found[row, place] = own.terms[1] if isinstance(own, Jet) else 0.0
    return found


def _along(free: Array, slopes: Any) -> Any:
    """Return the derivatives of accelerations along free directions by both, shape (k, 2 k)."""
    return free.dot(slopes).dot(np.kron(np.eye(2), free).T)


def _characteristic(slopes: Any, sizes: Any) -> list[tuple[Any, Any]]:
    """Return det(x² − x B − A), from the highest power of x, for the derivatives A and B.

    Each coefficient has the sum of the sizes of its terms; `sizes` are those of the derivatives.
    """
    if len(slopes) == 1:
        ((a, b),), ((A, B),) = slopes, sizes
        return [(1.0, 1.0), (-b, B), (-a, A)]
    (a, b, c, d), (e, f, g, h) = slopes
    (A, B, C, D), (E, F, G, H) = sizes
    return [
        (1.0, 1.0),
        (-(c + h), C + H),
        (c * h - d * g - a - f, C * H + D * G + A + F),
        (a * h + c * f - b * g - d * e, A * H + C * F + B * G + D * E),
        (a * f - b * e, A * F + B * E),
    ]


def _beyond_rounding(value: Any, size: Any, rounding: float) -> float:
    """Return a coefficient, 0 if it is round-off of terms of a size."""
    return float(value) if not abs(value) <= ROUNDED_SLOPE * rounding * size else 0.0
