"""What a hard case is, and what becomes of it in an engine's hands."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from twolink.errors import TwolinkError

if TYPE_CHECKING:
    from twolink.engines.isolated import Outcome as Isolated
    from twolink.engines.peer import Peer

GROUPS = ("evaluation", "smooth", "friction", "contact", "input")

FORMULATIONS = ("momenta", "lagrange", "kane")
"""The columns of this library."""

# Beyond the bound by more than this, without a word: that is the failure that hurts.
_SILENTLY = 10.0


class Mark(Enum):
    """What a cell of the scoreboard says."""

    PASS = "pass"
    MISSED = "missed"
    SILENT = "silently wrong"
    REFUSED = "refused"
    CRASH = "crash"
    HANG = "hang"
    CANNOT = "cannot express"

    @property
    def short(self) -> str:
        """The mark in so few letters that a dozen columns stand side by side."""
        return {"missed": "×", "silently wrong": "silent", "cannot express": "–"}.get(
            self.value, self.value
        )

    @property
    def means(self) -> str:
        """What the mark says of an engine."""
        return _MEANS[self]


_MEANS = {
    Mark.PASS: "within the bound",
    Mark.MISSED: "the bound is missed by so much (∞: no number), tenfold at most or with a warning",
    Mark.SILENT: "silently wrong: finite, without a warning, and beyond ten times the bound",
    Mark.REFUSED: "the engine says that it will not",
    Mark.CRASH: "its process ended by itself, or ran out of memory",
    Mark.HANG: "no answer in the time that all are given",
    Mark.CANNOT: "it has no such effect, or reads no such file, and was not tried",
}


@dataclass(frozen=True)
class Finding:
    """How an engine's answer compares with the truth.

    `factor` is the largest error in units of its bound: 1 or less passes, NaN and infinity are
    answers that are no numbers, or that break what must hold whatever the accuracy. `warned` says
    whether the engine itself told that something is amiss; `said` is what was found, in a sentence.
    """

    factor: float
    warned: bool = False
    said: str = ""
    finite: bool = True

    @property
    def mark(self) -> Mark:
        """The mark of this finding."""
        if self.factor <= 1:
            return Mark.PASS
        quiet = self.finite and not self.warned
        return Mark.SILENT if quiet and self.factor > _SILENTLY else Mark.MISSED


@dataclass(frozen=True)
class Outcome:
    """A cell of the scoreboard: its mark, the factor of the bound where there is one, and why.

    `call` is the call that failed, and `output` what it printed or raised.
    """

    mark: Mark
    factor: float | None = None
    seconds: float = 0.0
    said: str = ""
    call: str = ""
    output: str = ""

    @classmethod
    def of(cls, finding: Finding, seconds: float, call: str = "", output: str = "") -> Outcome:
        """Return the outcome of an answer that was compared with the truth."""
        failed = finding.mark is not Mark.PASS
        return cls(
            finding.mark,
            finding.factor,
            seconds,
            finding.said,
            call if failed else "",
            output if failed else "",
        )

    @property
    def words(self) -> str:
        """The outcome in words: the mark, with the factor by which a bound is missed."""
        return " ".join([self.mark.value, self._times]).strip()

    @property
    def short(self) -> str:
        """The cell's text, in a few letters."""
        return self._times or self.mark.short

    @property
    def _times(self) -> str:
        """The factor by which a bound is missed, where it says something."""
        if self.mark is not Mark.MISSED or self.factor is None:
            return ""
        if not math.isfinite(self.factor):
            return "× ∞"
        return f"× {self.factor:#.3g}" if self.factor < 1000 else f"× {self.factor:.0e}"


class LateError(TwolinkError):
    """The time that a case is given is over."""


class Trial(Protocol):
    """What is done in a case, by this library or by a peer."""

    def ours(self, formulation: str, check: Callable[[], None]) -> Finding:
        """Return how one of this library's formulations does.

        `check` is called now and then, and raises `LateError` when the time is over. Errors of this
        library are the caller's to judge.
        """

    def cannot(self, peer: Peer) -> str | None:
        """Return why a peer cannot be tried, in a sentence; None if it can."""

    def peers(self, peer: Peer, seconds: float) -> tuple[Finding | None, Isolated, str]:
        """Return how a peer does, in a process of its own, what became of that, and the call."""


@dataclass(frozen=True)
class Case:
    """A hard case: what is hard about it, what is true, and how near an answer must come.

    `expected` is the true outcome and `reference` where that is known from; `bound` says how large
    an error may be, and from what that is derived. `seconds` is the time that an engine is given.
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
    """A column of the scoreboard: one of this library's formulations, or a peer."""

    name: str
    peer: Peer | None = None
