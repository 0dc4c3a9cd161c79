"""A Python engine in this process: the same messages, without limits and isolation."""

from __future__ import annotations

from twolink.conformance.contract import Engine, answer
from twolink.conformance.transport import EngineFault, FaultKind, check_sequence
from twolink.engines.messages import Answer, ProtocolError, Request, answer_of


class InProcess:
    """A Python engine; see `twolink.conformance.transport.Transport`."""

    def __init__(self, engine: Engine) -> None:
        """Take an engine."""
        self._engine = engine

    def ask(self, request: Request, seconds: float) -> Answer:
        """Return the answer to a request; the time is not limited."""
        try:
            # Through a line of text, so that an engine in process is judged as one in a child.
            found = answer_of(request.cmd, answer(self._engine, request).line())
        except (ProtocolError, ValueError) as error:
            raise EngineFault(FaultKind.NO_MESSAGE, str(error)) from error
        check_sequence(request, found)
        return found

    def stop(self, seconds: float) -> bool:
        """Return True: there is nothing to stop."""
        return True

    def close(self) -> None:
        """Leave the engine as it is."""
