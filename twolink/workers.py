"""Worker processes: started afresh, silent on interrupts, and never left behind."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from typing import Any


class _Pool(ProcessPoolExecutor):
    """Processes that an interrupt of this one reaches only when they are ready for it."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **named: Any) -> Future[Any]:
        """Schedule a call; processes are started here."""
        with _uninterrupted():
            return super().submit(function, *args, **named)


@contextmanager
def worker_processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """Yield an executor of so many processes, which an interrupt or an error stops at once.

    A worker begins by importing the script that starts it. A script that starts workers wherever it
    is imported ends that worker in silence, and breaks the pool.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(1)
    context = multiprocessing.get_context("spawn")
    with _Pool(count, context, _begin) as pool:
        try:
            yield pool
        except BaseException:
            for process in multiprocessing.active_children():
                # A process may end by itself at this moment.
                with suppress(ProcessLookupError):
                    if process.pid is not None:
                        os.kill(process.pid, signal.SIGINT)
            pool.shutdown(cancel_futures=True)
            raise


@contextmanager
def given_up_on_interrupt() -> Iterator[None]:
    """Let an interrupt of a worker raise `SystemExit` in the block, so that it is put in order."""
    signal.signal(signal.SIGINT, _give_up)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, _leave)


def _begin() -> None:
    """Let a worker end silently on an interrupt, and together with its parent process."""
    _end_with_caller()
    signal.signal(signal.SIGINT, _leave)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _give_up(number: int, frame: object) -> None:
    raise SystemExit(128 + number)


def _leave(number: int, frame: object) -> None:
    os._exit(128 + number)


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Block SIGINT in the block, inherited by started processes until they are ready for it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with_caller() -> None:
    """Kill this process when its parent ends (on Linux)."""
    if sys.platform == "linux":
        import ctypes

        # PR_SET_PDEATHSIG
        ctypes.CDLL(None).prctl(1, int(signal.SIGKILL))
        caller = multiprocessing.parent_process()
        if caller is not None and os.getppid() != caller.pid:
            # The parent ended before the signal was requested.
            os._exit(1)
