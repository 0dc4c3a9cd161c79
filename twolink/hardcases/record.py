"""Data of hard cases: the case, its trial, and the outcome for an engine."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from twolink.engines.marks import Mark, Result
from twolink.errors import TwolinkError
from twolink.names import EquationsName

if TYPE_CHECKING:
    from twolink.engines.contract import Engine
    from twolink.engines.remote_engine import RemoteEngine

GROUPS = ("evaluation", "smooth", "friction", "contact", "input")


@dataclass(frozen=True)
class Outcome:
    """A cell of the scoreboard: mark, error over bound if there is one, and reason.

    `call` is the failed call, and `output` its output or exception.
    """

    mark: Mark
    factor: float | None = None
    seconds: float = 0.0
    said: str = ""
    call: str = ""
    output: str = ""

    @classmethod
    def of(cls, result: Result, seconds: float, call: str = "", output: str = "") -> Outcome:
        """Return the outcome of an answer that was compared with the reference."""
        failed = result.mark is not Mark.PASS
        return cls(
            result.mark,
            result.factor,
            seconds,
            result.said,
            call if failed else "",
            output if failed else "",
        )

    @property
    def words(self) -> str:
        """The outcome in words: the mark, with the error over the bound."""
        return " ".join([self.mark.value, self._times]).strip()

    @property
    def short(self) -> str:
        """The abbreviated text of the cell."""
        return self._times or self.mark.short

    @property
    def _times(self) -> str:
        """The formatted error over the bound, if meaningful."""
        if self.mark is not Mark.MISSED or self.factor is None:
            return ""
        if not math.isfinite(self.factor):
            return "× ∞"
        return f"× {self.factor:#.3g}" if self.factor < 1000 else f"× {self.factor:.0e}"


class LateError(TwolinkError):
    """The time limit of a case is exceeded."""


class Trial(Protocol):
    """The procedure of a case, for this library and for external engines."""

    def ours(self, formulation: EquationsName, check: Callable[[], None]) -> Result:
        """Return the result for one of this library's formulations.

        `check` is called repeatedly and raises `LateError` at the time limit. The caller handles
        exceptions of this library.
        """

    def unsupported(self, engine: Engine) -> str | None:
        """Return why an engine cannot be tried, in a sentence, or None if it can."""

    def call(self, engine: Engine) -> str:
        """Return the call of an engine, in words."""

    def external(self, engine: RemoteEngine) -> Result:
        """Return the result for an engine. Raises its errors and faults."""


@dataclass(frozen=True)
class Case:
    """A hard case: difficulty, expected outcome and error bound.

    `expected` is the correct outcome and `reference` its origin; `bound` describes the error bound
    and its derivation. `seconds` is the time limit.
    """

    name: str
    group: str
    hard: str
    expected: str
    reference: str
    bound: str
    trial: Trial
    seconds: float = 60.0


@dataclass(frozen=True)
class Column:
    """A column of the scoreboard: one of this library's formulations, or an external engine."""

    name: str
    engine: Engine | None = None
