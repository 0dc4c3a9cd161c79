"""Data of hard cases: the case, its trial, and the outcome for an engine."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from twolink.errors import TwolinkError
from twolink.formulations import EquationsName
from twolink.tables import Tone

if TYPE_CHECKING:
    from twolink.chain import Chain
    from twolink.engines.contract import Array
    from twolink.engines.messages import Method
    from twolink.engines.sandbox import TaskResult
    from twolink.engines.simulation_engine import SimulationEngine
    from twolink.scene import Scene

    Numbers = tuple[float, float]

GROUPS = ("evaluation", "smooth", "friction", "contact", "input")

# A larger excess over the bound without a warning is a silent error.
_SILENTLY = 10.0


class Mark(Enum):
    """The mark of a scoreboard cell."""

    PASS = "pass"
    MISSED = "missed"
    SILENT = "silently wrong"
    REFUSED = "refused"
    CRASH = "crash"
    HANG = "hang"
    INVALID = "invalid answer"
    CANNOT = "cannot express"

    @property
    def short(self) -> str:
        """The abbreviated mark, for tables with a dozen columns."""
        return {
            "missed": "×",
            "silently wrong": "silent",
            "invalid answer": "invalid",
            "cannot express": "–",
        }.get(self.value, self.value)

    @property
    def means(self) -> str:
        """The explanation of the mark."""
        return _MEANS[self]

    @property
    def tone(self) -> Tone:
        """The tone of the mark in tables."""
        return _TONES.get(self, Tone.BAD)


_MEANS = {
    Mark.PASS: "within the bound",
    Mark.MISSED: "error over bound (∞: not finite), at most tenfold or with a warning",
    Mark.SILENT: "finite, without a warning, error above ten times the bound",
    Mark.REFUSED: "the engine rejects the case",
    Mark.CRASH: "the engine's process ended unexpectedly, or ran out of memory",
    Mark.HANG: "no answer within the time limit",
    Mark.INVALID: "the answer breaks the protocol: another shape, format or length",
    Mark.CANNOT: "unsupported effect or file format; not tried",
}


_TONES = {
    Mark.PASS: Tone.GOOD,
    Mark.MISSED: Tone.WARN,
    Mark.REFUSED: Tone.WARN,
    Mark.CANNOT: Tone.SOFT,
}


@dataclass(frozen=True)
class Result:
    """The comparison of an engine's answer with the reference.

    `factor` is the largest error in units of its bound: 1 or less passes; NaN and infinity mark
    non-finite answers and violations of exact properties. `warned` states whether the engine issued
    a warning; `said` is the description of the result.
    """

    factor: float
    warned: bool = False
    said: str = ""
    finite: bool = True

    @property
    def mark(self) -> Mark:
        """The mark of this result."""
        if self.factor <= 1:
            return Mark.PASS
        quiet = self.finite and not self.warned
        return Mark.SILENT if quiet and self.factor > _SILENTLY else Mark.MISSED


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


class Subject(Protocol):
    """An engine as trials ask it, isolated from this process.

    States are in absolute angles (rad) and speeds (rad/s). A task takes at most `seconds`.
    """

    @property
    def name(self) -> str:
        """The engine's name."""

    @property
    def methods(self) -> tuple[Method, ...]:
        """The engine's integration methods."""

    @property
    def reads_urdf(self) -> bool:
        """Whether the engine reads URDF."""

    def unsupported(self, scene: Scene) -> str | None:
        """Return why the engine cannot express a scene, or None if it can."""

    def accelerations(
        self, chain: Chain, q: Numbers, u: Numbers, g: float, torque: Numbers, seconds: float
    ) -> TaskResult:
        """Return du (rad/s²) under gravity along y (m/s²) and motor torques (N m)."""

    def motions(
        self,
        scene: Scene,
        method: str,
        parameters: tuple[float, ...],
        times: Array,
        seconds: float,
    ) -> TaskResult:
        """Return q and u, shape (2, n), and warnings for each parameter value of a method."""

    def reading(self, urdf: str, seconds: float) -> TaskResult:
        """Return numbers for a text of `twolink.hardcases.hostile_urdf` that was loaded."""


class Trial(Protocol):
    """The procedure of a case, for this library and for external engines."""

    def ours(self, formulation: EquationsName, check: Callable[[], None]) -> Result:
        """Return the result for one of this library's formulations.

        `check` is called repeatedly and raises `LateError` at the time limit. The caller handles
        exceptions of this library.
        """

    def unsupported(self, subject: Subject) -> str | None:
        """Return why an engine cannot be tried, in a sentence, or None if it can."""

    def external(self, subject: Subject, seconds: float) -> tuple[Result | None, TaskResult, str]:
        """Return the result for an engine, the outcome of its task, and the call."""


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
    engine: SimulationEngine | None = None
