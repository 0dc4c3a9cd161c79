"""The command `twolink sweep`."""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twolink.cli.limits import Force, limits_of
from twolink.cli.progress import progress_bar
from twolink.cli.terminal import (
    check_folder,
    check_target,
    console,
    print_table,
    refuse,
    say,
)
from twolink.suffixes import MAPS
from twolink.text import either, one_line, quoted

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from twolink.ensembles.ensemble import Ensemble
    from twolink.ensembles.results import Results

_SUFFIX, _PAGE = ".zarr", ".html"


def _print_schema(asked: bool) -> None:
    if asked:
        from twolink.ensembles.file import sweep_schema

        say(json.dumps(sweep_schema(), indent=2))
        raise typer.Exit()


_File = Annotated[
    Path,
    typer.Argument(
        metavar="SWEEP",
        help="A TOML file with a scene, the numbers of it that vary and their values, and the "
        "results to keep; see docs/from_one_run_to_a_cluster.md.",
    ),
]
_Out = Annotated[
    Path,
    typer.Option(
        help=f"The folder of the results (NAME{_SUFFIX}). Where it has results of this sweep, only "
        "the missing runs are made."
    ),
]
_Workers = Annotated[
    int | None, typer.Option(help="How many processes to use. Default: one for each core.")
]
_Dask = Annotated[
    str | None,
    typer.Option(
        help="Run on a Dask cluster: the address of its scheduler, such as tcp://host:8786, or "
        "'local' to start a cluster on this machine."
    ),
]
_Plot = Annotated[
    Path | None,
    typer.Option(
        help="Draw when the first condition that is kept, such as a flip, happens in each run, to "
        f"this {either(MAPS)} file: a map if two axes vary, otherwise the share of runs over time. "
        "In a .html page, a click on a pixel of the map shows the motion of its run."
    ),
]
_Schema = Annotated[
    bool,
    typer.Option(
        "--schema",
        callback=_print_schema,
        is_eager=True,
        help="Print the JSON schema of sweep files, for editors, and exit.",
    ),
]


def sweep(
    file: _File,
    out: _Out,
    workers: _Workers = None,
    dask: _Dask = None,
    plot: _Plot = None,
    force: Force = False,
    schema: _Schema = False,
) -> None:
    """Run many variants of a scene, and store their results.

    Where a sweep was interrupted, the same command continues it. Exit code 0: every run is done;
    the results have the reason of each run that failed. 1: the sweep could not be finished. 2: the
    input was refused.
    """
    _check_out(out)
    check_target("--plot", plot, MAPS, inputs=[file])
    if workers is not None and workers < 1:
        refuse(f"--workers must be a whole number of 1 or more; got {workers}")
    if workers is not None and dask is not None and dask != "local":
        refuse(
            f"--workers must be left out with a running cluster, which has its own; got {workers}"
        )
    from twolink.ensembles.file import load

    asked = load(file)
    if plot is not None:
        _check_picture(asked, plot)
    with _executor(dask, workers) as executor, _bar(asked) as progress:
        found = _swept(asked, out, executor, workers, progress, force)
    print_table(console(), found.summary())
    if plot is not None:
        _draw(found, plot)


def _check_picture(asked: Ensemble, plot: Path) -> None:
    """Refuse a picture of quantities that the sweep does not keep."""
    keep = asked.document["keep"]
    if not keep["first"]:
        refuse("--plot must be of a sweep that keeps first times ([keep] first); got one without")
    if plot.suffix != _PAGE:
        return
    if not keep["samples"]:
        refuse(f"--plot must be of a sweep that keeps samples for a {_PAGE} page; got one without")
    if asked.runs.draws > 1 or len(asked.runs.varied) != 2:
        refuse(f"--plot must be of a sweep over two axes for a {_PAGE} page; got another")


def _draw(found: Results, plot: Path) -> None:
    if plot.suffix == _PAGE:
        from twolink.viz.report.map import map_page
        from twolink.viz.report.page import write

        write(plot, map_page(found))
        return
    from twolink.viz.plots.ensemble import ensemble_plot
    from twolink.viz.plots.style import save

    save(ensemble_plot(found), plot)


def _swept(
    asked: Ensemble,
    out: Path,
    executor: Executor | None,
    workers: int | None,
    progress: Callable[[int, int], None],
    force: bool,
) -> Results:
    from twolink.ensembles.run import sweep as run_sweep

    return run_sweep(
        asked,
        out,
        executor=executor,
        workers=workers if executor is None else None,
        progress=progress,
        limits=limits_of(force),
    )


def _check_out(out: Path) -> None:
    """Refuse a folder in which a store cannot be made."""
    if out.suffix != _SUFFIX:
        refuse(f"--out must be a {_SUFFIX} folder; got {one_line(out, 300)}")
    if not out.absolute().parent.is_dir():
        refuse(f"--out must be in a folder that exists; got {one_line(out, 300)}")
    check_folder("--out", out)


@contextmanager
def _executor(dask: str | None, workers: int | None) -> Iterator[Executor | None]:
    """Yield the executor of a Dask cluster, or None where none was asked for."""
    if dask is None:
        yield None
        return
    from twolink.optional import distributed

    module: Any = distributed()
    if dask == "local":
        with (
            # A worker that is busy while the cluster closes would log a failed heartbeat.
            module.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                dashboard_address=None,
                silence_logs=logging.CRITICAL,
            ) as cluster,
            module.Client(cluster) as client,
        ):
            yield client.get_executor()
        return
    try:
        client = module.Client(dask, timeout="10s")
    except (OSError, ValueError) as error:
        known = "local or the address of a scheduler that answers"
        refuse(f"--dask must be {known}; got {quoted(dask)} ({one_line(error, 300)})")
    with client:
        yield client.get_executor()


@contextmanager
def _bar(asked: Ensemble) -> Iterator[Callable[[int, int], None]]:
    """Show a bar with the rate of runs, the load of the machine and the time left."""
    from time import monotonic

    with progress_bar() as bar:
        task = bar.add_task(asked.title, total=asked.runs.count)
        begun: list[tuple[float, int]] = []

        def progress(done: int, count: int) -> None:
            begun[:] = begun or [(monotonic(), done)]
            spent, before = monotonic() - begun[0][0], begun[0][1]
            words = f"{asked.title}: {done} of {count} runs"
            if done > before and spent > 0:
                rate = (done - before) / spent
                words += f", {rate:.3g} a second, {_left((count - done) / rate)} left"
            words += f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
            bar.update(task, description=words, completed=done)

        yield progress


def _left(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}"
