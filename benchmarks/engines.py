"""Run times of external engines: `uv run --extra engines python -m benchmarks.engines`.

The chain under gravity for 10 s, from a state without symmetry, to an error of at most 1e-8 at the
end. For every method of every installed engine the benchmark searches the coarsest parameter value
that reaches the error together with the next finer one, which excludes accidental hits. This run is
timed in turn with the bare Taylor integrator, and the medians are compared without set-up. Each
ratio is printed with its target.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.simulation import ERROR, EXACT, cheapest_order, taylor
from twolink.data import data_path
from twolink.engines.messages import Method
from twolink.engines.registry import SIMULATORS
from twolink.engines.simulation_engine import EngineRun, Prepared, SimulationEngine
from twolink.errors import EngineError
from twolink.scene import Scene

# Time limit (s) of one run.
BUDGET = 8.0
# Time limit (s) of all timed runs of a method, and their largest number.
TIMING, ROUNDS = 10.0, 15

# Targets for the time relative to Taylor's; without a method's name, for all methods.
TARGETS = {
    ("SciPy over Pinocchio", ""): 300.0,
    ("MuJoCo", "RK4"): 1000.0,
    ("Drake", ""): 1000.0,
    ("diffrax", ""): 10.0,
    ("heyoka", ""): 1.5,
}


@dataclass(frozen=True)
class Found:
    """The coarsest parameter value of a method that reaches the error, with its error (rad)."""

    engine: SimulationEngine
    method: Method
    run: Prepared
    parameter: float
    error: float


class OutOfReach(Exception):  # noqa: N818
    """A method does not reach the error, for the given reason."""


def parameters(kind: Literal["step", "tolerance"]) -> Iterator[float]:
    """Yield finer and finer values: steps (s) halved, tolerances divided by √10."""
    if kind == "step":
        yield from (0.01 * 2.0**-power for power in range(20))
    else:
        yield from (10 ** (-power / 2) for power in range(12, 32))


def error_of(run: EngineRun) -> float:
    """Return the error at the end (rad, rad/s)."""
    return float(np.abs(np.array([*run.q[:, -1], *run.u[:, -1]]) - EXACT).max())


def sought(scene: Scene, engine: SimulationEngine, method: Method) -> Found:
    """Return the coarsest parameter value that reaches the error, as the next finer one does.

    Raises `OutOfReach` if the budget or rounding ends the search.
    """
    if method.order == 1:
        raise OutOfReach("of order 1, it would need some 1e9 steps")
    run, times = engine.prepared(scene, method.name), np.array([0.0, scene.duration])
    met: Found | None = None
    last, growth, least = 0.0, 2.0, float("inf")
    for parameter in parameters(method.parameter):
        if last * growth > BUDGET:
            if met is not None:
                return met
            raise OutOfReach(f"a run takes more than {BUDGET:g} s; so far {least:.0e} was reached")
        try:
            motion = run(parameter, times)
        except EngineError as refusal:
            raise OutOfReach(str(refusal)) from refusal
        growth, last = (motion.seconds / last if last else 2.0), motion.seconds
        error = error_of(motion)
        least = min(least, error)
        if met is not None and error <= ERROR:
            return met
        met = Found(engine, method, run, parameter, error) if error <= ERROR else None
    if met is not None:
        return met
    raise OutOfReach(f"a finer tolerance gains nothing; the least error was {least:.0e}")


def medians(scene: Scene, found: Found, order: int) -> tuple[float, float, float]:
    """Return the medians of an engine and of Taylor (s), run in turn, and the engine's spread."""
    times, bare = np.array([0.0, scene.duration]), taylor("momenta", scene, order)
    ours: list[float] = []
    theirs: list[float] = []
    rounds = max(1, min(ROUNDS, int(TIMING / found.run(found.parameter, times).seconds)))
    for _ in range(rounds):
        # The first run after another one has cold caches.
        ours += [bare()[1] for _ in range(3)][1:]
        quick = theirs == [] or statistics.median(theirs) < 0.1
        theirs.append([found.run(found.parameter, times).seconds for _ in range(1 + quick)][-1])
    return statistics.median(theirs), statistics.median(ours), max(theirs) / min(theirs)


def target_of(found: Found) -> float | None:
    """Return the target of a method, if there is one."""
    for (engine, method), target in TARGETS.items():
        if engine == found.engine.name and method in ("", found.method.name):
            return target
    return None


def row(found: Found, theirs: float, ours: float, spread: float) -> list[str]:
    """Return a row of the table."""
    ratio, target = theirs / ours, target_of(found)
    judged = "" if target is None else f"{target:g} {'met' if ratio >= target else 'NOT MET'}"
    return [
        f"{found.engine.name}: {found.method.name}",
        f"{found.parameter:.1e}",
        f"{found.error:.1e}",
        f"{theirs * 1e3:.3f}",
        f"{spread:.2f}{' !' if spread > 2 else ''}",
        f"{ours * 1e3:.3f}",
        f"{ratio:.1f}",
        judged,
    ]


def main() -> None:
    """Measure and print the table, and the omitted methods."""
    console = Console(width=120)
    scene = Scene.load(data_path("scenes") / "general.toml")
    order = cheapest_order(scene)
    table = Table(title=f"10 s of the chain under gravity to {ERROR:g}; Taylor of order {order}")
    table.add_column("engine: method")
    for column in ("parameter", "error", "ms", "spread", "Taylor ms", "ratio", "target"):
        table.add_column(column, justify="right")
    left_out = []
    for engine in SIMULATORS:
        sentence = engine.missing() or engine.unsupported(scene)
        left_out += [sentence] if sentence else []
        for method in () if sentence else engine.methods:
            try:
                found = sought(scene, engine, method)
            except OutOfReach as reason:
                left_out.append(f"{engine.name}: {method.name}: {reason}")
            else:
                table.add_row(*row(found, *medians(scene, found, order)))
    console.print(table)
    for sentence in left_out:
        console.print(f"  {sentence}")


if __name__ == "__main__":
    main()
