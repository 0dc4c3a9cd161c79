"""The time of the first simulation of a scene, with its compilation.

`uv run python -m benchmarks.first_runs [--scenes N] [--seed S]` draws random general chains, as
`benchmarks.certainty`. Each is simulated once, and another one is integrated once without a
measured error, by the precision and the order that the first one needed. No scene is used twice:
heyoka keeps compiled code in memory, and would compile it faster the second time.
"""

from __future__ import annotations

import argparse
import statistics
from time import perf_counter
from typing import NamedTuple, cast

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.certainty import SAMPLES, random_scene
from twolink.environment import load_of_machine
from twolink.integration.precisions import PrecisionName
from twolink.simulation import simulate
from twolink.simulation.smooth.equations import equations_named
from twolink.simulation.smooth.taylor import taylor_run

ACCURACIES = (1e-3, 1e-6, 1e-9, 1e-11, 1e-13)


class _Taken(NamedTuple):
    """The time (s) of a simulation, the parts that compile and run, and the time of a bare run.

    The simulation compiles in two threads.
    """

    seconds: float
    compiling: float
    running: float
    bare: float


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description="The time of first simulations.")
    parser.add_argument("--scenes", type=int, default=20, help="number of scenes for an accuracy")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    random = np.random.default_rng(asked.seed)
    # Imports, and what is compiled once for all scenes.
    taken(random, 1e-6)
    table = Table(title=f"First simulations of 10 s, medians of {asked.scenes} scenes, ms")
    table.add_column("accuracy")
    for name in ("simulate", "compiling", "running", "bare run", "ratio"):
        table.add_column(name, justify="right")
    for accuracy in ACCURACIES:
        found = [taken(random, accuracy) for _ in range(asked.scenes)]
        medians = [statistics.median(values) for values in zip(*found, strict=True)]
        table.add_row(
            f"{accuracy:g}",
            *(f"{1e3 * median:.0f}" for median in medians),
            f"{medians[0] / medians[-1]:.2f}",
        )
    Console(width=100).print(table)
    print(f"load of the machine: {load_of_machine()}")


def taken(random: np.random.Generator, accuracy: float) -> _Taken:
    """Return the times of a simulation to an accuracy, and of a bare run of another scene."""
    scene, other = (random_scene(random, events=False) for _ in range(2))
    begun = perf_counter()
    found = simulate(scene, accuracy=accuracy, samples=SAMPLES)
    seconds = perf_counter() - begun
    assert found.recipe is not None
    begun = perf_counter()
    taylor_run(
        other,
        np.linspace(0.0, other.duration, SAMPLES),
        formulation=equations_named(found.formulation),
        precision=cast(PrecisionName, found.precision),
        order=found.recipe.order,
    )
    bare = perf_counter() - begun
    return _Taken(seconds, found.statistics.compile_seconds, found.statistics.run_seconds, bare)


if __name__ == "__main__":
    main()
