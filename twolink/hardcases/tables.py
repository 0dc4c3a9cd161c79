"""The scoreboard of the hard cases as tables."""

from __future__ import annotations

from collections.abc import Sequence

from twolink.engines.marks import Mark
from twolink.hardcases.record import Case, Column, Outcome
from twolink.hardcases.run import counts
from twolink.tables import Cell, Table, table
from twolink.tables import Column as TableColumn

Board = dict[str, dict[str, Outcome]]


def group_table(
    group: str, cases: Sequence[Case], columns: Sequence[Column], board: Board
) -> Table:
    """Return the outcome of each case in a group."""
    rows: list[list[str | Cell]] = []
    for case in (case for case in cases if case.group == group):
        outcomes = board[case.name]
        name = Cell(case.name, link=f"#case-{case.name}")
        rows.append([name, *(_cell(outcomes[column.name]) for column in columns)])
    # A long name breaks at its hyphen.
    heads = (TableColumn(column.name.replace("-", "-\n")) for column in columns)
    return table(f"Hard cases: {group}", ["", *heads], rows)


def counts_table(columns: Sequence[Column], board: Board) -> Table:
    """Return the number of each mark for each column of the scoreboard."""
    rows = []
    for column in columns:
        found = counts(board, column.name)
        rows.append((column.name, *(str(found.get(mark, "")) for mark in Mark)))
    heads = (TableColumn(mark.value, number=True) for mark in Mark)
    return table("Number of cases by outcome", ["", *heads], rows)


def _cell(outcome: Outcome) -> Cell:
    return Cell(outcome.short, outcome.mark.tone)
