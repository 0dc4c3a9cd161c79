"""A smooth motion with its measured error."""

from __future__ import annotations

from dataclasses import dataclass

from twolink.simulation.run import Array, MotionRun
from twolink.simulation.smooth.visited import VisitingRun


@dataclass(frozen=True)
class Measured:
    """The result, its largest error up to each time (rad, rad/s), and all runs.

    All compilation took `compile_seconds`. `why_unknown` says why errors are infinite, where they
    are.
    """

    kept: MotionRun
    errors: Array
    runs: tuple[VisitingRun, ...]
    compile_seconds: float = 0.0
    why_unknown: str = "it grows beyond what can be measured"

    @property
    def worst(self) -> float:
        """The largest error (rad, rad/s)."""
        return float(self.errors.max())
