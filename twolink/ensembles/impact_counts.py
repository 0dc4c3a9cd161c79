"""The number of impacts of a run, and whether an independent run has as many.

Bounces that die away are infinitely many in the law of impact: of these a run has only those that
it resolves, and no number is certain.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.ensembles.blocks import Block, Ends, Lanes
from twolink.ensembles.quantity import Accumulator, Quantity, Variable

UNDECIDED, AGREED, ENDLESS = range(3)
VERDICTS = ("undecided", "agreed", "endless")


@dataclass(frozen=True)
class ImpactCounts(Quantity):
    """The number of impacts: agreed if the run that measures this one has as many."""

    of_steps = False

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The number and its verdict."""
        return (
            Variable("impacts", "number of impacts"),
            Variable(
                "impacts_verdict", "verdict on their number", flags=VERDICTS, dtype="u1",
                flags_of_end=(VERDICTS[AGREED], VERDICTS[ENDLESS]),
            ),
        )  # fmt: skip

    def accumulator(self, lanes: Lanes) -> Accumulator:
        """Return an accumulator for runs in lanes."""
        return _ImpactCounts(lanes)


class _ImpactCounts(Accumulator):
    def __init__(self, lanes: Lanes) -> None:
        self._width = lanes.width

    def add(self, block: Block) -> None:
        """Do nothing: impacts are known at the end."""

    def values(self, ends: Ends) -> dict[str, Any]:
        """Return the numbers, which are 0 in scenes without contacts."""
        counts = ends.impacts
        if counts is None:
            return {
                "impacts": np.zeros(self._width),
                "impacts_verdict": np.full(self._width, AGREED, "u1"),
            }
        verdict = np.where(counts.own == counts.other, AGREED, UNDECIDED)
        return {
            "impacts": counts.own.astype(float),
            "impacts_verdict": np.where(counts.endless, ENDLESS, verdict).astype("u1"),
        }
