"""Steps in multiple precision that passed a change of the loads."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.smooth.residuals import Residuals, residuals_of

# Steps that are looked at together.
_AT_ONCE = 256


class PreciseSteps:
    """The steps of a run in multiple precision, from their residuals in float64.

    Scenes whose effects are all built in are not looked at: their loads change slowly.
    """

    def __init__(self, scene: Scene, equations: EquationsName) -> None:
        """Begin without steps."""
        self._residuals: Residuals | None = residuals_of(scene, equations)
        self._starts: list[float] = []
        self._lengths: list[float] = []
        self._scaled: list[Any] = []

    @property
    def are_checked(self) -> bool:
        """Whether an effect may change within a step."""
        return self._residuals is not None

    def add(self, integrator: Any) -> None:
        """Add the last step of an integrator, which has written its Taylor coefficients."""
        if self._residuals is None:
            return
        length = integrator.last_h
        coefficients = integrator.tc
        # The powers of a step of high order leave the range of float64.
        powers = np.multiply.accumulate(np.full(coefficients.shape[1], length))
        scaled = coefficients.copy()
        scaled[:, 1:] *= powers[:-1]
        self._starts.append(float(integrator.time - length))
        self._lengths.append(float(length))
        self._scaled.append(scaled.astype(float))
        if len(self._scaled) == _AT_ONCE:
            self._look(self._residuals)

    def longest_resolving_step(self) -> float:
        """Return the longest step (s) that would resolve a change; infinite if none was passed."""
        if self._residuals is None:
            return math.inf
        if self._scaled:
            self._look(self._residuals)
        return self._residuals.longest_step

    def _look(self, residuals: Residuals) -> None:
        """Look at the steps so far, and forget them."""
        residuals.look(np.array(self._scaled), np.array(self._starts), np.array(self._lengths))
        for known in (self._starts, self._lengths, self._scaled):
            known.clear()
