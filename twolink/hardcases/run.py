"""Run hard cases in each column and mark the outcomes."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable
from time import perf_counter, process_time
from typing import Any

from twolink.engines.attach import attach
from twolink.engines.contract import Engine
from twolink.engines.faults import EngineFault
from twolink.engines.marks import Mark, Result
from twolink.engines.registry import SIMULATORS, by_name
from twolink.engines.remote_engine import RemoteEngine
from twolink.engines.session import Session
from twolink.environment import package_versions, this_machine
from twolink.errors import EngineError, TwolinkError
from twolink.hardcases.record import Case, Column, LateError, Outcome
from twolink.names import EquationsName
from twolink.simulation.smooth.equations import EQUATIONS, equations_named

OURS = tuple(Column(name) for name in EQUATIONS)


# A case that works for less than its limit may wait for this multiple of it.
_PATIENCE = 20


def columns(names: Iterable[str] | None = None) -> tuple[Column, ...]:
    """Return the named columns; by default this library's and those of installed engines.

    A name may be abbreviated to the beginning of one of its words if that is unique. Raises
    `EngineError` for an unknown name, or an engine that is not installed.
    """
    engines = tuple(Column(engine.name, engine) for engine in SIMULATORS)
    if names is None:
        return (
            *OURS,
            *(column for column in engines if column.engine and not column.engine.missing()),
        )
    known = {column.name: column for column in (*OURS, *engines)}
    found = []
    for name in names:
        column = by_name(name, known)
        if column.engine:
            column.engine.check_installed()
        found.append(column)
    return tuple(found)


def outcome(case: Case, column: Column) -> Outcome:
    """Return the outcome of a case in a column; exceptions other than interrupts are outcomes."""
    if column.engine:
        return _of_engine(case, column.engine)
    return _of_ours(case, equations_named(column.name))


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


def _of_ours(case: Case, formulation: EquationsName) -> Outcome:
    """Return the outcome of a case with one of this library's formulations, in this process.

    The limit is one of processor time: other work of the machine does not make a case fail.
    """
    begin, working = perf_counter(), process_time()

    def check() -> None:
        if process_time() - working > case.seconds:
            raise LateError(f"stopped after {case.seconds:g} s of processor time")
        if perf_counter() - begin > _PATIENCE * case.seconds:
            raise LateError(f"stopped after {_PATIENCE * case.seconds:g} s, most of them waiting")

    call = f"{case.name} with {formulation}"
    try:
        with warnings.catch_warnings():
            # A warning of this library counts as a failure.
            warnings.simplefilter("error")
            result = case.trial.ours(formulation, check)
    except LateError as error:
        return Outcome(Mark.HANG, None, perf_counter() - begin, str(error), call)
    except TwolinkError as error:
        return Outcome(Mark.REFUSED, None, perf_counter() - begin, str(error), call)
    except Exception as error:
        said = f"{type(error).__name__}: {error}"
        return Outcome(Mark.CRASH, None, perf_counter() - begin, said, call)
    return Outcome.of(result, perf_counter() - begin, call)


def _of_engine(case: Case, engine: Engine) -> Outcome:
    """Return the outcome of a case with an engine, in a process of its own."""
    if reason := case.trial.unsupported(engine):
        return Outcome(Mark.CANNOT, said=reason)
    with Session(attach(engine.name), case.seconds) as session:
        return of_engine(case, RemoteEngine(session, case.name))


def of_engine(case: Case, engine: RemoteEngine) -> Outcome:
    """Return the outcome of a case with an engine; its errors and faults are outcomes."""
    if reason := case.trial.unsupported(engine):
        return Outcome(Mark.CANNOT, said=reason)
    call, begin = case.trial.call(engine), perf_counter()
    try:
        result = case.trial.external(engine)
    except (EngineError, EngineFault) as error:
        mark = Mark.of(error)
        if mark is Mark.CANNOT:
            return Outcome(mark, said=str(error))
        said = f"refused: {error}" if mark is Mark.REFUSED else str(error)
        notes = [getattr(error, "output", ""), *getattr(error, "__notes__", ())]
        warnings = "\n".join([*engine.captured_warnings, *notes]).strip()
        return Outcome(mark, None, perf_counter() - begin, said, call, warnings)
    return Outcome.of(result, perf_counter() - begin, call, "\n".join(engine.captured_warnings))


def document(board: dict[str, dict[str, Outcome]], cases: Iterable[Case]) -> dict[str, object]:
    """Return a scoreboard, its cases and its environment as JSON-compatible data."""
    about = ("group", "hard", "expected", "reference", "bound")
    described = {case.name: {key: getattr(case, key) for key in about} for case in cases}

    def outcomes(row: dict[str, Outcome]) -> dict[str, dict[str, Any]]:
        return {name: {**vars(found), "mark": found.mark.value} for name, found in row.items()}

    return {
        "versions": {**package_versions("heyoka", "numpy", "scipy"), **_engine_versions(board)},
        "machine": this_machine(),
        "cases": {
            name: {**described[name], "outcomes": outcomes(row)} for name, row in board.items()
        },
    }


def _engine_versions(board: dict[str, dict[str, Outcome]]) -> dict[str, str]:
    """Return the versions of the external engines in a scoreboard."""
    tried = {name for row in board.values() for name in row}
    return {engine.name: engine.version for engine in SIMULATORS if engine.name in tried}


def failed_by_us(board: dict[str, dict[str, Outcome]]) -> list[tuple[str, str]]:
    """Return the cases, with their formulations, that this library fails."""
    return [
        (name, column)
        for name, row in board.items()
        for column, found in row.items()
        if column in EQUATIONS and found.mark is not Mark.PASS
    ]


def counts(board: dict[str, dict[str, Outcome]], column: str) -> dict[Mark, int]:
    """Return the number of each mark in a column, in the order of `Mark`, without zeros."""
    marks = [row[column].mark for row in board.values()]
    return {mark: marks.count(mark) for mark in Mark if mark in marks}


def verdict(board: dict[str, dict[str, Outcome]]) -> tuple[bool, str]:
    """Return whether this library passes all its cases, and a sentence on it."""
    tried = [name for name in EQUATIONS if any(name in row for row in board.values())]
    failed = {name for name, _ in failed_by_us(board)}
    cases = f"{len(board)} hard case{'' if len(board) == 1 else 's'}"
    if not tried:
        return True, f"This library was not tried on the {cases}."
    if failed:
        return False, f"This library fails {len(failed)} of {cases}: {', '.join(sorted(failed))}."
    return True, f"This library passes {cases} of {len(board)}, with {', '.join(tried)}."


def result_of(offence: str | None) -> Result:
    """Return the result of an exact property: satisfied (None) or violated."""
    return Result(0.0) if offence is None else Result(math.inf, said=offence)
