"""Long calls that Ctrl-C ends at once: they run in threads, and the caller waits beside them.

A step in hundreds of digits is one call of compiled code, which takes up to minutes and answers no
signal. The caller answers signals, and abandons the call without using its result.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from threading import Event, Thread
from time import monotonic
from typing import Any, NoReturn
from weakref import WeakSet

# Time (s) between two checks for signals.
_WAIT = 0.05

# Time (s) in which a function ends after another has failed, unless it is in a very long call.
_ENDING = 10.0


# Threads that are used here, as long as they exist, and their numbers in the system.
_THREADS: WeakSet[Thread] = WeakSet()
_NUMBERS: set[int] = set()


class AbandonedError(BaseException):
    """The call was abandoned: its result is no longer needed."""


def side_by_side(*functions: Callable[[Callable[[], None]], Any]) -> list[Any]:
    """Return the results of functions, each called in a thread of its own.

    A function takes a callable that it calls now and then, which ends it if the caller was
    interrupted, or another function has failed. Raises the first error of any of them, once the
    others have ended: the interpreter aborts the process if it ends while they compute.
    """
    ended = Event()
    results: list[Any] = [None] * len(functions)
    errors: list[BaseException] = []

    def go_on() -> None:
        if ended.is_set():
            raise AbandonedError

    def call(number: int) -> None:
        try:
            results[number] = functions[number](go_on)
        except AbandonedError:
            pass
        except BaseException as error:
            errors.append(error)
            ended.set()

    # A thread that is left to itself does not keep the interpreter from ending.
    threads = [Thread(target=call, args=(k,), daemon=True) for k in range(len(functions))]
    try:
        for thread in threads:
            _THREADS.add(thread)
            thread.start()
            _NUMBERS.add(thread.native_id or 0)
        while not errors and any(thread.is_alive() for thread in threads):
            for thread in threads:
                thread.join(_WAIT)
        _await_end(threads)
    finally:
        ended.set()
    if errors:
        raise errors[0]
    return results


def _await_end(threads: Sequence[Thread]) -> None:
    """Wait until threads that are to end have ended, but not for very long calls."""
    until = monotonic() + _ENDING
    while any(thread.is_alive() for thread in threads) and monotonic() < until:
        for thread in threads:
            thread.join(_WAIT)


def abandon(thread: Thread, wait: float) -> None:
    """Leave a thread to itself that does not end within a time (s), or before an interrupt."""
    _THREADS.add(thread)
    _NUMBERS.add(thread.native_id or 0)
    thread.join(wait)


def end_process(code: Any) -> NoReturn:
    """End the process with an exit code, even if calls that were abandoned still compute.

    At its end the interpreter ends the threads of such calls; inside compiled code, or while they
    end by themselves, this aborts the process. Where there are any, the process ends without the
    interpreter's last steps. Elsewhere it does not search for garbage, which the system takes back.
    """
    if isinstance(code, int) and _any_left():
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError, AttributeError):
                stream.flush()
        os._exit(code)
    gc.freeze()
    sys.exit(code)


def _any_left() -> bool:
    """Return whether a thread that was used here still exists.

    Python's threads are not alive any more while the system still ends them.
    """
    if any(thread.is_alive() for thread in _THREADS):
        return True
    # On Linux; elsewhere there is no such folder.
    return any(os.path.exists(f"/proc/self/task/{number}") for number in _NUMBERS)
