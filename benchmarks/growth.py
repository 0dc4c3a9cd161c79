"""The cost and the memory of one whole sweep, in a process of its own with two worker processes.

python -m benchmarks.growth RUNS
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from benchmarks.throughput import asked
from twolink.ensembles.run import sweep

# Workers have memory of their own, which is measured too.
_WORKERS = 2


class Size(NamedTuple):
    """A sweep: its runs, wall and processor time (s), and peak memory of processes (MB)."""

    runs: int
    wall: float
    processor: float
    own: float
    worker: float

    def __str__(self) -> str:
        return (
            f"{self.runs:8d} runs {self.wall:8.1f} s {self.processor:8.1f} s of processors"
            f"  peak memory {self.own:4.0f} MB, largest worker {self.worker:4.0f} MB"
        )


def measured(runs: int) -> Size:
    """Return the cost of a sweep, measured in a new process."""
    command = [sys.executable, "-m", "benchmarks.growth", "--one", str(runs)]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    return Size(*json.loads(found.stdout))


def growing(largest: int, plot: Path | None) -> Iterator[str]:
    """Yield the lines of sweeps of 100 runs, ten times as many and so on, and draw the costs."""
    sizes, count = [], 100
    while count <= largest:
        sizes.append(measured(count))
        yield f"{sizes[-1]}{_further(sizes)}"
        count *= 10
    if plot is not None and sizes:
        plotted(sizes, plot)


def _further(sizes: list[Size]) -> str:
    """Return the cost of each run that the last size has more than the one before, in words."""
    if len(sizes) < 2:
        return ""
    before, last = sizes[-2:]
    each = (last.processor - before.processor) / (last.runs - before.runs)
    return f"   {each * 1e6:6.0f} µs for each further run"


def plotted(sizes: list[Size], path: Path) -> None:
    """Draw the processor time and the peak memory over the number of runs to a file."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    cost, memory = figure.subplots(1, 2)
    runs, last = [size.runs for size in sizes], sizes[-1]
    cost.loglog(runs, [size.processor for size in sizes], "o-", label="whole sweep")
    # Imports, workers and compilation: the cost of the smallest sweep, nearly.
    beyond = [size.processor - sizes[0].processor for size in sizes[1:]]
    cost.loglog(runs[1:], beyond, "s-", label="beyond the smallest sweep")
    line = [beyond[-1] * count / last.runs for count in runs[1:]] if beyond else []
    cost.loglog(runs[1:], line, "--", color="0.5", label="proportional to the number of runs")
    cost.set(xlabel="runs", ylabel="processor time, s")
    # Room for the legend.
    cost.set_ylim(top=30 * last.processor)
    cost.legend(loc="upper left")
    memory.semilogx(runs, [size.own for size in sizes], "o-", label="the command")
    memory.semilogx(runs, [size.worker for size in sizes], "s-", label="its largest worker")
    memory.set(xlabel="runs", ylabel="peak memory (RSS), MB")
    memory.set_ylim(0, 1.1 * max(max(size.own, size.worker) for size in sizes))
    memory.legend()
    figure.savefig(path)


def _one(runs: int) -> Size:
    """Make a sweep here, and return its cost."""
    begin, workers = perf_counter(), _Workers()
    with tempfile.TemporaryDirectory() as folder, workers:
        sweep(asked(runs, {"final": True}), Path(folder) / "a.zarr", workers=_WORKERS)
    wall = perf_counter() - begin
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    spent = sum(each.ru_utime + each.ru_stime for each in used)
    return Size(runs, wall, spent, _peak("self"), workers.largest)


class _Workers:
    """The largest peak memory (MB) of any child process during a `with` statement.

    The kernel keeps the peak of each; it is read often, and for the last time before a worker ends.
    `getrusage` does not serve: a new process inherits the peak of the one that starts it.
    """

    largest = 0.0

    def __enter__(self) -> None:
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch)
        self._thread.start()

    def __exit__(self, *exception: object) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(_PERIOD):
            for child in multiprocessing.active_children():
                self.largest = max(self.largest, _peak(str(child.pid)))


# Between two readings of the memory of workers (s).
_PERIOD = 0.05


def _peak(process: str) -> float:
    """Return the peak memory (MB) of a process, or 0 if it has ended."""
    try:
        lines = Path("/proc", process, "status").read_text().splitlines()
    except OSError:
        return 0.0
    return next((int(x.split()[1]) / 1024 for x in lines if x.startswith("VmHWM")), 0.0)


def main() -> None:
    """Measure, and print the results."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.growth", description=__doc__)
    parser.add_argument("--runs", type=int, default=100_000, help="of the largest sweep")
    parser.add_argument("--plot", type=Path, help="a picture of the cost of more and more runs")
    parser.add_argument("--one", type=int, help="make a sweep of so many runs here")
    options = parser.parse_args()
    if options.one is not None:
        print(json.dumps(_one(options.one)))
        return
    for line in growing(options.runs, options.plot):
        print(line, flush=True)


if __name__ == "__main__":
    main()
