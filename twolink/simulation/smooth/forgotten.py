"""The part of an error of the start that damping takes away.

A run from a start nearby shows how an error of the start grows, and by this how round-off does. But
where loads depend on speeds, they may take such an error away, and a motion that loses its balance
later multiplies the round-off of the steps until then: a link that is held across by a fast turn,
and not by a slow one. In angles and momenta the volume of errors is kept by all other loads, and
shrinks by exp(−∫ tr D dt) by these, where D = −M⁻¹ ∂Q/∂u has the rates of damping. So an error of a
step grows by at most about exp(∫ tr D dt) times as much as one of the start, for the positive rates
alone. That is pessimistic, and takes no derivatives by angles: for lanes of many motions. The flows
of `growth_along` tell more of a single one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.chain import Chain
from twolink.effects import Effect, smooth_loads
from twolink.simulation.smooth.equations import EQUATIONS, gathered_force

Array = NDArray[np.float64]

# The part of the largest speed by which speeds are changed for the derivatives of loads.
_CHANGE = 2.0**-17

# Larger ones are unknown.
_LARGEST_EXPONENT = 200.0


def factor_of(exponents: Array) -> Array:
    """Return the factors by the integrals of rates, infinite for those beyond any use."""
    known = exponents <= _LARGEST_EXPONENT
    return np.where(known, np.exp(np.where(known, exponents, 0.0)), np.inf)


def damping_rates(chain: Chain, effects: tuple[Effect, ...], q: Any, u: Any, t: Any) -> Array:
    """Return the sum of the positive rates of damping (1/s) in states, shape (…).

    q (rad) and u (rad/s) have shape (2, …). Loads that do not depend on speeds give exactly 0.
    """
    change = _CHANGE * np.maximum(1.0, np.abs(u).max(axis=0))
    signs = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]])
    moved = u[:, None] + np.multiply.outer(signs, change)
    angles = np.broadcast_to(q[:, None], moved.shape)
    with np.errstate(all="ignore"):
        loads = smooth_loads(effects, chain, tuple(angles), tuple(moved), t)
        found = gathered_force(chain, tuple(angles), loads)
        forces = np.array([np.broadcast_to(force, moved.shape[1:]) for force in found], float)
        slopes = (forces[:, ::2] - forces[:, 1::2]) / (2 * change)
        # Row i has the accelerations by a unit of speed i.
        (a, b), (c, d) = (EQUATIONS["lagrange"].by_forces(chain, q, slopes[:, i]) for i in (0, 1))
        middle = -(a + d) / 2
        apart = np.sqrt(np.maximum(middle * middle - (a * d - b * c), 0.0))
        return np.asarray(np.maximum(middle + apart, 0.0) + np.maximum(middle - apart, 0.0))
