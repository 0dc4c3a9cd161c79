"""The program `twolink`: where every error becomes one sentence and an exit code.

Exit code 0: done. 1: a fault, such as a full disk. 2: the input was refused. 130, 143 and 129: it
was ended by SIGINT, SIGTERM and SIGHUP.
"""

from __future__ import annotations

import math
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import pairwise
from types import FrameType
from typing import Any

import typer
from typer.core import TyperGroup

from twolink.cli.terminal import BAD_INPUT, FAILED, flush, warn
from twolink.errors import BrowserError, FileError, IntegrationError, TwolinkError
from twolink.interruptible import begun
from twolink.text import choice, one_line, quoted

# Seconds until a signal is sent again that waited, or whose exception was lost in a library,
# and from then on until it is raised.
_AGAIN_EVERY = 0.1

# Seconds for which a signal waits for the end of an import: a module of one's own may never end.
# It is raised in the import then, and sent again if the program goes on for as long.
_LONGEST_IMPORT = 2.0

# Python's import in Python's own code, by the names of its files.
_IMPORT = "<frozen importlib._bootstrap"

# Errors of valid commands that failed.
_FAULTS = (BrowserError, FileError, IntegrationError)

# Typer brings its own copy of click since 0.29: the error is found by one that derives from it.
_UsageError: type[Exception] = typer.BadParameter.__bases__[0]


class Program(TyperGroup):
    """The commands of `twolink`, each of which ends with one sentence and an exit code."""

    def main(self, args: Sequence[str] | None = None, *_: Any, **__: Any) -> Any:
        """Run a command and end the process with its exit code."""
        words = list(sys.argv[1:] if args is None else args)
        sys.exit(self._run(words or ["--help"]))

    def _run(self, words: list[str]) -> int:
        """Run a command; return its exit code, and print an error in one sentence."""
        try:
            with _ended_by_signals():
                code = self._invoked(words)
                flush()
                return code
        except KeyboardInterrupt:
            return 128 + signal.SIGINT
        except (_UsageError, TwolinkError, MemoryError, OSError) as error:
            code, sentence = _ending(error, words)
            warn(f"twolink: {one_line(sentence)}")
            return code
        finally:
            _leave_nothing_to_write()

    def _invoked(self, words: list[str]) -> int:
        try:
            with self.make_context("twolink", words) as context:
                self.invoke(context)
        except typer.Exit as end:
            return int(end.exit_code)
        return 0


def _ending(error: Exception, words: Sequence[str]) -> tuple[int, str]:
    """Return the exit code of an error, and its sentence."""
    if isinstance(error, _UsageError):
        return BAD_INPUT, usage_sentence(error, words)
    if isinstance(error, MemoryError):
        # NumPy states how much memory it requested.
        return FAILED, f"there is not enough memory ({str(error) or 'none is left'})"
    if isinstance(error, OSError):
        name = "" if error.filename is None else f"{one_line(error.filename, 300)}: "
        return FAILED, f"{name}{error.strerror or error}"
    sentence = _of_option(str(error), words)
    return FAILED if isinstance(error, _FAULTS) else BAD_INPUT, sentence


def _of_option(sentence: str, words: Sequence[str]) -> str:
    """Return a sentence of the library on an argument as one on the option that was typed."""
    name, must, _ = sentence.partition(" must ")
    option = f"--{name}"
    typed = any(word == option or word.startswith(f"{option}=") for word in words)
    return f"--{sentence}" if must and typed else sentence


def _leave_nothing_to_write() -> None:
    """Empty the standard output, so that Python does not complain again where it is closed."""
    try:
        if sys.stdout is sys.__stdout__ and sys.stdout is not None:
            sys.stdout.flush()
    except (OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        with suppress(OSError, ValueError):
            os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


class _Signals:
    """Signals that end the work: raised as `SystemExit`, and sent again where that is lost.

    Python reports exceptions of destructors and of some C code by `sys.unraisablehook`, and
    continues without them. Libraries import optional modules, and continue after any exception, so
    that a signal waits until no module is being imported.
    """

    def __init__(self) -> None:
        """Begin without signals."""
        self.received: list[int] = []
        self.report = sys.unraisablehook
        self._reporting = self._watches = self._closed = False
        # Times by the clock of this process (s): of the first signal, and when one is sent again.
        self._first = self._again = math.inf

    def end(self, number: int, frame: FrameType | None) -> None:
        """Raise `SystemExit` on a signal, but not where it would be lost: then it is sent again."""
        now, imports = time.monotonic(), _is_importing(frame)
        self.received.append(number)
        self._first = min(self._first, now)
        if self._reporting or (imports and now < self._first + _LONGEST_IMPORT):
            self._send_again_from(now)
            return
        self._again = math.inf
        if imports:
            self._send_again_from(now + _LONGEST_IMPORT)
        raise SystemExit(128 + number)

    def unraisable(self, lost: Any) -> None:
        """Send a signal again whose exception was lost, or that comes now; report all else."""
        self._reporting, before = True, len(self.received)
        of_signal = bool(self.received) and isinstance(lost.exc_value, SystemExit)
        if not of_signal:
            self.report(lost)
        if of_signal or len(self.received) > before:
            self._send_again_from(time.monotonic())
        self._reporting = False

    def _send_again_from(self, when: float) -> None:
        """Send the last signal again from a time (s) on, until it is raised."""
        self._again = when
        if not self._watches:
            self._watches = True
            begun(self._watch)

    def _watch(self) -> None:
        while not self._closed:
            time.sleep(_AGAIN_EVERY)
            if time.monotonic() >= self._again and not self._closed:
                os.kill(os.getpid(), self.received[-1])

    def close(self) -> None:
        """Send nothing again."""
        self._closed = True


def _is_importing(frame: FrameType | None) -> bool:
    """Return whether a frame or one of its callers belongs to an import that has not ended."""
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORT):
            return True
        frame = frame.f_back
    return False


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Let SIGTERM, SIGHUP and Ctrl-C end the work within, with everything put away.

    A signal that is ignored, as by nohup, stays ignored.
    """
    signals = _Signals()
    received = signals.received
    sys.unraisablehook = signals.unraisable
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for name in ("SIGTERM", "SIGHUP", "SIGINT"):
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, signals.end)
    try:
        yield
        if received:
            raise SystemExit(128 + received[-1])
    except Exception as error:
        # A library may turn the exception of a signal into an error of its own.
        if received:
            raise SystemExit(128 + received[-1]) from error
        raise
    finally:
        signals.close()
        sys.unraisablehook = signals.report
        for number, handler in before.items():
            signal.signal(number, handler)


def usage_sentence(error: Any, words: Sequence[str]) -> str:
    """Return the fault of a command line, in one sentence."""
    context, parameter = getattr(error, "ctx", None), getattr(error, "param", None)
    option = getattr(error, "option_name", None)
    command = context.command_path if context is not None else "twolink"
    message, hint = one_line(error.format_message()).rstrip("."), f"see `{command} --help`"
    if type(error).__name__ == "NoSuchOption" and context is not None:
        known = [word for each in context.command.get_params(context) for word in each.opts]
        return choice(f"an option of `{command}`", option, known)
    if type(error).__name__ == "MissingParameter" and parameter is not None:
        return f"{_named(parameter)} is missing; {hint}"
    if parameter is not None:
        return _bad_value(parameter, error.message, words)
    given = [word for word in words if not word.startswith("-")]
    # `twolink urdf shw`: the groups come before the unknown name.
    depth = len(command.split()) - 1
    if type(error).__name__ == "NoArgsIsHelpError" and context is not None:
        names = ", ".join(context.command.commands)
        return f"`{command}` must have a command, one of {names}; {hint}"
    if "No such command" in message and given[depth:] and context is not None:
        return choice("the command", given[depth], context.command.commands)
    return f"{message}; {hint}"


def _bad_value(parameter: Any, message: str, words: Sequence[str]) -> str:
    """Return the sentence that an option's value is of another type."""
    name = _named(parameter)
    wrong, of_names, names = message.rpartition(" is not one of ")
    in_message = re.search(r"'(.*)'", wrong if of_names else message)
    received = _received(parameter, words) or (in_message[1] if in_message else "")
    if of_names:
        return choice(name, received, re.findall(r"'([^']+)'", names))
    received = quoted(received)
    for word, noun in (
        ("integer", "a whole number"),
        ("number", "a number"),
        ("float", "a number"),
    ):
        if word in message:
            return f"{name} must be {noun}; got {received}"
    return f"{name} is {received}: {one_line(message)}"


def _received(parameter: Any, words: Sequence[str]) -> str:
    """Return the value that an option has on a command line; the last one counts."""
    found = ""
    if not parameter.opts[0].startswith("-"):
        # An argument has no name before it on the command line.
        return found
    for word, following in pairwise([*words, ""]):
        for option in parameter.opts:
            if word == option:
                found = following
            elif word.startswith(f"{option}="):
                found = word.removeprefix(f"{option}=")
    return found


def _named(parameter: Any) -> str:
    """Return an option as it is typed, or an argument as the help names it."""
    option = parameter.opts[0]
    return option if option.startswith("-") else parameter.metavar or option.upper()
