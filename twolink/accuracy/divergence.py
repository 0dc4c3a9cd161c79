"""Divergence of neighbouring motions: linear or exponential in time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from twolink.integration.precisions import OPTIMISED
from twolink.scene import Scene
from twolink.simulation.smooth.taylor import taylor_run

# Initial distance (rad) of two motions, far above rounding, and the number of time scales.
_APART = 1e-10
_SCALES = 1000


@dataclass(frozen=True)
class Divergence:
    """The growth factor of a small distance in a time (s) of `scales` time scales.

    The distance grows linearly in a regular motion, by a factor of about `scales` or less, and by
    many powers of ten in a chaotic one. The square of `scales` separates both.
    """

    factor: float
    seconds: float
    scales: int = _SCALES

    @property
    def chaotic(self) -> bool:
        """Whether neighbouring motions diverge faster than in a regular motion."""
        return self.factor > self.scales**2


def divergence(scene: Scene, scale: float) -> Divergence:
    """Return the divergence of a scene's motion and a neighbour over a thousand time scales (s)."""
    seconds = _SCALES * scale

    def run(shift: float) -> Any:
        moved = replace(scene, q=(scene.q[0] + shift, scene.q[1]), duration=seconds)
        times = np.linspace(0.0, seconds, _SCALES + 1)
        return taylor_run(moved, times, formulation="momenta", code=OPTIMISED).q

    return Divergence(float(np.abs(run(_APART) - run(0.0)).max() / _APART), seconds)
