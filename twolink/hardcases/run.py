"""Run hard cases in each column and mark the outcomes."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable
from time import perf_counter, process_time
from typing import TYPE_CHECKING

from twolink.environment import package_versions, this_machine
from twolink.errors import TwolinkError
from twolink.formulations import EquationsName
from twolink.hardcases.record import Case, Column, LateError, Mark, Outcome, Result, Subject
from twolink.hardcases.sandboxed import Sandboxed
from twolink.simulation.smooth.equations import EQUATIONS, equations_named

if TYPE_CHECKING:
    from twolink.engines.sandbox import TaskResult

OURS = tuple(Column(name) for name in EQUATIONS)


# A case that works for less than its limit may wait for this multiple of it.
_PATIENCE = 20


def columns(names: Iterable[str] | None = None) -> tuple[Column, ...]:
    """Return the named columns; by default this library's and those of installed engines.

    A name may be abbreviated to the beginning of one of its words if that is unique. Raises
    `EngineError` for an unknown name, or an engine that is not installed.
    """
    from twolink.engines.registry import SIMULATORS, by_name

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
    return (
        of_subject(case, Sandboxed(column.engine))
        if column.engine
        else _of_ours(case, equations_named(column.name))
    )


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


def of_subject(case: Case, subject: Subject) -> Outcome:
    """Return the outcome of a case with an external engine."""
    reason = case.trial.unsupported(subject)
    if reason is not None:
        return Outcome(Mark.CANNOT, said=reason)
    result, done, call = case.trial.external(subject, case.seconds)
    if result is not None:
        return Outcome.of(result, done.seconds, call, _printed(done))
    mark = _MARKS[done.kind]
    return Outcome(mark, None, done.seconds, f"{done.kind}: {done.said}", call, _printed(done))


_MARKS = {
    "refused": Mark.REFUSED,
    "crash": Mark.CRASH,
    "out of memory": Mark.CRASH,
    "hang": Mark.HANG,
}


def _printed(done: TaskResult) -> str:
    return "\n".join([*done.warnings, done.output]).strip()


def document(board: dict[str, dict[str, Outcome]], cases: Iterable[Case]) -> dict[str, object]:
    """Return a scoreboard, its cases and its environment as JSON-compatible data."""
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
        "versions": {**package_versions("heyoka", "numpy", "scipy"), **_engine_versions(board)},
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


def _engine_versions(board: dict[str, dict[str, Outcome]]) -> dict[str, str]:
    """Return the versions of the external engines in a scoreboard."""
    from twolink.engines.registry import SIMULATORS

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
