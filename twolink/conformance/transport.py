"""The way of messages to an engine and back, and the faults that end it."""

from __future__ import annotations

from enum import StrEnum
from typing import Protocol

from twolink.engines.messages import Answer, Request


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


class Transport(Protocol):
    """A started engine. After an `EngineFault` it is used no more but for `close`."""

    def ask(self, request: Request, seconds: float) -> Answer:
        """Return the answer to a request within a time (s). Raises `EngineFault`."""

    def stop(self, seconds: float) -> bool:
        """Ask the engine to stop; return whether it ends by itself within a time (s)."""

    def close(self) -> None:
        """Stop the engine, and end all its processes."""


def check_sequence(request: Request, answer: Answer) -> None:
    """Raise `EngineFault` for an answer that carries the number of another question."""
    asked, answered = getattr(request, "seq", None), getattr(answer, "seq", None)
    if asked != answered:
        raise EngineFault(
            FaultKind.OTHER_QUESTION, f"seq must be {asked}, as asked; got {answered}"
        )
