"""The report's scoreboard: what becomes of the hard cases in each engine's hands."""

from __future__ import annotations

from collections.abc import Sequence

from twolink.hardcases import Case, Column, Mark, Outcome
from twolink.hardcases.run import counts, verdict
from viz.report.page import Section, heading, paragraph, table, text

Board = dict[str, dict[str, Outcome]]

# A mark's short form, so that a dozen columns fit on a page, its class, and what it means.
_SHORT = {
    Mark.PASS: ("✓", "good", "within the bound"),
    Mark.MISSED: ("×", "soft", "beyond the bound by this factor, or told as such by the engine"),
    Mark.SILENT: (
        "silent",
        "bad",
        "silently wrong: finite, without a warning, and beyond the bound more than tenfold",
    ),
    Mark.REFUSED: ("refused", "soft", "the engine says that it will not"),
    Mark.CRASH: ("crash", "bad", "the engine's process ended, or ran out of memory"),
    Mark.HANG: ("hang", "bad", "no answer in the time that all are given"),
    Mark.CANNOT: ("·", "soft", "the engine has no such effect, and was not tried"),
}


def hard_cases(cases: Sequence[Case], columns: Sequence[Column], board: Board) -> Section:
    """Return the scoreboard with its verdict, and what each case is about."""
    passed, sentence = verdict(board)
    groups = dict.fromkeys(case.group for case in cases)
    body = (
        paragraph(sentence, "verdict" if passed else "verdict bad")
        + paragraph("Peers run in processes of their own, by their best method at a fine setting.")
        + _key()
        + _summary(columns, board)
        + "".join(_group(group, cases, columns, board) for group in groups)
        + heading("What each case is about, and what failed")
        + "".join(_about(case, board[case.name]) for case in cases)
    )
    return Section("Hard cases", body)


def _key() -> str:
    told = "; ".join(f"{short} {meaning}" for short, _, meaning in _SHORT.values())
    return paragraph(f"{told}.", "note")


def _summary(columns: Sequence[Column], board: Board) -> str:
    """Return how often each engine met each fate."""
    rows = []
    for column in columns:
        found = counts(board, column.name)
        rows.append([text(column.name), *(str(found.get(mark, "")) for mark in Mark)])
    heads = ["", *(mark.value for mark in Mark)]
    return table(heads, rows, numbers=range(1, len(heads)), caption="How often")


def _group(group: str, cases: Sequence[Case], columns: Sequence[Column], board: Board) -> str:
    rows = [
        [
            f'<a href="#case-{case.name}">{text(case.name)}</a>',
            *(_cell(board[case.name][column.name]) for column in columns),
        ]
        for case in cases
        if case.group == group
    ]
    return table(["", *(text(column.name) for column in columns)], rows, caption=group.capitalize())


def _cell(outcome: Outcome) -> str:
    short, kind, _ = _SHORT[outcome.mark]
    missed = outcome.mark is Mark.MISSED
    words = outcome.words.removeprefix("missed ") if missed else short
    return f'<span class="{kind}">{text(words)}</span>'


def _about(case: Case, row: dict[str, Outcome]) -> str:
    """Return a case's record, and what the engines that failed said, folded away."""
    facts = [
        ["expected", text(case.expected)],
        ["known from", text(case.reference)],
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
