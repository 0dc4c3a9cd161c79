"""Run a task in a separate process with limits on time and memory, and report the result.

    outcome = run_sandboxed(task, argument, seconds=10.0)
    outcome.kind     # "finished", "refused", "crash", "hang" or "out of memory"

Engines crash, hang and exhaust memory on hard cases. The process shares no state with the caller;
it and its children have ended when the result is returned.
"""

from __future__ import annotations

import base64
import contextlib
import dataclasses
import json
import multiprocessing
import os
import pickle
import signal
import sys
import traceback
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Literal

from twolink.engines.child import GIGABYTE, Child
from twolink.engines.faults import EngineFault, FaultKind

Kind = Literal["finished", "refused", "crash", "hang", "out of memory"]

# Time limit (s) for starting an interpreter, including the imports of the task's module.
_START_UP = 120.0

_PROGRAM = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from twolink.engines.sandbox import main; main()"
)
_BEGUN = b"begun"


@dataclass(frozen=True)
class TaskResult:
    """The result of a task, or the way in which it failed.

    `finished` has the `result`; `refused` is an exception, `crash` a signal or an unexpected exit,
    `hang` a time-out. `said` is the exception's last line or the name of the signal, `warnings` are
    Python's, `output` is the text on stdout and stderr, with the Python traceback of a crash.
    `seconds` is the task's own time.
    """

    kind: Kind
    seconds: float
    result: Any = None
    said: str = ""
    warnings: tuple[str, ...] = ()
    output: str = ""


def run_sandboxed(
    task: Callable[..., Any],
    *arguments: Any,
    seconds: float,
    memory: int = 4 * GIGABYTE,
) -> TaskResult:
    """Run a task in a new process, with limits on time (s) and memory (bytes).

    The task is a function of a module that can be imported; its arguments and result must be
    picklable. Exceptions of the task are reported, not raised. The memory limit applies on systems
    that support a limit on private memory (Linux).
    """
    program = [sys.executable, "-X", "faulthandler", "-c", _PROGRAM, json.dumps(sys.path)]
    with contextlib.closing(Child(program, memory)) as child:
        outcome = _followed(child, _line((task, arguments)), seconds)
    outcome = dataclasses.replace(outcome, output=child.output)
    if outcome.kind == "crash" and "bad_alloc" in outcome.output:
        return dataclasses.replace(outcome, kind="out of memory")
    return outcome


def _followed(child: Child, order: bytes, seconds: float) -> TaskResult:
    """Return the result of a task in a child, without its output."""
    begin, limit = perf_counter(), _START_UP
    try:
        answer = child.exchanged(order, limit)
        if answer == _BEGUN:
            begin, limit = perf_counter(), seconds
            answer = child.exchanged(b"", limit)
    except EngineFault as fault:
        taken = perf_counter() - begin
        if fault.kind is FaultKind.HANG:
            return TaskResult("hang", taken, said=f"stopped after {limit:g} s")
        return TaskResult("crash", taken, said=child.ended)
    found: TaskResult = pickle.loads(base64.b64decode(answer))
    return found


def _line(value: Any) -> bytes:
    return base64.b64encode(pickle.dumps(value)) + b"\n"


def main() -> None:
    """Run the task of the standard input and send its result; runs in the new process."""
    # What the task prints must not come between the messages.
    answers = os.dup(1)
    os.dup2(2, 1)
    captured: list[Any] = []
    try:
        task, arguments = pickle.loads(base64.b64decode(sys.stdin.buffer.readline()))
        os.write(answers, _BEGUN + b"\n")
        begin = perf_counter()
        with warnings.catch_warnings(record=True) as captured:
            warnings.simplefilter("always")
            result = task(*arguments)
        outcome = TaskResult("finished", perf_counter() - begin, result, "", each_once(captured))
        answer = _line(outcome)
    except MemoryError as error:
        said = f"MemoryError: {error}".removesuffix(": ")
        answer = _line(TaskResult("out of memory", 0.0, None, said, each_once(captured)))
    except BaseException as error:
        traceback.print_exc()
        said = traceback.format_exception_only(error)[-1].strip()
        answer = _line(TaskResult("refused", 0.0, None, said, each_once(captured)))
    sys.stdout.flush()
    sys.stderr.flush()
    with os.fdopen(answers, "wb") as stream:
        stream.write(answer)
    # Exit at once, without waiting for the engine's own clean-up.
    os._exit(0)


def end_with_caller() -> None:
    """Kill this process when its parent ends (on Linux)."""
    if sys.platform == "linux":
        import ctypes

        # PR_SET_PDEATHSIG
        ctypes.CDLL(None).prctl(1, int(signal.SIGKILL))
        caller = multiprocessing.parent_process()
        if caller is not None and os.getppid() != caller.pid:
            # The parent ended before the signal was requested.
            os._exit(1)


def each_once(captured: Iterable[Any]) -> tuple[str, ...]:
    """Return captured Python warnings as sentences, without duplicates."""
    return tuple(dict.fromkeys(f"{each.category.__name__}: {each.message}" for each in captured))
