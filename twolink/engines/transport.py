"""Transport of messages to an engine and back."""

from __future__ import annotations

from typing import Protocol

from twolink.engines.faults import EngineFault, FaultKind
from twolink.engines.messages import Answer, Request


class Transport(Protocol):
    """A started engine. After an `EngineFault` only `close` may be called."""

    @property
    def printed(self) -> tuple[int, str]:
        """The number of warnings on its standard error after its start, and the first of them."""

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
