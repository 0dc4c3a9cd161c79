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
    SCENE,
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
from twolink.ensembles.compiled import LANES, System
from twolink.ensembles.ending import PLACES, Ending
from twolink.ensembles.ensemble import Ensemble
from twolink.ensembles.file import ensemble_of
from twolink.ensembles.first_time import VERDICTS
from twolink.ensembles.motions import WIDTH
from twolink.ensembles.store import created
from twolink.environment import load_of_machine
from twolink.simulation.smooth.judging import MORE_ORDERS

_ROUNDS = 5

# The order of a sweep to 1e-6.
_KEPT = 11

# Runs by which the parts of a sweep and other fast methods are timed.
_MANY = 8192

# The pixels along each side of a map of flips, those of a chunk, and those whose error is measured.
_SIDE, _CHUNK, _FEW = 256, 4096, 64


def parts(count: int) -> Iterator[str]:
    """Yield the cost of bare calls, of what a sweep adds to them one by one, and of sweeps."""
    given = with_momenta(starts(count))
    final, flips = asked(count, {"final": True}), {"first": [{"name": "flip", "of": "either"}]}
    orders = _KEPT, _KEPT + MORE_ORDERS, _KEPT + 2 * MORE_ORDERS
    one, judge, last = (bare(order) for order in orders)
    wide = bare(orders[0], LANES)
    again = given[:, _retried(count)]
    rows = rows_of(final, 0, count)
    sequence = np.argsort(_steps(one, given), kind="stable")
    calls: dict[str, Callable[[], Any]] = {
        f"bare call, order {orders[0]}, {WIDTH} lanes": lambda: propagated(one, given),
        f"  the same, {LANES} lanes": lambda: propagated(wide, given),
        "  through the places of the errors": lambda: _through_places(one, given),
        "  with a callback that does nothing": lambda: _with_callback(one, given, _nothing),
        "  with one that copies coefficients": lambda: _with_callback(one, given, _Copy(one)),
        "  with heyoka's continuous output": lambda: _with_callback(one, given, None),
        f"  the judge, order {orders[1]}": lambda: _through_places(judge, given),
        "  the judge, runs of like steps": lambda: _through_places(judge, given[:, sequence]),
        f"  order {orders[2]} for {again.shape[1] / count:.0%}": lambda: _through_places(
            last, again
        ),
        "sweep, ends with errors": lambda: rows_of(final, 0, count),
        "  its store, written": lambda: _written(final, rows),
        "sweep, flips with bounds": lambda: rows_of(asked(count, flips), 0, count),
    }
    costs = _least(calls)
    first = next(iter(costs.values()))
    for name, cost in costs.items():
        yield f"{name:44s} {cost / count * 1e6:8.1f} µs a run   × {cost / first:5.2f} of the first"


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


def _least(calls: dict[str, Callable[[], Any]]) -> dict[str, float]:
    """Return the least processor time of calls (s), made in turn."""
    return {name: min(costs) for name, costs in _rounds(calls).items()}


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


def _retried(count: int) -> Any:
    """Return which runs the first pair of orders leaves above the accuracy, shape (n,)."""
    given, none = starts(count), np.zeros((0, count))
    system = System(SCENE.moving_chain, SCENE.effects, ())
    lanes = system.lanes(none, given[:2], given[2:], SCENE.duration)
    ends, lost, _ = Ending.at_the_start(system, lanes, none).ends(_KEPT)
    return (ends.errors > ERROR) & ~lost


def _steps(integrator: Any, given: Any) -> Any:
    """Return the numbers of steps of runs, shape (n,)."""
    found = np.empty(given.shape[1])
    for k in range(0, given.shape[1], WIDTH):
        propagated(integrator, given[:, k : k + WIDTH])
        found[k : k + WIDTH] = [result[3] for result in integrator.propagate_res]
    return found


def _through_places(integrator: Any, given: Any) -> None:
    """Propagate through the times at which a sweep measures its errors."""
    times = np.repeat(np.linspace(0.0, SCENE.duration, PLACES + 1)[:, None], WIDTH, axis=1)
    for k in range(0, given.shape[1], WIDTH):
        count = given[:, k : k + WIDTH].shape[1]
        integrator.state[:, :count] = given[:, k : k + WIDTH]
        integrator.set_time(0.0)
        integrator.propagate_grid(times)


def _with_callback(integrator: Any, given: Any, callback: Any) -> None:
    """Propagate with the least that an estimate from the steps themselves needs."""
    for k in range(0, given.shape[1], WIDTH):
        integrator.state[:] = given[:, k : k + WIDTH]
        integrator.set_time(0.0)
        if callback is None:
            integrator.propagate_until(SCENE.duration, c_output=True)
        else:
            integrator.propagate_until(SCENE.duration, callback=callback, write_tc=True)


def _nothing(_: Any) -> bool:
    return True


class _Copy:
    """A callback that copies the coefficients of a step."""

    def __init__(self, integrator: Any) -> None:
        self._from, self._to = integrator.tc, np.empty_like(integrator.tc)

    def __call__(self, _: Any) -> bool:
        self._to[:] = self._from
        return True


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
