"""Results of an engine: the outcome of each test, and the verdict on all."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from twolink.conformance.convergence import Curve
from twolink.conformance.diagnosis import SENTENCES
from twolink.engines.faults import EngineFault
from twolink.engines.marks import Mark
from twolink.engines.messages import About
from twolink.errors import EngineError

READ = "read"
"""The quantity of a test of reading: a model is loaded, or refused."""

MOTION = "motion: "
"""The begin of the quantity of a motion, before the name of the method."""

_FINE = (Mark.PASS, Mark.CANNOT)


@dataclass(frozen=True)
class TestResult:
    """The outcome of one test.

    `factor` is the error in units of its bound and `digits` the number of correct digits, NaN where
    there are none. `causes` are names of `twolink.conformance.diagnosis.SENTENCES` that explain a
    wrong answer, `cause` is the one of them that explains most tests, or empty; `said` is the
    reason, in the kit's words or the engine's. `output` is the end of the engine's standard error
    after a fault, `expected` the reason of a known failure; `unexpected` states that the test
    passes and is known to fail. `curve` is that of a motion.
    """

    __test__ = False

    id: str
    suite: str
    group: str
    quantity: str
    flags: tuple[str, ...]
    mark: Mark
    factor: float = math.nan
    digits: float = math.nan
    causes: tuple[str, ...] = ()
    cause: str = ""
    said: str = ""
    warnings: tuple[str, ...] = ()
    output: str = ""
    issue: str = ""
    expected: str = ""
    unexpected: bool = False
    curve: Curve | None = None

    @property
    def passed(self) -> bool:
        """Whether the test passed, was not for this engine, or failed as was expected."""
        return not self.unexpected and (bool(self.expected) or self.mark in _FINE)

    @property
    def verdict(self) -> str:
        """The mark in words, or that of a pass that was not expected."""
        return "unexpected pass" if self.unexpected else self.mark.value

    @property
    def reason(self) -> str:
        """Why the test did not pass, in one sentence."""
        return SENTENCES.get(self.cause, self.said)


@dataclass(frozen=True)
class Report:
    """All results of one engine, with the settings of the run.

    `printed` is the number of warnings that it printed to its standard error while it answered, and
    the first of them; no test is judged by them.
    """

    engine: About
    attachment: str
    suites: tuple[str, ...]
    seconds: float
    memory: int
    results: tuple[TestResult, ...]
    setup: dict[str, str] = field(default_factory=dict)
    printed: tuple[int, str] = (0, "")

    @property
    def compared(self) -> tuple[TestResult, ...]:
        """The tests that were put to the engine and that it did not skip."""
        return tuple(result for result in self.results if result.mark is not Mark.CANNOT)

    @property
    def failed(self) -> tuple[TestResult, ...]:
        """The tests that were not passed."""
        return tuple(result for result in self.results if not result.passed)

    @property
    def is_mute(self) -> bool:
        """Whether the engine skips all questions and motions, and at most reads models."""
        asked = [result.mark for result in self.results if result.quantity != READ]
        return bool(asked) and set(asked) == {Mark.CANNOT}

    @property
    def agrees(self) -> bool:
        """Whether something was compared, and all of it agrees."""
        return bool(self.compared) and not self.failed and not self.is_mute

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        count = len(self.compared)
        if not count or (self.is_mute and not self.failed):
            read = f" beside reading {count} model{'' if count == 1 else 's'}" if count else ""
            return f"{self.engine.name} was not compared: it skips all tests{read}."
        if not self.failed:
            known = sum(bool(result.expected) for result in self.compared)
            but = f" but {known} known failure{'' if known == 1 else 's'}" if known else ""
            return f"{self.engine.name} agrees in all {count} tests{but}."
        return f"{self.engine.name} disagrees in {len(self.failed)} of {count} tests."

    def causes(self) -> dict[str, tuple[TestResult, ...]]:
        """Return the tests that each cause explains, the most frequent cause first."""
        found: dict[str, list[TestResult]] = {}
        for result in self.failed:
            if result.cause:
                found.setdefault(result.cause, []).append(result)
        ordered = sorted(found, key=lambda name: -len(found[name]))
        return {name: tuple(found[name]) for name in ordered}


def without_answer(result: TestResult, error: EngineError | EngineFault) -> TestResult:
    """Return the result of a test to which the engine gave no values."""
    output, link = getattr(error, "output", ""), getattr(error, "link", "")
    return replace(result, mark=Mark.of(error), said=str(error), output=output, issue=link)


def rows(results: Iterable[TestResult]) -> dict[tuple[str, str], tuple[TestResult, ...]]:
    """Return results by suite and quantity, in their order."""
    found: dict[tuple[str, str], list[TestResult]] = {}
    for result in results:
        found.setdefault((result.suite, result.quantity), []).append(result)
    return {key: tuple(each) for key, each in found.items()}
