"""The round-off floor of double precision in a scene, and the time until digits are lost."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.accuracy.reference_trajectory import ReferenceTrajectory, reference_trajectory
from twolink.integration.precisions import PRECISIONS
from twolink.limits import UNLIMITED, Limits
from twolink.scene import Scene
from twolink.simulation.motion import motion_run

_SAMPLES = 401


@dataclass(frozen=True)
class RoundoffFloor:
    """Growth of float64 round-off in a scene, at the full order of the Taylor series.

    `times` (s) and the largest `errors` up to then (rad, rad/s), shape (n,). `growth` is the number
    of digits lost per second, by a linear fit of the logarithm of the errors.
    """

    times: NDArray[np.float64]
    errors: NDArray[np.float64]
    growth: float

    @property
    def error(self) -> float:
        """The error at the end, the limit of accuracy for any setting in double precision."""
        return float(self.errors[-1])

    def held_until(self, digits: int) -> tuple[float, bool]:
        """Return the time (s) until which digits are correct, and whether it was measured.

        Beyond the run the time is extrapolated linearly; it is infinite if errors do not grow.
        """
        lost = self.errors > 10.0**-digits
        if lost.any():
            return float(self.times[max(int(lost.argmax()) - 1, 0)]), True
        if self.growth <= 0:
            return math.inf, False
        left = -digits - math.log10(self.error)
        return float(self.times[-1] + left / self.growth), False


def roundoff_floor(scene: Scene, *, limits: Limits = UNLIMITED) -> RoundoffFloor:
    """Return the growth of round-off over a scene's run, measured against 113 bits.

    Raises `TooMuchError` if a run would exceed the `limits`.
    """
    times = np.linspace(0.0, scene.duration, _SAMPLES)
    exact = reference_trajectory(scene, times, limits=limits)
    run = motion_run(
        scene, times, formulation="momenta", order=PRECISIONS["double"].full_order, limits=limits
    )
    errors = np.maximum.accumulate(_errors(exact, run.q, run.u))
    # If modes change, samples next to an impact may be before or after it.
    seen, growth = errors > 0, 0.0
    if seen.sum() > 2:
        # By parts of the duration: squares of tiny times would vanish.
        parts = times[seen] / scene.duration
        growth = float(np.polyfit(parts, np.log10(errors[seen]), 1)[0]) / scene.duration
    return RoundoffFloor(times, errors, growth)


def _errors(exact: ReferenceTrajectory, q: Any, u: Any) -> NDArray[np.float64]:
    kind = type(exact.q.flat[0])
    found = np.vectorize(kind, otypes=[exact.q.dtype])(np.concatenate([q, u]))
    return np.asarray(
        np.abs(found - np.concatenate([exact.q, exact.u])).max(axis=0), dtype=np.float64
    )
