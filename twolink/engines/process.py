"""An engine in a child process that speaks JSON lines."""

from __future__ import annotations

from collections.abc import Sequence

from twolink.engines.child import GIGABYTE, Child
from twolink.engines.faults import FaultKind
from twolink.engines.messages import Answer, ProtocolError, Request, Start, Stop, answer_of
from twolink.engines.transport import check_sequence

# Time (s) that a child has for ending after `stop`.
_PARTING = 1.0


class ProcessTransport:
    """A child process; see `twolink.engines.transport.Transport`."""

    def __init__(self, command: Sequence[str], memory: int = 4 * GIGABYTE) -> None:
        """Start a command with a limit on its memory (bytes)."""
        self._child = Child(command, memory)

    def ask(self, request: Request, seconds: float) -> Answer:
        """Return the answer to a request within a time (s). Raises `EngineFault`."""
        child = self._child
        if unread := child.unread:
            child.fail_by_output(FaultKind.UNASKED, f"it wrote {unread} before a question")
        line = child.exchanged(request.line().encode() + b"\n", seconds)
        try:
            answer = answer_of(request.cmd, line.decode("utf-8", errors="replace"))
        except ProtocolError as error:
            child.fail_by_output(FaultKind.NO_MESSAGE, str(error))
        check_sequence(request, answer)
        if isinstance(request, Start):
            child.forget_warnings()
        return answer

    @property
    def printed(self) -> tuple[int, str]:
        """The number of warnings that it printed after its start, and the first of them."""
        return self._child.printed.warnings, self._child.printed.first

    def stop(self, seconds: float) -> bool:
        """Ask the child to stop; return whether it ends by itself within a time (s)."""
        return self._child.stop(Stop().line().encode() + b"\n", seconds)

    def close(self) -> None:
        """Ask the child to stop, and kill it with all of its children."""
        if not self._child.ended:
            self.stop(_PARTING)
        self._child.close()
