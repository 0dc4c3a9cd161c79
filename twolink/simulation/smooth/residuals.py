"""Steps that passed a change of the loads, from the residuals of their polynomials.

A step whose series has converged leaves a residual f(y) − y′ of the size of the first omitted term,
anywhere on it. A load that changed within the step, unseen at its start, leaves a larger one, at
nodes that are none of the rule by which the error is measured.

The residual of momenta is compared as one of speeds too: momenta of a small chain are small beside
its angles, by which heyoka chooses the step.
"""

from __future__ import annotations

import math

import numpy as np

from twolink.effects import is_built_in
from twolink.integration.precisions import PRECISIONS
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.shortened import SHORTER_TO_RESOLVE, RepeatError
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.linear import scaled_polynomials
from twolink.simulation.smooth.load_sizes import load_sizes
from twolink.simulation.smooth.rates import rates_of
from twolink.simulation.smooth.steps import Observer, Steps

NODES = (np.arange(64) + 0.5) / 64
"""The places on a step."""

SIGNS = np.tile([[1, 1, 1, 1], [1, -1, 1, -1], [1, 1, -1, -1], [1, -1, -1, 1]], len(NODES) // 4)
"""Signs of roundings of the four variables at the places, shape (4, 64).

Those of any two variables are equal at half of the places, and opposite at the others: equal
roundings of two large angles would cancel in their difference.
"""

ROUNDINGS = 64.0
"""The factor on the round-off of the evaluation of residuals."""

# The factor on the residual of a series that has converged.
_TERMS = 100.0

# The relative change of a state by whose effect on the rates their round-off is seen: a load may be
# steep.
_CHANGED = 2.0**-50

# Steps that are looked at together, which bounds the memory.
_AT_ONCE = 1024


def at_places(scaled: Array) -> tuple[Array, Array]:
    """Return the values and the slopes of polynomials (n, v, p + 1) at the places: (v, n, 64)."""
    k = np.arange(scaled.shape[2])[:, None]
    values = np.ascontiguousarray(np.moveaxis(scaled @ NODES**k, 1, 0))
    return values, np.moveaxis(scaled @ (k * NODES ** np.maximum(k - 1, 0)), 1, 0)


def of_converged(order: int) -> float:
    """Return the largest residual of a series of an order that has converged, of unit size."""
    return _TERMS * (order + 1) * math.exp(-2 * (order + 1))


class Residuals:
    """An observer of the steps of a run; `longest_step` (s) is infinite if none passed a change."""

    def __init__(self, scene: Scene, formulation: EquationsName) -> None:
        """Store the run."""
        self._scene, self._formulation = scene, formulation
        self._chain, self._equations = scene.moving_chain.convert(float), EQUATIONS[formulation]
        self._rates = rates_of(scene, formulation, "double", alone=True)
        self.longest_step = math.inf

    def __call__(self, steps: Steps) -> None:
        """Look at steps; those from 0 s begin a new run."""
        if steps.starts[0] == 0:
            self.longest_step = math.inf
        self.look(scaled_polynomials(steps), steps.starts, steps.lengths.astype(float))

    def until_passed(self, longest: float, shortest: float) -> Observer:
        """Return an observer of a run with steps up to `longest` (s), which ends one that passes.

        It raises `RepeatError` where the run is to be repeated, with steps that are not below the
        `shortest` (s): beyond a change that it has not seen a run may take any number of steps.
        """

        def look(steps: Steps) -> None:
            self(steps)
            if shortest <= self.longest_step < longest:
                raise RepeatError(self.longest_step)

        return look

    def look(self, scaled: Array, starts: Array, lengths: Array) -> None:
        """Look at steps: polynomials of their shares, shape (n, 4, p + 1), starts and lengths (s).

        All are in float64.
        """
        for first in range(0, len(lengths), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            with np.errstate(all="ignore"):
                passed = self._passed(scaled[some], starts[some], lengths[some])
            shortest = float(lengths[some][passed].min(initial=math.inf))
            self.longest_step = min(self.longest_step, SHORTER_TO_RESOLVE * shortest)

    def _passed(self, scaled: Array, starts: Array, lengths: Array) -> Array:
        """Return which steps passed a change, shape (n,)."""
        found, as_turns, noise, noise_turns = self._residuals(scaled, starts, lengths)
        order, sizes = scaled.shape[2] - 1, np.abs(scaled)
        omitted = of_converged(order)
        states = np.maximum(1.0, sizes.max(axis=(1, 2)))
        angles = np.maximum(1.0, sizes[:, :2].max(axis=(1, 2)))
        rounded, rounded_turns = self._rounded(scaled, states, starts, lengths)
        # A term of u is one of q, of the next order, divided by the step.
        allowed = omitted * states + rounded + noise
        allowed_turns = omitted * (order + 2) * angles + rounded_turns + noise_turns
        # Sizes of loads that are not known say nothing about a step.
        passed = ~np.isfinite(found) | (found > allowed) | (as_turns > allowed_turns)
        return np.asarray(passed)

    def _residuals(self, scaled: Array, starts: Array, lengths: Array) -> tuple[Array, ...]:
        """Return the largest h f(y) − y′ of each step, and that of speeds times h: (n,).

        The round-off of both by that of y follows.
        """
        values, slopes = at_places(scaled)
        times = starts[:, None] + lengths[:, None] * NODES
        rates = lengths[:, None] * self._rates(values, times)
        changed = values * (1 + _CHANGED * SIGNS)[:, None]
        noise = lengths[:, None] * self._rates(changed, (1 + _CHANGED) * times) - rates
        # Where round-off is unknown none is allowed for.
        known = np.where(np.isfinite(noise), noise, 0.0)
        residuals = self._largest(values, lengths, rates - slopes)
        return (*residuals, *self._largest(values, lengths, known))

    def _largest(self, values: Array, lengths: Array, found: Array) -> tuple[Array, Array]:
        """Return the largest entry of each step, and that of speeds times h: (n,)."""
        speeds = np.array(self._equations.to_speeds(self._chain, values[:2], found[2:]))
        largest = np.abs(found).max(axis=(0, 2))
        return largest, lengths * np.abs(speeds).max(axis=(0, 2))

    def _rounded(
        self, scaled: Array, states: Array, starts: Array, lengths: Array
    ) -> tuple[Array, Array]:
        """Return the round-off of both residuals of steps, shape (n,)."""
        q, x = scaled[:, :, 0].T[:2], scaled[:, :, 0].T[2:]
        u = np.array(self._equations.to_speeds(self._chain, q, x))
        loads = load_sizes(self._scene, self._formulation, q, u, starts)
        of_loads = lengths * (loads.errors + loads.spread)
        slopes = (np.abs(scaled) * np.arange(scaled.shape[2])).sum(axis=2)
        largest = states + slopes.max(axis=1) + of_loads.max(axis=0)
        sizes = np.abs(x) + slopes.T[2:] + of_loads
        speeds = self._equations.sizes_of_speeds(self._chain, q, sizes)
        rounding = ROUNDINGS * PRECISIONS["double"].rounding
        return rounding * largest, rounding * lengths * np.asarray(speeds).max(axis=0)


def residuals_of(scene: Scene, formulation: EquationsName) -> Residuals | None:
    """Return an observer for scenes whose loads may change unseen: with effects not built in."""
    if all(is_built_in(effect) for effect in scene.effects):
        return None
    return Residuals(scene, formulation)
