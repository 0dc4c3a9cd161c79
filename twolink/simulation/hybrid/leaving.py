"""The motion by a small constant load in a mode: it grows, is held back, or neither."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.arithmetic import Pair
from twolink.contact.states import ContactState
from twolink.effects import contact_elements
from twolink.simulation.hybrid.constraint import parallel
from twolink.simulation.hybrid.dynamics import mode_solution
from twolink.simulation.hybrid.mode import Leaving
from twolink.simulation.hybrid.noise import vanishes
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import NO_EIGENVALUE, SMALL_CHANGE

Array = NDArray[np.float64]


def leaving(system: HybridSystem, state: HybridState, states: Sequence[ContactState]) -> Leaving:
    """Return how a small change of a state goes on in a mode, by the linearized motion.

    It is that along the directions that the mode leaves free. Only a chain at rest is held back.
    The growth is infinite where accelerations are not finite.
    """
    free = _free_directions(system, state, states)
    if not len(free):
        return Leaving(0.0, math.inf)
    try:
        with np.errstate(all="ignore"):
            slopes = _slopes(system, state, states, free)
    except (ArithmeticError, ValueError):
        # Functions of floats raise errors where those of arrays return NaN.
        return Leaving(math.inf, 0.0)
    if not np.isfinite(slopes).all():
        return Leaving(math.inf, 0.0)
    count = len(free)
    linear = np.zeros((2 * count, 2 * count))
    linear[:count, count:], linear[count:] = np.eye(count), slopes
    found = np.linalg.eigvals(linear)
    sizes, growth = np.abs(found), float(found.real.max())
    # The two of a free direction are equal: they have the square root of its round-off.
    least = NO_EIGENVALUE * float(sizes.max())
    slowest = 0.0 if any(state.u) else float(sizes.min())
    return Leaving(growth if growth > least else 0.0, slowest if slowest > least else 0.0)


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
    system: HybridSystem, state: HybridState, states: Sequence[ContactState], free: Array
) -> Array:
    """Return the derivatives of accelerations along free directions by both, shape (k, 2 k)."""
    start = np.array([*map(float, state.q), *map(float, state.u)])
    changes = np.kron(np.eye(2), free)

    def along(sign: float) -> Array:
        moved = [start + sign * SMALL_CHANGE * change for change in changes]
        return np.array([free @ _acceleration(system, state, states, each) for each in moved])

    return (along(1.0) - along(-1.0)).T.reshape(len(free), len(changes)) / (2 * SMALL_CHANGE)


def _acceleration(
    system: HybridSystem, state: HybridState, states: Sequence[ContactState], values: Array
) -> Array:
    """Return du/dt (rad/s²) of a mode at q and u, shape (4,), in float64."""
    chain, (q1, q2, u1, u2) = system.scene_chain, values.tolist()
    q: Pair = (q1, q2)
    elements = contact_elements(system.effects, chain)
    dents: list[Any] = [own.plastic if own is not None else None for own in state.compliant]
    solution = mode_solution(
        Pose(chain, system.formulation, q), system.effects, elements, states, dents, (u1, u2),
        float(state.t),
    )  # fmt: skip
    return np.array(solution.du, dtype=float)
