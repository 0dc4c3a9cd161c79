"""A task in a process of its own, with limits: whatever it does, the caller gets a record of it.

    outcome = run_isolated(task, argument, seconds=10.0)
    outcome.kind     # "finished", "refused", "crash", "hang" or "out of memory"

Engines crash, hang and eat memory on hard cases. The process is spawned, so it shares nothing with
the caller's; it and all that it started are gone when the record is there.
"""

from __future__ import annotations

import contextlib
import dataclasses
import faulthandler
import json
import multiprocessing
import os
import pickle
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

Kind = Literal["finished", "refused", "crash", "hang", "out of memory"]

_GIGABYTE = 2**30

# So long (s) an interpreter may take until the task begins, imports of the task's home included.
_START_UP = 120.0

# So much of what a task printed is kept (characters), its end rather than its beginning.
_KEPT = 20_000


@dataclass(frozen=True)
class Outcome:
    """What became of a task.

    `finished` has the `result`; `refused` is an exception, `crash` a signal or an exit that was
    not asked for, `hang` the end of the time allowed. `said` is the exception's last line or the
    name of the signal, `warnings` are Python's, `output` is what was printed on stdout and stderr,
    with the Python call in which a crash happened. `seconds` is the task's own time.
    """

    kind: Kind
    seconds: float
    result: Any = None
    said: str = ""
    warnings: tuple[str, ...] = ()
    output: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return the record in dicts, lists, numbers and words, as `json` writes them."""
        table = dataclasses.asdict(self)
        return dict(json.loads(json.dumps(table, default=_plain)))


def run_isolated(
    task: Callable[..., Any],
    *arguments: Any,
    seconds: float,
    memory: int = 4 * _GIGABYTE,
) -> Outcome:
    """Run a task in a new process, for so many seconds and bytes of memory at most.

    The task is a function at the top of a module; its arguments and result must be picklable. It
    never raises what the task raises. The limit of memory holds where the system knows one for
    private memory (Linux).
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    order = pickle.dumps((task, arguments))
    with tempfile.TemporaryDirectory(prefix="twolink-") as folder:
        output = Path(folder, "output")
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


def _followed(process: Any, pipe: Connection, seconds: float) -> Outcome:
    """Return the record of a process that was started, without its output."""
    wait([pipe, process.sentinel], _START_UP)
    if not _has_begun(pipe):
        said = _exit(process) if wait([process.sentinel], 0) else "it did not begin"
        return Outcome("crash" if wait([process.sentinel], 0) else "hang", 0.0, said=said)
    begin = perf_counter()
    ended = wait([pipe, process.sentinel], seconds)
    taken = perf_counter() - begin
    if not ended:
        return Outcome("hang", taken, said=f"stopped after {seconds:g} s")
    # A process that ends leaves its last words in the pipe, or none.
    try:
        answer: Outcome = pipe.recv()
    except EOFError:
        return Outcome("crash", taken, said=_exit(process))
    return answer


def _has_begun(pipe: Connection) -> bool:
    try:
        return pipe.poll() and pipe.recv() == "begun"
    except EOFError:
        return False


def _exit(process: Any) -> str:
    """Return in words how a process ended by itself."""
    process.join(5)
    code = process.exitcode
    if code is not None and code < 0:
        return signal.Signals(-code).name
    return f"exit code {code}"


def _end(process: Any) -> None:
    """Kill what is left of a process and of all that it started."""
    # The group is the child's own. Before that was made, there is the child alone.
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.join()
    process.close()


def _child(order: bytes, pipe: Connection, output: str, memory: int) -> None:
    """Do the task, and send its record: all in the new process."""
    _keep_to_oneself(output, memory)
    heard: list[Any] = []
    try:
        task, arguments = pickle.loads(order)
        pipe.send("begun")
        begin = perf_counter()
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            result = task(*arguments)
        outcome = Outcome("finished", perf_counter() - begin, result, "", _each_once(heard))
        answer = pickle.dumps(outcome)
    except MemoryError as error:
        said = f"MemoryError: {error}".removesuffix(": ")
        answer = pickle.dumps(Outcome("out of memory", 0.0, None, said, _each_once(heard)))
    except BaseException as error:
        traceback.print_exc()
        said = traceback.format_exception_only(error)[-1].strip()
        answer = pickle.dumps(Outcome("refused", 0.0, None, said, _each_once(heard)))
    sys.stdout.flush()
    sys.stderr.flush()
    pipe.send_bytes(answer)
    pipe.close()
    # Nothing that an engine does on its way out is waited for.
    os._exit(0)


def _keep_to_oneself(output: str, memory: int) -> None:
    """Take a group of one's own, a file for all that is printed, and limits."""
    import resource

    os.setsid()
    end_with_the_caller()
    file = os.open(output, os.O_WRONLY | os.O_APPEND)
    os.dup2(file, 1)
    os.dup2(file, 2)
    faulthandler.enable(file=2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))


def end_with_the_caller() -> None:
    """Let this process be killed when the one that started it is (on Linux)."""
    if sys.platform == "linux":
        import ctypes

        # PR_SET_PDEATHSIG
        ctypes.CDLL(None).prctl(1, int(signal.SIGKILL))
        caller = multiprocessing.parent_process()
        if caller is not None and os.getppid() != caller.pid:
            # It was killed before this could be known.
            os._exit(1)


def _each_once(heard: list[Any]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(f"{each.category.__name__}: {each.message}" for each in heard))


def _plain(value: Any) -> Any:
    """Return arrays as lists and NumPy's numbers as numbers, for `json`."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value)
