"""Run hard cases in parallel on the machine's cores: one work item is a case with all columns."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait

from twolink.hardcases.catalogue import case_named
from twolink.hardcases.record import Case, Column, Outcome
from twolink.hardcases.run import columns as columns_named
from twolink.hardcases.run import scoreboard
from twolink.workers import given_up_on_interrupt, worker_processes

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
    with worker_processes(workers) as pool:
        while waiting or running:
            while waiting and len(running) < workers:
                name = waiting.pop(0)
                running[pool.submit(_row, name, names)] = name
            if progress is not None:
                progress(len(found), tuple(running.values()))
            for done in wait(running, return_when=FIRST_COMPLETED).done:
                found[running.pop(done)] = done.result()
    return {case.name: found[case.name] for case in cases}


def _row(name: str, columns: tuple[str, ...]) -> dict[str, Outcome]:
    """Return the outcome of a case in each column; runs in a worker."""
    # Clean up an engine's process and folder on exit.
    with given_up_on_interrupt():
        return scoreboard([case_named(name)], columns_named(columns))[name]
