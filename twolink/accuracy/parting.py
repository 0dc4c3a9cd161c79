"""How fast neighbouring motions part: in proportion to time, or exponentially."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from twolink.scene import Scene
from twolink.simulation.smooth.taylor import taylor_run

# Two starts this far apart (rad), far above rounding, are followed for so many time scales.
_APART = 1e-10
_SCALES = 1000


@dataclass(frozen=True)
class Parting:
    """By what factor two neighbours have parted in a time (s), which is `scales` time scales.

    The distance in a regular motion grows like time, by a factor near to `scales` or less; in a
    chaotic one by many powers of ten. The square of `scales` stands between the two.
    """

    factor: float
    seconds: float
    scales: int = _SCALES

    @property
    def chaotic(self) -> bool:
        """Whether neighbours part faster than any regular motion lets them."""
        return self.factor > self.scales**2


def parting(scene: Scene, scale: float) -> Parting:
    """Return how far a scene's motion parts from a neighbour's over a thousand time scales (s)."""
    seconds = _SCALES * scale

    def run(shift: float) -> Any:
        moved = replace(scene, q=(scene.q[0] + shift, scene.q[1]), duration=seconds)
        times = np.linspace(0.0, seconds, _SCALES + 1)
        return taylor_run(moved, times, formulation="momenta", optimised=True).q

    return Parting(float(np.abs(run(_APART) - run(0.0)).max() / _APART), seconds)
