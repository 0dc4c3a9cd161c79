"""Steps that passed a change of the loads, from the residuals of their polynomials.

A step whose series has converged leaves a residual f(y) − y′ of the size of the first omitted term,
anywhere on it. A load that changed within the step, unseen at its start, leaves a larger one, at
nodes that are none of the rule by which the error is measured.
"""

from __future__ import annotations

import math

import numpy as np

from twolink.effects import is_built_in
from twolink.integration.precisions import PRECISIONS
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.linear import scaled_polynomials
from twolink.simulation.smooth.load_sizes import load_sizes
from twolink.simulation.smooth.rates import rates_of
from twolink.simulation.smooth.taylor import Steps

# The places on a step.
_NODES = (np.arange(64) + 0.5) / 64

# Factors on the residual of a series that has converged, and on the round-off of its evaluation.
_TERMS, _ROUNDINGS = 100.0, 64.0

# The part of a step that passed a change for which the run is repeated.
_SHORTER = 1 / 4


class Residuals:
    """An observer of the steps of a run; `longest_step` (s) is infinite if none passed a change."""

    def __init__(self, scene: Scene, formulation: EquationsName) -> None:
        """Store the run."""
        self._scene, self._formulation = scene, formulation
        self._rates = rates_of(scene, formulation, "double")
        self.longest_step = math.inf

    def __call__(self, steps: Steps) -> None:
        """Look at steps; those from 0 s begin a new run."""
        if steps.starts[0] == 0:
            self.longest_step = math.inf
        scaled = scaled_polynomials(steps)
        lengths = steps.lengths.astype(float)
        with np.errstate(all="ignore"):
            found = self._residuals(scaled, steps.starts, lengths)
            # An allowance that is not a number says nothing about a step.
            passed = ~np.isfinite(found) | (found > self._allowed(scaled, steps.starts, lengths))
        shortest = float(lengths[passed].min(initial=math.inf))
        self.longest_step = min(self.longest_step, _SHORTER * shortest)

    def _residuals(self, scaled: Array, starts: Array, lengths: Array) -> Array:
        """Return the largest h f(y) − y′ of each step, shape (n,)."""
        k = np.arange(scaled.shape[2])[:, None]
        values = np.moveaxis(scaled @ _NODES**k, 1, 0)
        slopes = np.moveaxis(scaled @ (k * _NODES ** np.maximum(k - 1, 0)), 1, 0)
        times = starts[:, None] + lengths[:, None] * _NODES
        found = lengths[:, None] * self._rates(np.ascontiguousarray(values), times) - slopes
        return np.asarray(np.abs(found).max(axis=(0, 2)))

    def _allowed(self, scaled: Array, starts: Array, lengths: Array) -> Array:
        """Return the largest residual of a step that passed no change, shape (n,)."""
        order = scaled.shape[2] - 1
        states = np.maximum(1.0, np.abs(scaled).max(axis=(1, 2)))
        omitted = (order + 1) * math.exp(-2 * (order + 1)) * states
        q, x = scaled[:, :, 0].T[:2], scaled[:, :, 0].T[2:]
        u = np.array(EQUATIONS[self._formulation].to_speeds(self._scene.moving_chain, q, x))
        loads = load_sizes(self._scene, self._formulation, q, u, starts)
        of_loads = lengths * (loads.errors + loads.spread).max(axis=0)
        slopes = (np.abs(scaled) * np.arange(order + 1)).sum(axis=2).max(axis=1)
        rounded = PRECISIONS["double"].rounding * (states + slopes + of_loads)
        return np.asarray(_TERMS * omitted + _ROUNDINGS * rounded)


def residuals_of(scene: Scene, formulation: EquationsName) -> Residuals | None:
    """Return an observer for scenes whose loads may change unseen: with effects not built in."""
    if all(is_built_in(effect) for effect in scene.effects):
        return None
    return Residuals(scene, formulation)
