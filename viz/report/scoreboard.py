"""The report's scoreboard: the outcome of each hard case with each engine."""

from __future__ import annotations

from collections.abc import Sequence

from twolink.hardcases import Case, Column, Mark, Outcome
from twolink.hardcases.run import counts, verdict
from viz.report.page import Section, heading, paragraph, table, text

Board = dict[str, dict[str, Outcome]]

# CSS classes of marks; silent errors are red.
_CLASSES = {
    Mark.PASS: "good",
    Mark.SILENT: "bad",
    Mark.CRASH: "bad",
    Mark.HANG: "bad",
}


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
        + _summary(columns, board)
        + "".join(_group(group, cases, columns, board) for group in groups)
        + heading("Description of each case, and failures")
        + "".join(_about(case, board[case.name]) for case in cases)
    )
    return Section("Hard cases", body)


def _key() -> str:
    return paragraph("; ".join(f"{mark.short}: {mark.means}" for mark in Mark) + ".", "note")


def _summary(columns: Sequence[Column], board: Board) -> str:
    """Return the number of each mark for each engine."""
    rows = []
    for column in columns:
        found = counts(board, column.name)
        rows.append([text(column.name), *(str(found.get(mark, "")) for mark in Mark)])
    heads = ["", *(mark.value for mark in Mark)]
    return table(heads, rows, numbers=range(1, len(heads)), caption="Number of cases by outcome")


def _group(group: str, cases: Sequence[Case], columns: Sequence[Column], board: Board) -> str:
    rows = [
        [
            f'<a href="#case-{case.name}">{text(case.name)}</a>',
            *(_cell(board[case.name][column.name]) for column in columns),
        ]
        for case in cases
        if case.group == group
    ]
    # A long word may break at its hyphen.
    heads = ["", *(text(column.name).replace("-", "-<wbr>") for column in columns)]
    return table(heads, rows, caption=group.capitalize(), kind="board")


def _cell(outcome: Outcome) -> str:
    return f'<span class="{_CLASSES.get(outcome.mark, "soft")}">{text(outcome.short)}</span>'


def _about(case: Case, row: dict[str, Outcome]) -> str:
    """Return a case's description and the failures of engines, collapsed."""
    facts = [
        ["expected", text(case.expected)],
        ["reference", text(case.reference)],
        ["bound", text(case.bound)],
    ]
    facts += [
        [text(name), f"{text(outcome.words)}: {text(outcome.said)}"]
        for name, outcome in row.items()
        if outcome.mark not in (Mark.PASS, Mark.CANNOT)
    ]
    return (
        f'<details id="case-{case.name}"><summary><b>{text(case.name)}</b>: {text(case.hard)}'
        f"</summary>{table(['', ''], facts)}</details>\n"
    )
