"""Long calls that Ctrl-C ends at once: they run in threads, and the caller waits beside them.

A step in hundreds of digits is one call of compiled code, which takes up to minutes and answers no
signal. The caller answers signals, and abandons the call without using its result.
"""

from __future__ import annotations

import functools
import gc
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from threading import Event, Thread, get_native_id
from time import monotonic
from typing import Any, NoReturn
from weakref import WeakSet

# Time (s) between two checks for signals.
_WAIT = 0.05

# Time (s) in which a function ends after another has failed, unless it is in a very long call.
_ENDING = 10.0


# Threads that were begun here, as long as they exist, and their numbers in the system.
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

    threads: list[Thread] = []
    try:
        for k in range(len(functions)):
            threads.append(begun(functools.partial(call, k)))
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


def begun(work: Callable[[], object], name: str | None = None) -> Thread:
    """Return a new thread that does some work, and does not keep the process from ending.

    Raises `RuntimeError` if no thread can be started.
    """

    def counted() -> None:
        _NUMBERS.add(get_native_id())
        work()

    thread = Thread(target=counted, name=name, daemon=True)
    # Before it is started: a signal may end the caller at any moment from then on.
    _THREADS.add(thread)
    try:
        thread.start()
    except RuntimeError:
        _THREADS.discard(thread)
        raise
    return thread


def end_process(code: Any) -> NoReturn:
    """End the process with an exit code, even if threads that were begun here still work.

    At its end the interpreter ends such threads; inside compiled code, or while they end by
    themselves, this aborts the process. Where there are any, the process ends without the
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
    """Return whether a thread that was begun here still exists.

    Python's threads are not alive yet while the system begins them, and not any more while it
    ends them.
    """
    if any(thread.ident is None or thread.is_alive() for thread in _THREADS):
        return True
    # On Linux; elsewhere there is no such folder.
    return any(os.path.exists(f"/proc/self/task/{number}") for number in _NUMBERS)
