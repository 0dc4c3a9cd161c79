"""Execution of chunks by any executor of `concurrent.futures`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from twolink.ensembles.chunk import rows_of
from twolink.ensembles.ensemble import Ensemble
from twolink.ensembles.store import Store
from twolink.errors import IntegrationError, TwolinkError
from twolink.limits import Limits
from twolink.text import one_line
from twolink.workers import worker_processes

# Chunks that wait at an executor: far more than it has workers, and few enough to be cancelled.
_WAITING = 512

# Times that processes are started again after one was killed.
_ATTEMPTS = 3


class Written(NamedTuple):
    """A chunk that was written: its number, its runs, and how many of them failed."""

    number: int
    runs: int
    failed: int


Progress = Callable[[Written], None]


class Task(NamedTuple):
    """The work of one worker: the ensemble, and the place of its results."""

    ensemble: Ensemble
    path: str
    chunk: int
    limits: Limits

    def write(self, number: int) -> Written:
        """Make the runs of a chunk and write them; runs in a worker."""
        store = Store(Path(self.path), self.ensemble.runs.count, self.chunk)
        first, last = store.runs(number)
        rows = rows_of(self.ensemble, first, last, self.limits)
        store.write(number, rows)
        return Written(number, last - first, sum(map(bool, rows.reasons)))


class _Here(Executor):
    """An executor that makes each call at once, in this thread."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **named: Any) -> Future[Any]:
        """Make a call, and return its result or its error."""
        made: Future[Any] = Future()
        try:
            made.set_result(function(*args, **named))
        except Exception as error:
            made.set_exception(error)
        return made


def write_chunks(
    task: Task,
    numbers: Sequence[int],
    progress: Progress,
    executor: Executor | None = None,
    workers: int | None = None,
) -> None:
    """Make and write chunks, over an executor or over processes on so many cores.

    Raises the first error of a worker. A process that is killed loses its chunk, which is made
    again; other executors must do so themselves.
    """
    if executor is not None:
        _over(executor, task, numbers, progress, _WAITING)
        return
    count = min(workers or _cores(), len(numbers))
    left = list(numbers)
    if count <= 1:
        _over(_Here(), task, left, progress, 1)
        return

    def noted(written: Written) -> None:
        left.remove(written.number)
        progress(written)

    for attempt in range(_ATTEMPTS):
        try:
            with worker_processes(count) as pool:
                _over(pool, task, tuple(left), noted, 2 * count)
            return
        except BrokenProcessPool as error:
            if attempt == _ATTEMPTS - 1:
                raise IntegrationError(
                    "the workers of the sweep must start, for which a script calls `sweep` below"
                    ' `if __name__ == "__main__":`, and must not be killed, as a system does that'
                    f" is out of memory; got {_ATTEMPTS} that ended: finished chunks are kept, and"
                    " the same call continues"
                ) from error


def _over(
    executor: Executor, task: Task, numbers: Sequence[int], progress: Progress, most: int
) -> None:
    """Make chunks over an executor, at most so many of them waiting or running at once."""
    ahead = iter(numbers)
    with _cancelled_at_the_end() as running:
        while True:
            while len(running) < most and (number := next(ahead, None)) is not None:
                running.add(executor.submit(task.write, number))
            if not running:
                return
            done = wait(running, return_when=FIRST_COMPLETED).done
            for future in done:
                running.remove(future)
                progress(_result(future))


def _result(future: Future[Written]) -> Written:
    """Return a chunk that was written.

    Raises the error of the library that ended it, or `IntegrationError` for one of its executor.
    """
    try:
        return future.result()
    except (TwolinkError, BrokenProcessPool, MemoryError):
        raise
    except Exception as error:
        words = one_line(f"{type(error).__name__}: {error}", 300)
        raise IntegrationError(
            "a worker of the sweep must finish its chunk, or its executor must give it to another;"
            f" got {words}: finished chunks are kept, and the same command continues"
        ) from error


@contextmanager
def _cancelled_at_the_end() -> Iterator[set[Future[Written]]]:
    """Yield a set of futures, of which those that are left at the end are cancelled."""
    running: set[Future[Written]] = set()
    try:
        yield running
    finally:
        for future in running:
            future.cancel()


def _cores() -> int:
    """Return the number of cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1
