"""A Python engine in this process: the same messages, without limits and isolation."""

from __future__ import annotations

from twolink.engines.answering import answer
from twolink.engines.contract import Engine
from twolink.engines.faults import EngineFault, FaultKind
from twolink.engines.messages import Answer, ProtocolError, Request, answer_of
from twolink.engines.transport import check_sequence


class InProcess:
    """A Python engine; see `twolink.engines.transport.Transport`."""

    printed = (0, "")

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
