"""Known failures of an engine, in a file that its authors keep. They are strict.

    [[expect]]
    test = "import/vector-over-two-lines/read"   # an id, or a pattern with *
    versions = ">=4, <5"
    reason = "vectors are split at spaces alone"
    link = "https://github.com/…/issues/1"

    [[expect]]
    flag = "Mimic"
    reason = "mimics of fixed joints are refused"

Each test that is named must fail: one that passes is reported as a failure.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Iterable
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Self

from pydantic import Field, ValidationError, model_validator

from twolink import toml
from twolink.conformance.results import Report, TestResult
from twolink.engines.marks import Mark
from twolink.engines.messages import Message
from twolink.errors import FileError, ParameterError
from twolink.text import one_line, quoted

_LARGEST = 2**20

_COMPARED = {
    ">=": operator.ge,
    "<=": operator.le,
    "==": operator.eq,
    "!=": operator.ne,
    ">": operator.gt,
    "<": operator.lt,
}
_CONDITION = re.compile(r"\s*(>=|<=|==|!=|>|<)\s*(\d+(?:\.\d+)*)\s*")


class Expectation(Message):
    """Tests that are known to fail: by id or pattern, or by flag, in a range of versions."""

    test: str = ""
    flag: str = ""
    versions: str = ""
    reason: str = Field(min_length=1)
    link: str = ""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if bool(self.test) == bool(self.flag):
            raise ValueError("it must have one of test and flag")
        if self.versions and not all(map(_CONDITION.fullmatch, self.versions.split(","))):
            raise ValueError(f"versions must be such as '>=1.8, <2'; got {self.versions!r}")
        return self

    def is_about(self, result: TestResult, version: str) -> bool:
        """Return whether a test of an engine's version is expected to fail."""
        named = fnmatchcase(result.id, self.test) if self.test else self.flag in result.flags
        return named and self.holds_for(version)

    def holds_for(self, version: str) -> bool:
        """Return whether a version is in the range; numbers after the first other word are not."""
        numbers = _numbers(version)
        for condition in filter(None, self.versions.split(",")):
            match = _CONDITION.fullmatch(condition)
            assert match is not None
            if not _COMPARED[match[1]](*_padded(numbers, _numbers(match[2]))):
                return False
        return True


def read_expectations(path: Path) -> tuple[Expectation, ...]:
    """Return the expectations of a TOML file. Raises `ParameterError` for anything else."""
    name = one_line(path, 300)
    try:
        table = toml.tables(toml.read_text(path, _LARGEST), "a file of expectations")
    except FileError as error:
        raise ParameterError(f"{name}: {one_line(error, 300)}") from error
    entries = table.pop("expect", [])
    if table or not isinstance(entries, list):
        raise ParameterError(f"{name}: it must have tables [[expect]] only; got {quoted(table)}")
    return tuple(_expectation(name, number, entry) for number, entry in enumerate(entries, 1))


def with_expectations(report: Report, expectations: Iterable[Expectation]) -> Report:
    """Return a report in which known failures count as passes, and their passes as failures.

    Raises `ParameterError` for an expectation that names no test of the suites that were run.
    """
    version, results = report.engine.version, list(report.results)
    for expectation in expectations:
        about = [
            index for index, result in enumerate(results) if expectation.is_about(result, version)
        ]
        if not about and expectation.holds_for(version) and _was_run(expectation, report):
            named = expectation.test or f"flag {expectation.flag}"
            raise ParameterError(f"an expectation must be about a test; got {named}")
        for index in about:
            results[index] = _expected(results[index], expectation)
    return replace(report, results=tuple(results))


def _expected(result: TestResult, expectation: Expectation) -> TestResult:
    if result.mark is Mark.PASS:
        return replace(
            result,
            unexpected=True,
            said=f"it passes, and is expected to fail: {expectation.reason}",
        )
    link = f" ({expectation.link})" if expectation.link else ""
    return replace(result, expected=f"{expectation.reason}{link}")


def _was_run(expectation: Expectation, report: Report) -> bool:
    """Return whether the tests that are meant belong to the suites of a report."""
    return bool(expectation.flag) or expectation.test.partition("/")[0] in report.suites


def _expectation(name: str, number: int, entry: Any) -> Expectation:
    try:
        return Expectation.model_validate(entry)
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(str(part) for part in fault["loc"])
        message = fault["msg"].removeprefix("Value error, ")
        said = f"{where}: {message}" if where else message
        raise ParameterError(f"{name}: expect {number}: {said}") from error


def _numbers(version: str) -> tuple[int, ...]:
    match = re.match(r"\D*(\d+(?:\.\d+)*)", version)
    return tuple(map(int, match[1].split("."))) if match else ()


def _padded(one: tuple[int, ...], other: tuple[int, ...]) -> tuple[tuple[int, ...], ...]:
    """Return versions of one length: 1.8 is 1.8.0."""
    length = max(len(one), len(other))
    return tuple(each + (0,) * (length - len(each)) for each in (one, other))
