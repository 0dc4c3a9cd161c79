"""`sweep`: the runs of an ensemble into a store, begun or continued."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from twolink.ensembles.chunk import goes_in_lanes
from twolink.ensembles.compiled import LANES
from twolink.ensembles.ensemble import Ensemble
from twolink.ensembles.executing import Task, Written, write_chunks
from twolink.ensembles.file import ensemble_of, is_described, load
from twolink.ensembles.results import Results
from twolink.ensembles.store import created, in_use, opened
from twolink.inputs import as_count, as_path, check_callback, check_instance, refuse
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.optional import heyoka, xarray, zarr

# Runs of a chunk: so many that files and starts cost little, and so few that a killed worker loses
# little and that all workers are busy to the end.
_IN_LANES, _ALONE = 4096, 16

# Memory of the results of a chunk, unless a few runs have more.
_BYTES = 64_000_000

# Chunks for small ensembles, in lanes or one by one, so that several workers share them.
_SHARES_IN_LANES, _SHARES_ALONE = 8, 16


def sweep(
    ensemble: Ensemble | str | PathLike[str] | Mapping[str, Any],
    out: str | PathLike[str],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    chunk: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Results:
    """Make the runs of an ensemble, and return their results, which are in the folder `out`.

    `ensemble` may be a sweep file, or its tables. Where `out` has the results of the same sweep,
    only the runs that are missing are made, and those that a smaller limit has ended. `executor` is
    any of `concurrent.futures`, such as that of a Dask client, whose workers see the folder `out`
    under the same name; without one, so many processes are used as `workers` says, or as there are
    cores. `chunk` is the number of runs of a unit of work. `progress` receives the number of runs
    done, and of all. Each run that is not made in lanes respects `limits`.

    Bits depend on none of these, beside the runs that a limit ends. Raises `SceneError` for a file
    that is no sweep, `FileError` where results cannot be written, and `ParameterError` for invalid
    arguments.
    """
    asked, path = _ensemble(ensemble), as_path("out", out)
    _check(executor, progress, limits)
    workers = None if workers is None else as_count("workers", workers, 1)
    heyoka(), zarr(), xarray()
    size = _chunk(asked) if chunk is None else as_count("chunk", chunk, 1)
    store = opened(path, asked) if _exists(path) else created(path, asked, size)
    with in_use(path):
        done = store.reopened(limits)
        made = int(np.diff([store.runs(number) for number in np.flatnonzero(done).tolist()]).sum())

        def note(written: Written) -> None:
            nonlocal made
            made += written.runs
            if progress is not None:
                progress(made, store.count)

        if progress is not None:
            progress(made, store.count)
        left = [int(number) for number in np.flatnonzero(~done)]
        task = Task(asked, str(path.absolute()), store.chunk, limits)
        if left:
            write_chunks(task, left, note, executor, workers)
    return Results(path)


def _ensemble(given: Any) -> Ensemble:
    """Return an ensemble, of a file or of tables."""
    if isinstance(given, Ensemble):
        # Results are named, and continued, by the document.
        if not is_described(given):
            refuse("ensemble", given, "as its document describes it; change the tables, no fields")
        return given
    if isinstance(given, Mapping):
        return ensemble_of(dict(given), "<dict>", Path())
    if isinstance(given, (str, PathLike)):
        return load(given)
    refuse("ensemble", given, "an Ensemble, a sweep file, or its tables")


def _check(executor: Any, progress: Any, limits: Any) -> None:
    """Raise `ParameterError` for arguments of another kind."""
    if executor is not None and not callable(getattr(executor, "submit", None)):
        refuse("executor", executor, "one of concurrent.futures, or None")
    check_callback("progress", progress, ("done", "count"))
    check_instance("limits", limits, Limits)


def _chunk(ensemble: Ensemble) -> int:
    """Return the number of runs of a chunk."""
    count = ensemble.runs.count
    if not goes_in_lanes(ensemble):
        return max(1, min(_ALONE, -(-count // _SHARES_ALONE)))
    size = sum(variable.empty(1).nbytes for variable in ensemble.variables)
    share = min(_IN_LANES, -(-count // _SHARES_IN_LANES), _BYTES // size)
    return max(1, -(-share // LANES)) * LANES


def _exists(path: Path) -> bool:
    try:
        return path.exists() or path.is_symlink()
    except (OSError, ValueError):
        # It cannot be the name of a file: the open that follows raises the error.
        return False
