"""A plugin for pytest: `pytest --twolink-engine my.module:Engine` has a test for each vector.

The engine runs once, in a child process, when the first of the tests runs.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from twolink.conformance.results import TestResult


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options of the plugin."""
    group = parser.getgroup("twolink", "conformance of dynamics engines")
    group.addoption(
        "--twolink-engine",
        metavar="ENGINE",
        help="Check this engine: module:object, a registered name, or 'cmd: COMMAND'.",
    )
    group.addoption(
        "--twolink-suite",
        action="append",
        metavar="SUITE",
        help="Only this suite (repeatable). Default: all.",
    )
    group.addoption("--twolink-expect", metavar="FILE", help="A TOML file of known failures.")
    group.addoption(
        "--twolink-seconds",
        type=float,
        default=60.0,
        metavar="SECONDS",
        help="Time limit of each answer.",
    )


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(session: pytest.Session, items: list[pytest.Item]) -> None:
    """Add a test for each vector. Raises `pytest.UsageError` for bad options."""
    if session.config.getoption("--twolink-engine") is None:
        return
    from twolink.errors import TwolinkError

    try:
        items.extend(Conformance.from_parent(session, name="twolink").collect())
    except TwolinkError as error:
        raise pytest.UsageError(str(error)) from error


class Conformance(pytest.Collector):
    """The tests of one engine, and their results."""

    def collect(self) -> Iterator[pytest.Item]:
        """Return a test for each vector."""
        from twolink.conformance.suites import items, tests_of
        from twolink.engines.attach import attach

        self._engine: str = self.config.getoption("--twolink-engine")
        self._start = attach(self._engine)
        self._suites = items(self.config.getoption("--twolink-suite"))
        for suite, found in self._suites.items():
            for item in found:
                for name in tests_of(suite, item):
                    yield ConformanceTest.from_parent(self, name=name)

    @cached_property
    def results(self) -> dict[str, TestResult]:
        """The results of the engine by the tests' ids. Raises `TwolinkError`."""
        from twolink.conformance.expectations import read_expectations, with_expectations
        from twolink.conformance.runner import conform

        expect = self.config.getoption("--twolink-expect")
        known = () if expect is None else read_expectations(Path(expect))
        seconds: float = self.config.getoption("--twolink-seconds")
        report = conform(self._engine, self._start, self._suites, seconds=seconds)
        return {result.id: result for result in with_expectations(report, known).results}


class NonconformingError(Exception):
    """An engine disagrees with a vector."""


class ConformanceTest(pytest.Item):
    """The test of one vector."""

    def runtest(self) -> None:
        """Raise `NonconformingError` unless the engine agrees."""
        from twolink.engines.marks import Mark

        assert isinstance(self.parent, Conformance)
        # A motion has a result for each method of the engine, a quantity for each formulation.
        results = [
            each
            for name, each in self.parent.results.items()
            if name == self.name or name.startswith(f"{self.name}/")
        ]
        if not results:
            pytest.skip("the model was not loaded")
        result = next((each for each in results if not each.passed), results[0])
        if result.expected:
            pytest.xfail(result.expected)
        if result.mark is Mark.CANNOT:
            pytest.skip(result.said)
        if not result.passed:
            raise NonconformingError(
                "\n".join([f"{result.verdict}: {result.reason}", result.said, result.output])
            )

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """Return the sentence of a disagreement, without a traceback."""
        from twolink.errors import TwolinkError

        if isinstance(excinfo.value, (NonconformingError, TwolinkError)):
            return str(excinfo.value).strip()
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[str, None, str]:
        """Return where the test is, for the summary."""
        return "twolink", None, self.name
