"""Runs hard cases, each in each column, and marks what comes of it."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Iterable
from time import perf_counter
from typing import TYPE_CHECKING

from twolink.errors import EngineError, TwolinkError
from twolink.hardcases.record import FORMULATIONS, Case, Column, Finding, LateError, Mark, Outcome
from twolink.provenance import package_versions, this_machine

if TYPE_CHECKING:
    from twolink.engines.isolated import Outcome as Isolated

OURS = tuple(Column(name) for name in FORMULATIONS)


def columns(names: Iterable[str] | None = None) -> tuple[Column, ...]:
    """Return this library's columns and those of the peers that are installed, or those named.

    The beginning of a word will do where one name has such a word. Raises `EngineError` for a name
    that is none, or of a peer that is not installed.
    """
    from twolink.engines.peers import PEERS

    peers = tuple(Column(peer.name, peer) for peer in PEERS)
    if names is None:
        return (*OURS, *(column for column in peers if column.peer and not column.peer.missing()))
    known = {column.name.casefold(): column for column in (*OURS, *peers)}
    found = []
    for name in names:
        wanted = name.casefold()
        begins = re.compile(rf"\b{re.escape(wanted)}")
        alike = [column for whole, column in known.items() if begins.search(whole)]
        column = known.get(wanted) or (alike[0] if len(alike) == 1 else None)
        if column is None:
            allowed = ", ".join(column.name for column in known.values())
            raise EngineError(f"engine is '{name}'; allowed are {allowed}")
        missing = column.peer.missing() if column.peer else None
        if missing:
            raise EngineError(missing)
        found.append(column)
    return tuple(found)


def outcome(case: Case, column: Column) -> Outcome:
    """Return what becomes of a case in a column: never an exception, but for an interruption."""
    return _of_a_peer(case, column) if column.peer else _of_ours(case, column.name)


def scoreboard(
    cases: Iterable[Case],
    columns: Iterable[Column],
    progress: Callable[[Case, Column], None] | None = None,
) -> dict[str, dict[str, Outcome]]:
    """Return the outcome of each case (by name) in each column (by name)."""
    board: dict[str, dict[str, Outcome]] = {}
    chosen = tuple(columns)
    for case in cases:
        board[case.name] = {}
        for column in chosen:
            if progress is not None:
                progress(case, column)
            board[case.name][column.name] = outcome(case, column)
    return board


def _of_ours(case: Case, formulation: str) -> Outcome:
    """Return what becomes of a case in one of this library's formulations, in this process."""
    begin = perf_counter()

    def check() -> None:
        if perf_counter() - begin > case.seconds:
            raise LateError(f"stopped after {case.seconds:g} s")

    call = f"{case.name} with {formulation}"
    try:
        with warnings.catch_warnings():
            # What would be a warning on a user's screen counts as a failure of ours.
            warnings.simplefilter("error")
            finding = case.trial.ours(formulation, check)
    except LateError as error:
        return Outcome(Mark.HANG, None, perf_counter() - begin, str(error), call)
    except TwolinkError as error:
        return Outcome(Mark.REFUSED, None, perf_counter() - begin, str(error), call)
    except Exception as error:
        said = f"{type(error).__name__}: {error}"
        return Outcome(Mark.CRASH, None, perf_counter() - begin, said, call)
    return Outcome.of(finding, perf_counter() - begin, call)


def _of_a_peer(case: Case, column: Column) -> Outcome:
    """Return what becomes of a case in a peer's hands, in a process of its own."""
    assert column.peer is not None
    reason = case.trial.cannot(column.peer)
    if reason is not None:
        return Outcome(Mark.CANNOT, said=reason)
    finding, done, call = case.trial.peers(column.peer, case.seconds)
    if finding is not None:
        return Outcome.of(finding, done.seconds, call, _printed(done))
    mark = _MARKS[done.kind]
    return Outcome(mark, None, done.seconds, f"{done.kind}: {done.said}", call, _printed(done))


_MARKS = {
    "refused": Mark.REFUSED,
    "crash": Mark.CRASH,
    "out of memory": Mark.CRASH,
    "hang": Mark.HANG,
}


def _printed(done: Isolated) -> str:
    return "\n".join([*done.warnings, done.output]).strip()


def document(board: dict[str, dict[str, Outcome]], cases: Iterable[Case]) -> dict[str, object]:
    """Return a scoreboard and its cases as dicts, lists, numbers and words, and where it ran."""
    described = {
        case.name: {
            "group": case.group,
            "hard": case.hard,
            "expected": case.expected,
            "reference": case.reference,
            "bound": case.bound,
        }
        for case in cases
    }
    return {
        "versions": {**package_versions("heyoka", "numpy", "scipy"), **_peers_of(board)},
        "machine": this_machine(),
        "cases": {
            name: {
                **described[name],
                "outcomes": {
                    column: {
                        "mark": found.mark.value,
                        "factor": found.factor,
                        "seconds": found.seconds,
                        "said": found.said,
                        "call": found.call,
                        "output": found.output,
                    }
                    for column, found in row.items()
                },
            }
            for name, row in board.items()
        },
    }


def _peers_of(board: dict[str, dict[str, Outcome]]) -> dict[str, str]:
    """Return the versions of the peers that a scoreboard has columns of."""
    from twolink.engines.peers import PEERS

    tried = {name for row in board.values() for name in row}
    return {peer.name: peer.version() for peer in PEERS if peer.name in tried}


def failed_by_us(board: dict[str, dict[str, Outcome]]) -> list[tuple[str, str]]:
    """Return the cases, with the formulation, that this library does not pass."""
    return [
        (name, column)
        for name, row in board.items()
        for column, found in row.items()
        if column in FORMULATIONS and found.mark is not Mark.PASS
    ]


def counts(board: dict[str, dict[str, Outcome]], column: str) -> dict[Mark, int]:
    """Return how often each mark stands in a column, in the order of `Mark`, without zeros."""
    marks = [row[column].mark for row in board.values()]
    return {mark: marks.count(mark) for mark in Mark if mark in marks}


def verdict(board: dict[str, dict[str, Outcome]]) -> tuple[bool, str]:
    """Return whether this library passes all that it was tried on, and that in a sentence."""
    tried = [name for name in FORMULATIONS if any(name in row for row in board.values())]
    failed = {name for name, _ in failed_by_us(board)}
    cases = f"{len(board)} hard case{'' if len(board) == 1 else 's'}"
    if not tried:
        return True, f"This library was not tried on the {cases}."
    if failed:
        return False, f"This library fails {len(failed)} of {cases}: {', '.join(sorted(failed))}."
    return True, f"This library passes {cases} of {len(board)}, with {', '.join(tried)}."


def finding_of(offence: str | None) -> Finding:
    """Return a finding of what must hold whatever the accuracy: none, or broken."""
    return Finding(0.0) if offence is None else Finding(math.inf, said=offence)
