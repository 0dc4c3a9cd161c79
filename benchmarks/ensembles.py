"""The cost of sweeps: its parts, beside other programs, and for ten times as many runs.

    python -m benchmarks.ensembles [--starts 64] [--quantile 0.5] [--runs 100000] [--plot a.svg]
    python -m benchmarks.ensembles --flips

All runs are `free_fall` from random poses over 10 s. First the parts of a sweep, in processor time
of one process, interleaved, the least of some rounds. Then trajectories per second at an equal
measured error (`benchmarks.throughput`); MuJoCo and diffrax are in the extra `engines`, and Warp is
`pip install warp-lang`. Last, whole sweeps of more and more runs in two worker processes, with
their peak memory. With `--flips` chunks of a map of 256 × 256 first flips, each time to 1e-6 s, are
compared with bare calls from the same starts, and nothing else is measured. It refuses to measure
on a machine that is busy, unless forced.
"""

from __future__ import annotations

import argparse
import functools
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benchmarks.growth import growing
from benchmarks.throughput import (
    ERROR,
    asked,
    bare,
    compared,
    propagated,
    references,
    starts,
    with_momenta,
    with_speeds,
)
from twolink.ensembles.chunk import Rows, rows_of
from twolink.ensembles.ensemble import Ensemble
from twolink.ensembles.file import ensemble_of
from twolink.ensembles.first_time import VERDICTS
from twolink.ensembles.store import created
from twolink.environment import load_of_machine

_ROUNDS = 5

# The order of a bare call of whose errors half are below 1e-6.
_MEDIAN = 13

# Runs by which the parts of a sweep and other fast methods are timed.
_MANY = 8192

# The pixels along each side of a map of flips, those of a chunk, and those whose error is measured.
_SIDE, _CHUNK, _FEW = 256, 4096, 64


def parts(count: int) -> Iterator[str]:
    """Yield the cost of bare calls, and that of sweeps and of their parts."""
    given = starts(count)
    momenta = with_momenta(given)
    final, flips = asked(count, {"final": True}), {"first": [{"name": "flip", "of": "either"}]}
    rows = rows_of(final, 0, count)
    calls: dict[str, Callable[[], Any]] = {
        f"bare call, order {order}": functools.partial(propagated, bare(order), momenta)
        for order in (_MEDIAN, 11, 15)
    }
    calls |= {
        "sweep, ends with errors": lambda: rows_of(final, 0, count),
        "  its store, written": lambda: _written(final, rows),
        "sweep, flips with bounds": lambda: rows_of(asked(count, flips), 0, count),
    }
    costs = _rounds(calls)
    first = costs[next(iter(costs))]
    for name, cost in costs.items():
        ratio = np.median(np.divide(cost, first))
        yield f"{name:38s} {min(cost) / count * 1e6:8.1f} µs a run   × {ratio:5.2f} of the first"
    met = (rows.arrays["error"] <= ERROR).mean()
    yield f"{met:.1%} of the ends of the sweep have a measured error of at most {ERROR:g}"


def flips() -> Iterator[str]:
    """Yield the cost of chunks of a map of first flips, and of bare calls from its starts."""
    pixels, chunks = _map(), range(_CHUNK, _SIDE**2, 4 * _CHUNK)
    values = np.concatenate([pixels.values(first, first + _CHUNK) for first in chunks])
    given = np.concatenate(pixels.family.starts(values))
    momenta = with_momenta(given)
    integrators = {f"bare call, order {order}": bare(order) for order in (11, 13, 15)}
    calls: dict[str, Callable[[], Any]] = {
        name: functools.partial(propagated, one, momenta) for name, one in integrators.items()
    }
    calls["map of flips"] = lambda: [rows_of(pixels, k, k + _CHUNK).arrays for k in chunks]
    costs, rows = _rounds(calls), calls["map of flips"]()
    verdicts, bounds, errors = (
        np.concatenate([each[name] for each in rows])
        for name in ("flip_verdict", "flip_bound", "error")
    )
    shares = {"map of flips": (errors <= ERROR).mean()}
    some = given[:, :: len(values) // _FEW]
    truth, _ = references(some)
    for name, one in integrators.items():
        apart = np.abs(with_speeds(propagated(one, with_momenta(some))) - truth).max(axis=0)
        shares[name] = (apart <= ERROR).mean()
    found = ", ".join(f"{(verdicts == k).sum()} {word}" for k, word in enumerate(VERDICTS))
    largest = np.nanmax(bounds)
    yield f"{len(values)} of {_SIDE} × {_SIDE} pixels: {found}; bounds up to {largest:.1e} s"
    for name, cost in costs.items():
        ratio = np.median(np.divide(costs["map of flips"], cost))
        yield (
            f"{name:24s} {min(cost) / len(values) * 1e6:8.1f} µs a run, least of {_ROUNDS};"
            f" the map costs × {ratio:5.2f}, median; errors below {ERROR:g}: {shares[name]:.0%}"
        )


def _map() -> Ensemble:
    """Return the sweep of a map of the first flips of either link."""
    grid = {"first": -1.5, "last": 4.6, "count": _SIDE}
    axes = [{"parameter": f"start.q.{k}", "grid": grid} for k in (0, 1)]
    keep = {"first": [{"name": "flip", "of": "either", "within": ERROR}]}
    document = {"scene": "free_fall", "axes": axes, "runs": {"accuracy": ERROR}, "keep": keep}
    return ensemble_of(document, "<benchmark>", Path())


def _rounds(calls: dict[str, Callable[[], Any]]) -> dict[str, list[float]]:
    """Return the processor times of calls (s), made in turn, in each round."""
    found: dict[str, list[float]] = {name: [] for name in calls}
    for call in calls.values():
        call()
    for _ in range(_ROUNDS):
        for name, call in calls.items():
            start = process_time()
            call()
            found[name].append(process_time() - start)
    return found


def _written(ensemble: Ensemble, rows: Rows) -> None:
    """Write rows to a new store."""
    with tempfile.TemporaryDirectory() as folder:
        created(Path(folder) / "a.zarr", ensemble, len(rows.reasons)).write(0, rows)


def main() -> None:
    """Measure, and print the results."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.ensembles", description=__doc__)
    parser.add_argument("--starts", type=int, default=64, help="starts whose errors are compared")
    parser.add_argument("--quantile", type=float, default=0.5, help="of errors that must suffice")
    parser.add_argument("--runs", type=int, default=100_000, help="of the largest sweep")
    parser.add_argument("--plot", type=Path, help="a picture of the cost of more and more runs")
    parser.add_argument("--flips", action="store_true", help="measure a map of flips, only")
    parser.add_argument("--force", action="store_true", help="measure on a busy machine")
    options = parser.parse_args()
    _print_load(options.force)
    if options.flips:
        for line in flips():
            print(line, flush=True)
        return
    for line in parts(_MANY):
        print(line, flush=True)
    print()
    for line in compared(options.starts, _MANY, options.quantile):
        print(line, flush=True)
    print()
    for line in growing(options.runs, options.plot):
        print(line, flush=True)


def _print_load(force: bool) -> None:
    """Print the load, and end the program on a busy machine, unless forced."""
    load = load_of_machine()
    print(f"load {load}", flush=True)
    if load is not None and load.busy and not force:
        sys.exit(
            f"the load must be at most {load.most:g}; got {load.average:.2f} (--force measures)"
        )


if __name__ == "__main__":
    main()
