"""Where double precision runs out: the floor of its error, and how long digits can be held."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.accuracy.truth import Truth, truth
from twolink.scene import Scene
from twolink.simulation.motion import has_modes, motion_run
from twolink.simulation.smooth.taylor import FULL_ORDERS

_SAMPLES = 401


@dataclass(frozen=True)
class Floor:
    """How the rounding of float64 grows in a scene, at the full order of the Taylor series.

    `times` (s) and the largest `errors` so far (rad, rad/s), shape (n,). `growth` is the number of
    digits that are lost in a second, by a straight line through the logarithm of the errors.
    """

    times: NDArray[np.float64]
    errors: NDArray[np.float64]
    growth: float

    @property
    def error(self) -> float:
        """The error at the end: what no setting in double precision reliably beats."""
        return float(self.errors[-1])

    def held_until(self, digits: int) -> tuple[float, bool]:
        """Return until when (s) so many digits are held, and whether that was measured.

        Beyond the run it is where the straight line leads; endlessly, if errors do not grow.
        """
        lost = self.errors > 10.0**-digits
        if lost.any():
            return float(self.times[max(int(lost.argmax()) - 1, 0)]), True
        if self.growth <= 0:
            return math.inf, False
        left = -digits - math.log10(self.error)
        return float(self.times[-1] + left / self.growth), False


def floor(scene: Scene) -> Floor:
    """Return how rounding grows over a scene's run, judged by 113 bits."""
    times = np.linspace(0.0, scene.duration, _SAMPLES)
    exact = truth(scene, times)
    equations = "lagrange" if has_modes(scene) else "momenta"
    run = motion_run(scene, times, formulation=equations, order=FULL_ORDERS["double"])
    errors = np.maximum.accumulate(_errors(exact, run.q, run.u))
    # Where modes change, samples right beside an impact may be before it or after it.
    seen = errors > 0
    growth = float(np.polyfit(times[seen], np.log10(errors[seen]), 1)[0]) if seen.sum() > 2 else 0.0
    return Floor(times, errors, growth)


def _errors(exact: Truth, q: Any, u: Any) -> NDArray[np.float64]:
    kind = type(exact.q.flat[0])
    found = np.vectorize(kind, otypes=[exact.q.dtype])(np.concatenate([q, u]))
    return np.asarray(
        np.abs(found - np.concatenate([exact.q, exact.u])).max(axis=0), dtype=np.float64
    )
