"""`python -m twolink.engines.serve module:object`: a Python engine as a child process."""

from __future__ import annotations

import os
import sys
from typing import TextIO

from twolink.engines.answering import answer
from twolink.engines.attach import python_engine
from twolink.engines.contract import Engine
from twolink.engines.messages import ProtocolError, Stop, request_of
from twolink.errors import TwolinkError


def serve(engine: Engine, questions: TextIO, answers: TextIO) -> None:
    """Answer requests, a line each, until `stop` or the end. Raises `ProtocolError`."""
    for line in questions:
        request = request_of(line)
        if isinstance(request, Stop):
            return
        answers.write(answer(engine, request).line() + "\n")
        answers.flush()


def main() -> None:
    """Serve the engine named on the command line."""
    # Output of the engine must not come between the messages.
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        (path,) = sys.argv[1:]
        engine = python_engine(path)
        # It is left open: its end would come before that of the process, and look like a crash.
        with os.fdopen(kept, "w", encoding="utf-8", closefd=False) as answers:
            serve(engine, sys.stdin, answers)
    except (TwolinkError, ProtocolError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
