"""The scoreboard: verdicts of `twolink conform --json` on many engines, read back and merged."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from twolink.conformance.convergence import Convergence, Curve, Limit
from twolink.conformance.diagnosis import SENTENCES
from twolink.conformance.results import TestResult, rows
from twolink.engines.marks import Mark
from twolink.engines.messages import About, Number
from twolink.errors import FileError, ParameterError
from twolink.files import read_bytes
from twolink.text import one_line, quoted

REFERENCE = (
    "twolink is the reference and no engine of this board: its own proof is in docs/derivation.md"
    " (two derivations), models/references (motions with 60 digits and enclosures) and"
    " tests/campaign."
)
"""Why the library is not on its own board."""

# The size (bytes) of the longest verdict: some thousand tests with their outputs.
_LARGEST = 2**28


class _Part(BaseModel):
    """A part of a verdict's document; keys that the board does not need are ignored."""

    model_config = ConfigDict(frozen=True, strict=True, extra="ignore")


class _Curve(_Part):
    """A test's `convergence`."""

    parameter: Literal["step", "tolerance"]
    settings: tuple[Number, ...]
    errors: tuple[Number, ...]
    limit: str
    order: Number
    limit_error: Number

    def curve(self) -> Curve:
        """Return the curve. Raises `ValueError` unless each setting has an error."""
        if not self.settings or len(self.settings) != len(self.errors):
            raise ValueError("convergence must have an error for each setting")
        verdict = Convergence(Limit(self.limit), self.order, self.errors, self.limit_error)
        return Curve(self.parameter, self.settings, verdict)


class _Test(_Part):
    """One entry of a document's `results`."""

    id: str
    suite: str
    quantity: str
    flags: tuple[str, ...]
    mark: str
    factor: Number
    digits: Number
    cause: str
    said: str
    expected: str
    unexpected: bool
    convergence: _Curve | None = None

    def result(self) -> TestResult:
        """Return the outcome of the test."""
        own = {name: getattr(self, name) for name in type(self).model_fields}
        curve = own.pop("convergence")
        own |= {"group": self.id.rpartition("/")[0], "mark": Mark(self.mark)}
        return TestResult(**own, curve=None if curve is None else curve.curve())


class _Limits(_Part):
    """Limits of each answer (s) and of the engine's memory (bytes)."""

    seconds: Number
    memory: int


class _Document(_Part):
    """The document of `twolink.conformance.report.document`."""

    protocol: int
    vectors: str
    engine: About
    attachment: str
    suites: tuple[str, ...]
    limits: _Limits
    verdict: str
    agrees: bool
    results: tuple[_Test, ...]


@dataclass(frozen=True)
class Entry:
    """One engine on the board: its capabilities, the settings of its run, and its results."""

    engine: About
    attachment: str
    seconds: float
    memory: int
    verdict: str
    results: tuple[TestResult, ...]

    @property
    def title(self) -> str:
        """Name and version."""
        return f"{self.engine.name} {self.engine.version}".strip()

    @property
    def failed(self) -> tuple[TestResult, ...]:
        """The tests that were not passed."""
        return tuple(result for result in self.results if not result.passed)

    def of(self, suite: str) -> tuple[TestResult, ...]:
        """Return the results of a suite."""
        return tuple(result for result in self.results if result.suite == suite)


@dataclass(frozen=True)
class Scoreboard:
    """Engines on the same vectors, those with the largest share of passed tests first."""

    vectors: str
    suites: tuple[str, ...]
    entries: tuple[Entry, ...]


@dataclass(frozen=True)
class Tally:
    """Passed tests, those put to the engine, the other marks, and the worst correct digits.

    `digits` is None where no answer has digits.
    """

    passed: int
    put: int
    others: tuple[tuple[Mark, int], ...]
    digits: float | None

    @property
    def share(self) -> float:
        """The share of passed tests, 0 if none was put."""
        return self.passed / self.put if self.put else 0.0


def tally(results: Iterable[TestResult]) -> Tally:
    """Return the counts of results."""
    found = tuple(results)
    marks = Counter(result.mark for result in found)
    digits = [result.digits for result in found if not math.isnan(result.digits)]
    others = tuple((mark, marks[mark]) for mark in Mark if marks[mark] and mark not in _QUIET)
    return Tally(
        passed=marks[Mark.PASS],
        put=len(found) - marks[Mark.CANNOT],
        others=others,
        digits=min(digits) if digits else None,
    )


_QUIET = (Mark.PASS, Mark.CANNOT)


def read_entry(path: Path) -> tuple[str, Entry]:
    """Return the release of the vectors, and the engine, of a verdict's file.

    Raises `ParameterError` for a file that `twolink conform --json` did not write.
    """
    name = one_line(path, 300)
    try:
        found = _Document.model_validate_json(read_bytes(path, _LARGEST))
        results = tuple(test.result() for test in found.results)
    except FileError as error:
        raise ParameterError(f"{name}: {one_line(error, 300)}") from error
    except ValidationError as error:
        fault = error.errors()[0]
        place = ".".join(str(part) for part in fault["loc"]) or "its content"
        said = f"{place}: {one_line(fault['msg'], 120)}"
        raise ParameterError(
            f"{name} must be a verdict of twolink conform --json; {said}"
        ) from error
    except ValueError as error:
        raise ParameterError(
            f"{name} must be a verdict of twolink conform --json; {one_line(error, 120)}"
        ) from error
    limits = found.limits
    entry = Entry(
        found.engine, found.attachment, limits.seconds, limits.memory, found.verdict, results
    )
    return found.vectors, entry


def read_scoreboard(paths: Sequence[Path]) -> Scoreboard:
    """Return the scoreboard of verdicts' files.

    Raises `ParameterError` for files that are no verdicts, for verdicts on other vectors than the
    first file's, and for two of one engine, version and attachment.
    """
    entries: list[Entry] = []
    releases: list[str] = []
    for path in paths:
        release, entry = read_entry(path)
        if releases and release != releases[0]:
            raise ParameterError(
                f"all verdicts must be on the same vectors; {one_line(paths[0], 200)} is on"
                f" {quoted(releases[0])}, {one_line(path, 200)} on {quoted(release)}"
            )
        if any(_same(entry, other) for other in entries):
            raise ParameterError(
                f"an engine must be there once; {one_line(path, 200)} is a second verdict on"
                f" {entry.title}"
            )
        releases.append(release)
        entries.append(entry)
    if not entries:
        raise ParameterError("a scoreboard must have a verdict or more; got none")
    suites = dict.fromkeys(result.suite for entry in entries for result in entry.results)
    ordered = sorted(
        entries, key=lambda entry: (-tally(entry.results).share, entry.title.casefold())
    )
    return Scoreboard(releases[0], tuple(suites), tuple(ordered))


def _same(one: Entry, other: Entry) -> bool:
    return (one.title, one.attachment) == (other.title, other.attachment)


def document(board: Scoreboard) -> dict[str, Any]:
    """Return a scoreboard as JSON-compatible data."""
    return {
        "vectors": board.vectors,
        "reference": REFERENCE,
        "engines": [_of_entry(entry, board.suites) for entry in board.entries],
    }


def _of_entry(entry: Entry, suites: Iterable[str]) -> dict[str, Any]:
    quantities = rows(entry.results)
    return {
        "engine": json.loads(entry.engine.model_dump_json()),
        "attachment": entry.attachment,
        "limits": {"seconds": entry.seconds, "memory": entry.memory},
        "verdict": entry.verdict,
        "suites": {
            suite: {
                **_counts(entry.of(suite)),
                "quantities": {
                    quantity: _counts(results)
                    for (own, quantity), results in quantities.items()
                    if own == suite
                },
            }
            for suite in suites
        },
        "failures": [
            {
                "id": result.id,
                "mark": result.verdict,
                "cause": result.cause,
                "sentence": SENTENCES.get(result.cause, ""),
                "said": result.said,
            }
            for result in entry.failed
        ],
    }


def _counts(results: Iterable[TestResult]) -> dict[str, Any]:
    found = tally(results)
    return {
        "passed": found.passed,
        "put": found.put,
        "marks": {mark.value: count for mark, count in found.others},
        "digits": found.digits,
    }
