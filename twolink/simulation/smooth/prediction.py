"""The orders of further runs, and their round-off, predicted from the growth of errors so far."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.simulation.run import Array
from twolink.simulation.smooth.judging import GROWTH, MARGIN_OF_JUDGES, order_for
from twolink.simulation.smooth.round_off import MOST_ROUND_OFF

# The part of the accuracy for the truncation error of a run near round-off.
_OF_TRUNCATION = 0.2

# The error that round-off leaves, in roundings times the growth, of motions where it is small (the
# median is 0.4).
_ROUND_OFF = 0.1


@dataclass(frozen=True)
class Prediction:
    """The growth of errors along a motion, from which orders and round-off of runs follow.

    `grown` is the error of a unit of truncation at each time, shape (n,), or None before the first
    measurement. Beside the round-off that grows, two runs may have as many roundings as `shared`
    in common.
    """

    grown: Array | None = None
    shared: float = 0.0

    @property
    def growth(self) -> float:
        """The growth of the truncation error of a step over the run."""
        return self._largest or GROWTH

    @property
    def _largest(self) -> float:
        return 0.0 if self.grown is None else float(self.grown.max())

    def room(self, accuracy: float, precision: PrecisionName) -> float:
        """Return the part of an accuracy that the round-off of two runs leaves to their errors."""
        roundings = MOST_ROUND_OFF * self._largest + self.shared
        # Sizes of a motion that diverges may be no numbers: there is no room then.
        return max(0.0, accuracy - PRECISIONS[precision].rounding * roundings)

    def learned(self, grown: Array) -> Prediction:
        """Return the prediction after a measured run has shown the growth of errors."""
        known = np.where(np.isfinite(grown), grown, 0.0)
        return replace(self, grown=known if self.grown is None else np.maximum(self.grown, known))

    def sharing(self, shared: Array, rounding: float) -> Prediction:
        """Return the prediction for runs that share so much round-off of sums and loads."""
        return replace(self, shared=float(shared.max()) / rounding)

    def order_of_pair(self, accuracy: float, precision: PrecisionName) -> int:
        """Return the lowest order of a run whose judge is expected to have an accuracy.

        The judge then has half the error that its round-off leaves; the rest is for more of it.
        """
        room = self.room(accuracy, precision)
        return order_for(room / MARGIN_OF_JUDGES / 2 / self.growth)

    def order_by_defect(self, accuracy: float) -> int:
        """Return the order of a run near round-off whose truncation error leaves room for it."""
        return order_for(_OF_TRUNCATION * accuracy / self.growth)

    def left_by_round_off(self, precision: PrecisionName) -> float:
        """Return the expected error (rad, rad/s) of a run without truncation error."""
        return _ROUND_OFF * self.growth * PRECISIONS[precision].rounding

    def shared_round_off(self, rounding: float) -> Array | float:
        """Return the round-off that grows in two runs, and that they may share, up to each time."""
        return 0.0 if self.grown is None else MOST_ROUND_OFF * rounding * self.grown
