"""Run hard cases in parallel on the machine's cores: one work item is a case with all columns."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager

from twolink.engines.sandbox import end_with_caller
from twolink.hardcases.catalogue import case_named
from twolink.hardcases.record import Case, Column, Outcome
from twolink.hardcases.run import columns as columns_named
from twolink.hardcases.run import scoreboard

Board = dict[str, dict[str, Outcome]]
Progress = Callable[[int, tuple[str, ...]], None]

# A case may use 4 GB, and a worker takes a second to start.
_MOST_WORKERS = 8


def parallel_scoreboard(
    cases: Sequence[Case], columns: Sequence[Column], progress: Progress | None = None
) -> Board:
    """Return the outcome of each case of the catalogue (by name) in each column (by name).

    `progress` is called with the number of finished cases and the names of running ones. A worker
    runs a case with all its columns, which share the reference. An interrupt stops all workers.
    """
    workers = min(os.cpu_count() or 1, len(cases), _MOST_WORKERS)
    waiting = [case.name for case in cases]
    names = tuple(column.name for column in columns)
    running: dict[Future[dict[str, Outcome]], str] = {}
    found: Board = {}
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, _begin) as pool:
        try:
            while waiting or running:
                while waiting and len(running) < workers:
                    name = waiting.pop(0)
                    with _uninterrupted():
                        running[pool.submit(_row, name, names)] = name
                if progress is not None:
                    progress(len(found), tuple(running.values()))
                for done in wait(running, return_when=FIRST_COMPLETED).done:
                    found[running.pop(done)] = done.result()
        except BaseException:
            for process in multiprocessing.active_children():
                os.kill(process.pid or 0, signal.SIGINT)
            pool.shutdown(cancel_futures=True)
            raise
    return {case.name: found[case.name] for case in cases}


def _row(name: str, columns: tuple[str, ...]) -> dict[str, Outcome]:
    """Return the outcome of a case in each column; runs in a worker."""
    # Clean up an engine's process and folder on exit.
    signal.signal(signal.SIGINT, _give_up)
    try:
        return scoreboard([case_named(name)], columns_named(columns))[name]
    finally:
        signal.signal(signal.SIGINT, _leave)


def _begin() -> None:
    """Let a worker end silently on an interrupt, and together with its parent process."""
    end_with_caller()
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
