"""Run a task in a separate process with limits on time and memory, and report the result.

    outcome = run_sandboxed(task, argument, seconds=10.0)
    outcome.kind     # "finished", "refused", "crash", "hang" or "out of memory"

Engines crash, hang and exhaust memory on hard cases. The process is spawned, so it shares no state
with the caller; it and its children have ended when the result is returned.
"""

from __future__ import annotations

import contextlib
import dataclasses
import faulthandler
import multiprocessing
import os
import pickle
import signal
import sys
import traceback
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from time import perf_counter
from typing import Any, Literal

from twolink.files import scratch_folder

Kind = Literal["finished", "refused", "crash", "hang", "out of memory"]

_GIGABYTE = 2**30

# Time limit (s) for starting an interpreter, including the imports of the task's module.
_START_UP = 120.0

# Number of characters kept from the end of a task's output.
_KEPT = 20_000


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
    memory: int = 4 * _GIGABYTE,
) -> TaskResult:
    """Run a task in a new process, with limits on time (s) and memory (bytes).

    The task is a module-level function; its arguments and result must be picklable. Exceptions of
    the task are reported, not raised. The memory limit applies on systems that support a limit on
    private memory (Linux).
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    order = pickle.dumps((task, arguments))
    with scratch_folder("engine") as folder:
        output = folder / "output"
        output.touch()
        process = context.Process(target=_child, args=(order, theirs, str(output), memory))
        process.start()
        theirs.close()
        try:
            outcome = _followed(process, ours, seconds)
        finally:
            _end(process)
            ours.close()
        text = output.read_bytes()[-_KEPT:].decode("utf-8", errors="replace")
    outcome = dataclasses.replace(outcome, output=text)
    if outcome.kind == "crash" and "bad_alloc" in text:
        return dataclasses.replace(outcome, kind="out of memory")
    return outcome


def _followed(process: Any, pipe: Connection, seconds: float) -> TaskResult:
    """Return the result of a started process, without its output."""
    wait([pipe, process.sentinel], _START_UP)
    if not _has_begun(pipe):
        said = _exit(process) if wait([process.sentinel], 0) else "the task did not start"
        return TaskResult("crash" if wait([process.sentinel], 0) else "hang", 0.0, said=said)
    begin = perf_counter()
    ended = wait([pipe, process.sentinel], seconds)
    taken = perf_counter() - begin
    if not ended:
        return TaskResult("hang", taken, said=f"stopped after {seconds:g} s")
    # A process that ended may have left a message in the pipe.
    try:
        answer: TaskResult = pipe.recv()
    except EOFError:
        return TaskResult("crash", taken, said=_exit(process))
    return answer


def _has_begun(pipe: Connection) -> bool:
    try:
        return pipe.poll() and pipe.recv() == "begun"
    except EOFError:
        return False


def _exit(process: Any) -> str:
    """Return a description of how a process ended by itself."""
    process.join(5)
    code = process.exitcode
    if code is not None and code < 0:
        return signal.Signals(-code).name
    return f"exit code {code}"


def _end(process: Any) -> None:
    """Kill a process and all of its children."""
    # The child creates its own process group; until then only the child itself exists.
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.join()
    process.close()


def _child(order: bytes, pipe: Connection, output: str, memory: int) -> None:
    """Run the task and send its result; runs in the new process."""
    _keep_to_oneself(output, memory)
    captured: list[Any] = []
    try:
        task, arguments = pickle.loads(order)
        pipe.send("begun")
        begin = perf_counter()
        with warnings.catch_warnings(record=True) as captured:
            warnings.simplefilter("always")
            result = task(*arguments)
        outcome = TaskResult("finished", perf_counter() - begin, result, "", each_once(captured))
        answer = pickle.dumps(outcome)
    except MemoryError as error:
        said = f"MemoryError: {error}".removesuffix(": ")
        answer = pickle.dumps(TaskResult("out of memory", 0.0, None, said, each_once(captured)))
    except BaseException as error:
        traceback.print_exc()
        said = traceback.format_exception_only(error)[-1].strip()
        answer = pickle.dumps(TaskResult("refused", 0.0, None, said, each_once(captured)))
    sys.stdout.flush()
    sys.stderr.flush()
    pipe.send_bytes(answer)
    pipe.close()
    # Exit at once, without waiting for the engine's own clean-up.
    os._exit(0)


def _keep_to_oneself(output: str, memory: int) -> None:
    """Create a process group, redirect all output to a file, and set limits."""
    import resource

    os.setsid()
    end_with_caller()
    file = os.open(output, os.O_WRONLY | os.O_APPEND)
    os.dup2(file, 1)
    os.dup2(file, 2)
    faulthandler.enable(file=2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))


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
