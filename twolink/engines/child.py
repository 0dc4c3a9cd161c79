"""A program in a child process, with limits on time, memory and output.

    child = Child(["./engine"])
    line = child.exchanged(question, seconds=10.0)

The program writes lines to its standard output; the end of its standard error is kept. When it is
closed, it and its children have ended. Engines under test, hostile input and derivations of code
run this way.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import selectors
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from time import monotonic
from typing import Any, NoReturn

from twolink.engines.faults import EngineFault, FaultKind
from twolink.text import one_line

GIGABYTE = 2**30

# Bytes: of one line, and kept of the standard error.
_LONGEST = 32 * 2**20
_KEPT = 20_000

# Output (bytes) that makes a flood, and the time (s) in which it shows.
_FLOOD = 2**20
_LISTENED = 0.3

# Time (s) that a child has for ending after its output has ended.
_PARTING = 1.0

# Set limits in the child and become the engine. It is not a fork of this process with its threads.
_LAUNCHER = """
import ctypes, os, resource, sys
memory, parent = int(sys.argv[1]), int(sys.argv[2])
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
if sys.platform == "linux":
    ctypes.CDLL(None).prctl(1, 9)
    if os.getppid() != parent:
        os._exit(1)
try:
    os.execvp(sys.argv[3], sys.argv[3:])
except OSError as error:
    sys.exit(f"{sys.argv[3]}: {error.strerror}")
"""


# Time limit (s) for starting an interpreter, including the imports of a module.
_START_UP = 120.0


def value_of(module: str, *arguments: str, seconds: float, memory: int = 4 * GIGABYTE) -> Any:
    """Return the value that `python -m module …` sends by `tell`, with limits.

    The limits are on time (s), from the end of the imports on, and memory (bytes). Raises
    `EngineFault`.
    """
    program = [sys.executable, "-X", "faulthandler", "-m", module, *arguments]
    with contextlib.closing(Child(program, memory)) as child:
        child.exchanged(b"", _START_UP)
        return json.loads(child.exchanged(b"", seconds))


def tell(value: Callable[[], Any]) -> None:
    """Compute a value and write it as JSON, for `value_of`."""
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    sys.stdout.write(json.dumps(value()) + "\n")
    sys.stdout.flush()


# A line of the standard error that is a warning, and how much of it is kept (bytes, characters).
_WARNING = re.compile(rb"warn|error", re.IGNORECASE)
_LONGEST_WARNING = 2000


class Printed:
    """Lines that a program prints to its standard error: their end, and the warnings in them."""

    def __init__(self) -> None:
        """Begin without lines and warnings."""
        self.end = bytearray()
        self._line = b""
        self.forget()

    def forget(self) -> None:
        """Forget the warnings so far."""
        self.warnings, self.first = 0, ""

    def add(self, chunk: bytes) -> None:
        """Add the next bytes of the output."""
        self.end += chunk
        del self.end[:-_KEPT]
        *lines, last = chunk.split(b"\n")
        for line in lines:
            self._take((self._line + line)[:_LONGEST_WARNING])
            self._line = b""
        self._line = (self._line + last)[:_LONGEST_WARNING]

    def finish(self) -> None:
        """Take the last line, which may have no end."""
        self._take(self._line)
        self._line = b""

    def _take(self, line: bytes) -> None:
        text = line.decode("utf-8", errors="replace")
        if self.first.endswith(":") and self.warnings == 1:
            # The first warning was only a heading: the next line continues it.
            self.first = one_line(f"{self.first} {text}", 200)
        if _WARNING.search(line):
            self.warnings += 1
            self.first = self.first or one_line(text, 200)


class Child:
    """A started program. It has ended after an `EngineFault`, and is then only closed."""

    def __init__(self, command: Sequence[str], memory: int = 4 * GIGABYTE) -> None:
        """Start a command with a limit on its memory (bytes)."""
        launcher = [sys.executable, "-I", "-S", "-c", _LAUNCHER, str(memory), str(os.getpid())]
        self._process = subprocess.Popen(
            [*launcher, *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
            bufsize=0,
        )
        streams: list[Any] = [self._process.stdin, self._process.stdout, self._process.stderr]
        self._streams = streams
        self._stdin, self._stdout, self._stderr = (stream.fileno() for stream in streams)
        self._selector = selectors.DefaultSelector()
        for number in (self._stdin, self._stdout, self._stderr):
            os.set_blocking(number, False)
        for number in (self._stdout, self._stderr):
            self._selector.register(number, selectors.EVENT_READ)
        self._buffer = bytearray()
        self.printed = Printed()
        self._ended = False

    @property
    def unread(self) -> str:
        """The beginning of the output after the last line that was read, shortened."""
        self._read_for(0.0)
        return self._shown() if self._buffer else ""

    @property
    def output(self) -> str:
        """The end of the child's standard error; all that it wrote once it is closed."""
        return self.printed.end.decode("utf-8", errors="replace")

    @property
    def ended(self) -> str:
        """How the child has ended by itself: a signal or an exit code; empty if it has not."""
        code = self._process.poll()
        if code is None:
            return ""
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"

    def exchanged(self, message: bytes, seconds: float) -> bytes:
        """Send a message and return the next line. Raises `EngineFault`."""
        deadline = monotonic() + seconds
        left = memoryview(message)
        self._selector.register(self._stdin, selectors.EVENT_WRITE)
        try:
            searched = 0
            while (end := self._buffer.find(b"\n", searched)) < 0:
                # A long answer comes in many pieces; each is searched once.
                searched = len(self._buffer)
                if len(self._buffer) > _LONGEST:
                    self._fail(FaultKind.FLOOD, f"an answer exceeds {_LONGEST // 2**20} MB")
                if self._ended:
                    self._fail_by_end()
                remaining = deadline - monotonic()
                if remaining <= 0:
                    part = f", in the middle of the line {self._shown()}" if self._buffer else ""
                    self._fail(FaultKind.HANG, f"no answer within {seconds:g} s{part}")
                left = self._turn(left, remaining)
        finally:
            self._end_writing()
        line = bytes(self._buffer[:end])
        del self._buffer[: end + 1]
        return line

    def _end_writing(self) -> None:
        """Look no more for when the child can take more of a message, which may have been taken."""
        with contextlib.suppress(KeyError):
            self._selector.unregister(self._stdin)

    def _turn(self, left: memoryview, seconds: float) -> memoryview:
        """Write and read for up to a time (s); return the bytes that are still to be written."""
        for key, _ in self._selector.select(seconds):
            if key.fd == self._stdin:
                try:
                    left = left[os.write(self._stdin, left) :]
                except BrokenPipeError:
                    # Reading detects the end of the child.
                    left = left[:0]
                if not left:
                    self._selector.unregister(self._stdin)
            else:
                self._read(key.fd)
        return left

    def _read(self, number: int) -> None:
        try:
            chunk = os.read(number, 2**16)
        except BlockingIOError:
            return
        if not chunk:
            self._selector.unregister(number)
            self._ended |= number == self._stdout
        elif number == self._stdout:
            self._buffer += chunk
        else:
            self.printed.add(chunk)

    def _read_for(self, seconds: float) -> None:
        """Read the output of the next `seconds`, up to the limit of a flood."""
        deadline = monotonic() + seconds
        while self._selector.get_map() and len(self._buffer) <= _FLOOD:
            ready = self._selector.select(max(0.0, deadline - monotonic()))
            if not ready:
                return
            for key, _ in ready:
                self._read(key.fd)

    def stop(self, message: bytes, seconds: float) -> bool:
        """Send a last message; return whether the child ends by itself within a time (s)."""
        with contextlib.suppress(OSError):
            os.write(self._stdin, message)
        self._close(self._streams[0])
        try:
            return self._process.wait(seconds) == 0
        except subprocess.TimeoutExpired:
            return False

    def close(self) -> None:
        """Kill the child with all of its children."""
        self._kill()
        self._read_for(0.0)
        self.printed.finish()
        self._selector.close()
        for stream in self._streams:
            self._close(stream)

    def forget_warnings(self) -> None:
        """Forget the warnings that were printed up to now."""
        self._read_for(0.0)
        self.printed.forget()

    def fail_by_output(self, kind: FaultKind, said: str) -> NoReturn:
        """Raise a fault, or that of a flood if more and more output comes."""
        self._read_for(_LISTENED)
        if len(self._buffer) > _FLOOD:
            self._fail(FaultKind.FLOOD, f"it writes without end; {said}")
        self._fail(kind, said)

    def _fail_by_end(self) -> NoReturn:
        """Raise the fault of a child that closed its standard output."""
        # A message that it did not take is no output to be read.
        self._end_writing()
        try:
            self._process.wait(_PARTING)
        except subprocess.TimeoutExpired:
            self._fail(FaultKind.CRASH, "it closed its standard output")
        self._read_for(0.0)
        last = self.output.strip().rpartition("\n")[2]
        said = f"{self.ended}; {one_line(last, 200)}" if last else self.ended
        if self._buffer:
            self._fail(FaultKind.CUT, f"{said}, in the middle of the line {self._shown()}")
        self._fail(FaultKind.CRASH, said)

    def _fail(self, kind: FaultKind, said: str) -> NoReturn:
        self._kill()
        raise EngineFault(kind, said, self.output)

    def _kill(self) -> None:
        """Kill the child and all processes of its session."""
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def _shown(self) -> str:
        return repr(one_line(bytes(self._buffer[:200]).decode("utf-8", errors="replace"), 80))

    @staticmethod
    def _close(stream: Any) -> None:
        with contextlib.suppress(OSError):
            stream.close()
