"""The growth of round-off along a motion, by the flows between places on it.

A run from a start nearby shows how an error of the start grows. Loads that depend on speeds or on
time may take such an error away, or turn it into a direction in which it shrinks, and the motion
then multiplies the round-off of later steps by more: a link that a fast turn holds straight, and a
slow one does not. So there the derivatives of the rates are taken at the places at which a motion
is known, and independent errors of all of them are carried to its end.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from twolink.effects import Effect, is_built_in
from twolink.effects.effect import ConservativeEffect, RotorEffect
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.flows import accumulated, exponentials
from twolink.simulation.smooth.moved_start import ON_EACH_STEP
from twolink.simulation.smooth.rates import jacobians_of

_OF_POSE = ConservativeEffect, RotorEffect


class RoundOffGrowth(NamedTuple):
    """The growth of errors up to each time, shape (n,), infinite where it is unknown.

    `from_start` is that of an error of the start, and `of_steps` that of errors of later steps
    where it may be larger.
    """

    from_start: Array
    of_steps: Array

    @property
    def on_each_step(self) -> Array:
        """The error of a run with a round-off of 1 on each step."""
        return np.asarray(np.maximum(ON_EACH_STEP * self.from_start, self.of_steps))


def is_conservative(effects: tuple[Effect, ...]) -> bool:
    """Return whether all loads follow from a potential energy: those of built-in effects.

    One's own may depend on time as well.
    """
    return all(isinstance(effect, _OF_POSE) and is_built_in(effect) for effect in effects)


def growth_along(scene: Scene, formulation: EquationsName, times: Any, states: Any) -> Array:
    """Return the growth of independent errors of all places on a motion up to each, shape (n,).

    Each place has errors as large as the state: of 1 rad, or of the largest angle, and of the
    largest speeds or momenta. q and u at the times (s) have shape (4, n). The growth (rad, rad/s)
    is infinite where it is not finite.
    """
    times, states = np.asarray(times, dtype=float), np.asarray(states).astype(float)
    chain = scene.moving_chain.convert(float)
    x = EQUATIONS[formulation].from_speeds(chain, tuple(states[:2]), tuple(states[2:]))
    variables = np.array([*states[:2], *np.broadcast_arrays(*x)])
    sizes = np.abs(variables).max(axis=1).reshape(2, 2).max(axis=1)
    own = np.repeat([max(1.0, sizes[0]), sizes[1] or 1.0], 2) ** 2
    with np.errstate(all="ignore"):
        jacobians = jacobians_of(scene, formulation)(variables, times).transpose(2, 0, 1)
        middle = (jacobians[1:] + jacobians[:-1]) / 2 * np.diff(times)[:, None, None]
        flows, _ = exponentials(middle)
        count = len(flows)
        start = np.zeros((4, 0)), np.diag(own)
        _, spread = accumulated(
            flows, np.zeros((count, 4, 0)), np.broadcast_to(own, (count, 4)), start
        )
        rows = jacobians[:, :2]
        of_speeds = np.einsum("ijk,ikl,ijl->ij", rows, spread, rows)
        of_angles = np.einsum("ijj->ij", spread[:, :2, :2])
        # Round-off may leave a variance of zero below zero.
        every = np.sqrt(np.maximum(np.concatenate([of_angles, of_speeds], axis=1), 0.0)).max(axis=1)
    found = np.where(np.isfinite(every), every, np.inf)
    return np.asarray(np.maximum.accumulate(found))
