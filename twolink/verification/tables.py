"""Tables of a verdict."""

from __future__ import annotations

from collections.abc import Iterable

from twolink.tables import Cell, Column, Table, Tone, table
from twolink.verification.verify import Comparison, Verdict

KEY = (
    "d/n: worst difference d and tolerance n at that state, both in units in the last place. "
    "Agreement means d ≤ n."
)
"""The meaning of a cell."""

# The source of the kinematic quantities in comparisons.
_KINEMATICS = "Section 6.1"


def tables_of(verdict: Verdict, dynamics: str = "Equations of motion") -> tuple[Table, ...]:
    """Return the tables of a verdict: dynamics under this title, and kinematics if compared."""
    moving = [c for c in verdict.comparisons if c.source != _KINEMATICS]
    points = [c for c in verdict.comparisons if c.source == _KINEMATICS]
    titled = ((dynamics, moving), ("Motion of the points", points))
    return tuple(_comparisons(title, found) for title, found in titled if found)


def _comparisons(title: str, comparisons: Iterable[Comparison]) -> Table:
    """Return a table of quantities by sources; the points C1, C2 and D share a row."""
    found = list(comparisons)
    pairs = list(dict.fromkeys((c.source, c.against) for c in found))
    columns = [
        Column("quantity"),
        Column("Pinocchio's algorithm", spare=1),
        *(Column(f"{_named(a)}\n− {b.split()[0]}", number=True) for a, b in pairs),
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


def _named(source: str) -> str:
    return "twolink's kinematics" if source == _KINEMATICS else source


def _cell(comparison: Comparison) -> Cell:
    # Never longer than "<0.01".
    units = f"{comparison.units:.2g}" if comparison.units < 100 else f"{comparison.units:.0e}"
    if 0 < comparison.units < 0.01:
        units = "<0.01"
    mark, tone = ("✓", Tone.GOOD) if comparison.passed else ("✗", Tone.BAD)
    return Cell(f"{units}/{comparison.allowed_units:.0f} {mark}", tone)
