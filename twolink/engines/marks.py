"""The judge of all suites: errors in units of their bounds, and the marks of answers."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.engines.faults import CannotError, EngineFault, FaultKind
from twolink.errors import EngineError
from twolink.tables import Tone

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

    @classmethod
    def of(cls, error: EngineError | EngineFault) -> Mark:
        """Return the mark of an engine that gave no answer."""
        if isinstance(error, EngineFault):
            return _OF_FAULTS.get(error.kind, cls.INVALID)
        return cls.CANNOT if isinstance(error, CannotError) else cls.REFUSED

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


_OF_FAULTS = {
    FaultKind.CRASH: Mark.CRASH,
    FaultKind.CUT: Mark.CRASH,
    FaultKind.HANG: Mark.HANG,
}


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


def excess(error: NDArray[Any], bound: NDArray[Any]) -> NDArray[np.float64]:
    """Return errors in units of their bounds, infinite where either is not a number."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        shares = np.where(error == 0, 0.0, np.asarray(error / bound, dtype=float))
    return np.where(np.isfinite(shares), shares, np.inf)
