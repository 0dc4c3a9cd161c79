"""The report's scoreboard: the outcome of each hard case with each engine."""

from __future__ import annotations

from collections.abc import Sequence

from twolink.engines.marks import Mark
from twolink.hardcases import Case, Column, Outcome
from twolink.hardcases.run import verdict
from twolink.hardcases.tables import Board, counts_table, group_table
from twolink.tables import table as described
from twolink.viz.report.page import Section, heading, paragraph, table, text


def hard_cases(cases: Sequence[Case], columns: Sequence[Column], board: Board) -> Section:
    """Return the scoreboard with its verdict and a description of each case."""
    passed, sentence = verdict(board)
    groups = dict.fromkeys(case.group for case in cases)
    body = (
        paragraph(sentence, "verdict" if passed else "verdict bad")
        + paragraph(
            "External engines run in separate processes, with their best method at a fine setting."
        )
        + _key()
        + table(counts_table(columns, board))
        + "".join(table(group_table(g, cases, columns, board), "board") for g in groups)
        + heading("Description of each case, and failures")
        + "".join(_about(case, board[case.name]) for case in cases)
    )
    return Section("Hard cases", body)


def _key() -> str:
    return paragraph("; ".join(f"{mark.short}: {mark.means}" for mark in Mark) + ".", "note")


def _about(case: Case, row: dict[str, Outcome]) -> str:
    """Return a case's description and the failures of engines, collapsed."""
    facts = [
        ("expected", case.expected),
        ("reference", case.reference),
        ("bound", case.bound),
    ]
    facts += [
        (name, f"{outcome.words}: {outcome.said}")
        for name, outcome in row.items()
        if outcome.mark not in (Mark.PASS, Mark.CANNOT)
    ]
    return (
        f'<details id="case-{case.name}"><summary><b>{text(case.name)}</b>: {text(case.hard)}'
        f"</summary>{table(described('', ('', ''), facts))}</details>\n"
    )
