"""Verdicts: comparisons of one URDF, their tables, and the sentence that sums them up."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from twolink.engines.marks import Mark, Result
from twolink.tables import Cell, Column, Table, Tone, table

KEY = (
    "d/n: worst difference d and tolerance n at that state, both in units in the last place. "
    "Agreement means d ≤ n."
)
"""The meaning of a cell."""

KINEMATICS = "twolink's kinematics"
"""The source of kinematic quantities in comparisons."""


@dataclass(frozen=True)
class Comparison:
    """One quantity from two sources, at the state with the largest difference.

    The largest difference is relative to the tolerance at each state. `algorithm` is the engine's
    name for it. `difference` and `allowed` are in `unit`; `units` and `allowed_units` are multiples
    of ε times the size of the summed terms: units in the last place, without cancellation. `state`
    has the joint angles, speeds, … of that state.
    """

    quantity: str
    algorithm: str
    unit: str
    source: str
    against: str
    difference: float
    allowed: float
    units: float
    allowed_units: float
    state: dict[str, list[float]]

    @property
    def share(self) -> float:
        """The difference in units of the tolerance."""
        return self.units / self.allowed_units

    @property
    def mark(self) -> Mark:
        """The mark: a pass if the difference is within the tolerance in every state."""
        return Result(self.share, finite=math.isfinite(self.difference)).mark

    @property
    def passed(self) -> bool:
        """Whether the difference is within the tolerance in every state."""
        return self.mark is Mark.PASS


@dataclass(frozen=True)
class Verdict:
    """All comparisons of one URDF, with the data that reproduce them."""

    urdf: str
    engine: str
    states: int
    seed: int
    assumptions: tuple[str, ...]
    comparisons: tuple[Comparison, ...]
    versions: dict[str, str]
    machine: dict[str, str | int | None]

    def __repr__(self) -> str:
        """Return the verdict in one sentence, with the URDF and the engine."""
        return f"<Verdict on {Path(self.urdf).name} in {self.engine}: {self.sentence}>"

    def _repr_html_(self) -> str:
        """Return the sentence and the tables, for notebooks."""
        tables = "\n".join(each.html() for each in self.tables())
        return f"<p><strong>{html.escape(self.sentence)}</strong></p>\n{tables}\n<p>{KEY}</p>"

    @property
    def passed(self) -> bool:
        """Whether every comparison passed."""
        return all(comparison.passed for comparison in self.comparisons)

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        failures = [c for c in self.comparisons if not c.passed]
        count = len(self.comparisons)
        if not failures:
            worst = max(self.comparisons, key=lambda c: c.share)
            return (
                f"All {count} comparisons agree at {self.states} states; "
                f"the largest difference is {worst.share:.1%} of its tolerance ({worst.quantity})."
            )
        worst = max(failures, key=lambda c: c.share)
        return (
            f"{len(failures)} of {count} comparisons disagree; the worst is the {worst.quantity} "
            f"of {worst.source} against {worst.against}: {worst.difference:.3g} {worst.unit}, "
            f"with a tolerance of {worst.allowed:.2g}."
        )

    def tables(self, dynamics: str = "Equations of motion") -> tuple[Table, ...]:
        """Return the tables: dynamics under this title, and kinematics if compared."""
        moving = [c for c in self.comparisons if c.source != KINEMATICS]
        points = [c for c in self.comparisons if c.source == KINEMATICS]
        titled = ((dynamics, moving), ("Motion of the points", points))
        return tuple(_comparisons(title, found) for title, found in titled if found)


def _comparisons(title: str, comparisons: Iterable[Comparison]) -> Table:
    """Return a table of quantities by sources; the points C1, C2 and D share a row."""
    found = list(comparisons)
    pairs = list(dict.fromkeys((c.source, c.against) for c in found))
    columns = [
        Column("quantity"),
        Column("Pinocchio's algorithm", spare=1),
        *(Column(f"{a}\n− {b.split()[0]}", number=True) for a, b in pairs),
    ]
    rows: list[tuple[str | Cell, ...]] = []
    for row in dict.fromkeys(c.quantity.partition(" of ")[0] for c in found):
        inside = [c for c in found if c.quantity.partition(" of ")[0] == row]
        points = dict.fromkeys(c.quantity.partition(" of ")[2] for c in inside)
        label = f"{row} of {', '.join(points)}" if len(points) > 1 else row
        worst = (
            max((c for c in inside if (c.source, c.against) == pair), key=lambda c: c.share)
            for pair in pairs
        )
        rows.append((label, inside[0].algorithm, *map(_cell, worst)))
    return table(title, columns, rows)


def _cell(comparison: Comparison) -> Cell:
    # Never longer than "<0.01".
    units = f"{comparison.units:.2g}" if comparison.units < 100 else f"{comparison.units:.0e}"
    if 0 < comparison.units < 0.01:
        units = "<0.01"
    mark, tone = ("✓", Tone.GOOD) if comparison.passed else ("✗", Tone.BAD)
    return Cell(f"{units}/{comparison.allowed_units:.0f} {mark}", tone)
