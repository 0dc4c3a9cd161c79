"""The errors and faults by which an engine gives no answer."""

from __future__ import annotations

from enum import StrEnum

from twolink.errors import EngineError


class ModelRefusedError(EngineError):
    """The engine rejects a model."""


class CannotError(EngineError):
    """The engine cannot answer a question; its message says why, perhaps with a link."""

    def __init__(self, said: str, link: str = "") -> None:
        """Record why, and the link to an issue."""
        super().__init__(said)
        self.link = link


class FaultKind(StrEnum):
    """How an engine fails to answer."""

    CRASH = "crash"
    CUT = "death in mid-line"
    HANG = "hang"
    FLOOD = "flood"
    UNASKED = "output that was not asked for"
    NO_MESSAGE = "no message of the protocol"
    OTHER_QUESTION = "answer to another question"
    WRONG_LENGTH = "wrong length"


class EngineFault(Exception):  # noqa: N818 - a fault of the engine, not of this program
    """An engine gave no answer that can be judged.

    `said` describes the fault, `output` is the end of the engine's standard error.
    """

    def __init__(self, kind: FaultKind, said: str, output: str = "") -> None:
        """Record a fault."""
        super().__init__(f"{kind.value}: {said}")
        self.kind, self.said, self.output = kind, said, output
