"""The cost of a sweep: beside heyoka's bare batch calls, and for ten times as many runs.

    python -m benchmarks.ensembles [--runs 4096] [--largest 100000] [--force]

All figures are processor time of one process, for runs of `free_fall` from random poses over 10 s.
A bare call sets the starts and propagates them to the end: it measures no error, and keeps nothing.
It refuses to measure on a machine that is busy, unless forced.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from twolink.ensembles.chunk import rows_of
from twolink.ensembles.compiled import FORMULATION, LANES
from twolink.ensembles.ensemble import Ensemble
from twolink.ensembles.file import ensemble_of
from twolink.ensembles.run import sweep
from twolink.integration.precisions import PRECISIONS
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.measure import MORE_ORDERS

_REPETITIONS = 5

# Above this load for each core timings are those of other programs.
_BUSY = 0.5

# The orders of heyoka's own double precision, and of a sweep to 1e-6.
_OF_HEYOKA, _KEPT = 20, 11


def asked(count: int, keep: dict[str, Any], accuracy: float = 1e-6) -> Ensemble:
    """Return a sweep of random poses."""
    around = {"low": -1.5, "high": 4.6}
    axes = [{"parameter": f"start.q.{k}", "uniform": around} for k in (0, 1)]
    runs = {"draws": count, "accuracy": accuracy}
    return ensemble_of(
        {"scene": "free_fall", "axes": axes, "runs": runs, "keep": keep}, "<benchmark>", Path()
    )


def bare(order: int, lanes: int) -> Any:
    """Return heyoka's batch integrator of the same equations."""
    scene = Scene.load("free_fall")
    q1, q2, x1, x2 = heyoka().make_vars("q1", "q2", "x1", "x2")
    first, second = EQUATIONS[FORMULATION].rates(
        scene.moving_chain, scene.effects, (q1, q2), (x1, x2), heyoka().time
    )
    return heyoka().taylor_adaptive_batch(
        list(zip((q1, q2, x1, x2), (*first, *second), strict=True)),
        np.zeros((4, lanes)),
        tol=PRECISIONS["double"].step_tolerance(order),
        compact_mode=lanes > heyoka().recommended_simd_size(),
    )


def propagated(integrator: Any, starts: Any, duration: float) -> None:
    """Propagate starts, shape (4, n), with a bare call for each group of lanes."""
    lanes = integrator.state.shape[1]
    for k in range(0, starts.shape[1], lanes):
        integrator.state[:] = starts[:, k : k + lanes]
        integrator.set_time(0.0)
        integrator.propagate_until(duration)


def seconds(call: Callable[[], Any]) -> float:
    """Return the least processor time of a call."""
    found = []
    for _ in range(_REPETITIONS):
        start = process_time()
        call()
        found.append(process_time() - start)
    return min(found)


def beside_bare_calls(count: int) -> None:
    """Print the cost of sweeps beside that of bare calls on the same starts."""
    final = asked(count, {"final": True})
    q, u = final.family.starts(final.values(0, count))
    scene = Scene.load("free_fall")
    second = EQUATIONS[FORMULATION].from_speeds(scene.chain, (q[0], q[1]), (u[0], u[1]))
    starts = np.array([*q, *second])
    width = heyoka().recommended_simd_size()
    calls = {
        f"bare call, order {_OF_HEYOKA}, {width} lanes": bare(_OF_HEYOKA, width),
        f"bare call, order {_KEPT}, {width} lanes": bare(_KEPT, width),
        f"bare call, order {_KEPT}, {LANES} lanes": bare(_KEPT, LANES),
        f"bare call, order {_KEPT + MORE_ORDERS}, {LANES} lanes": bare(_KEPT + MORE_ORDERS, LANES),
    }
    costs = {
        name: seconds(lambda one=one: propagated(one, starts, 10.0))  # type: ignore[misc]
        for name, one in calls.items()
    }
    flips = [{"name": "flip", "of": "either"}]
    # Undecided runs, and for states those that are not accurate enough, are made twice.
    sweeps: dict[str, dict[str, Any]] = {
        "sweep, states with errors": {"final": True},
        "sweep, flips with bounds": {"first": flips},
        "sweep, states and extremes": {"final": True, "extremes": True},
    }
    for name, keep in sweeps.items():
        one = asked(count, keep)
        rows_of(one, 0, LANES)
        costs[name] = seconds(lambda one=one: rows_of(one, 0, count))  # type: ignore[misc]
    own = sum(cost for name, cost in costs.items() if name.endswith(f" {LANES} lanes"))
    one_call = next(iter(costs.values()))
    for name, cost in costs.items():
        ratios = f"× {cost / one_call:5.2f} of the first   × {cost / own:5.2f} of both own orders"
        print(f"{name:38s} {cost / count * 1e6:8.1f} µs a run   {ratios}")


def growing(largest: int) -> None:
    """Print the cost and the memory of whole sweeps, with their stores, of more and more runs."""
    count = 100
    while count <= largest:
        with tempfile.TemporaryDirectory() as folder:
            start = process_time()
            sweep(asked(count, {"final": True}, accuracy=1e-2), Path(folder) / "a.zarr", workers=1)
            spent = process_time() - start
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"{count:8d} runs {spent:9.2f} s {spent / count * 1e6:8.1f} µs a run {memory:6.0f} MB"
        )
        count *= 10


def main() -> None:
    """Measure, and print the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=4096)
    parser.add_argument("--largest", type=int, default=100_000)
    parser.add_argument("--force", action="store_true")
    options = parser.parse_args()
    load, cores = os.getloadavg()[0], os.cpu_count() or 1
    print(f"load {load:.2f} on {cores} cores")
    if load > _BUSY * cores and not options.force:
        sys.exit(f"the load must be at most {_BUSY * cores:g}; got {load:.2f} (--force measures)")
    beside_bare_calls(options.runs)
    growing(options.largest)


if __name__ == "__main__":
    main()
