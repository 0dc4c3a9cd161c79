"""Assertions for the tests of an engine.

from twolink.testing import assert_conforms

def test_my_engine():
    assert_conforms(MyEngine())
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twolink.conformance.contract import Engine
    from twolink.conformance.results import Report
    from twolink.engines.transport import Transport

# Failures in the message of an assertion; the report has all.
_SHOWN = 10


def assert_conforms(
    engine: Engine | type[Engine] | str,
    *,
    suites: Iterable[str] | None = None,
    expect: str | PathLike[str] | None = None,
    seconds: float = 60.0,
) -> Report:
    """Raise `AssertionError` unless an engine agrees with all vectors; return the report.

    `engine` is an engine or its class, which runs in this process, or a name as for `twolink
    conform`, which runs in a child with a limit of `seconds` for each answer. `suites` are all by
    default; `expect` is a file of known failures. Raises `EngineError` for an engine that does not
    start, and `ParameterError` for unknown suites and bad files.
    """
    from twolink.conformance.expectations import read_expectations, with_expectations
    from twolink.conformance.runner import conform
    from twolink.conformance.suites import items

    name, start = _attached(engine)
    known = () if expect is None else read_expectations(Path(expect))
    report = with_expectations(conform(name, start, items(suites), seconds=seconds), known)
    if not report.agrees:
        raise AssertionError(_summary(report))
    return report


def _attached(engine: Engine | type[Engine] | str) -> tuple[str, Callable[[], Transport]]:
    from twolink.engines.attach import attach
    from twolink.engines.in_process import InProcess

    if isinstance(engine, str):
        return engine, attach(engine)
    made = engine() if isinstance(engine, type) else engine
    return type(made).__qualname__, lambda: InProcess(made)


def _summary(report: Report) -> str:
    lines = [report.sentence]
    for result in report.failed[:_SHOWN]:
        lines.append(f"  {result.id}: {result.verdict}; {result.reason}")
    if len(report.failed) > _SHOWN:
        lines.append(f"  and {len(report.failed) - _SHOWN} more")
    return "\n".join(lines)
