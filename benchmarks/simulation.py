"""The cost of a simulation against other methods: `uv run python -m benchmarks.simulation`.

The chain under gravity for 10 s, from a state without symmetry. Each method runs at the cheapest
setting with a measured final error below 1e-8, in turn with the others; the medians are compared
without compilation (`benchmarks.engines` has more external engines). Then the cost of absent
effects: the scene, and the same scene after effects were added and removed again.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from twolink.data import data_path
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.engines.registry import SIMULATORS, by_name
from twolink.integration.precisions import OPTIMISED, PRECISIONS
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.taylor import taylor_run

ROUNDS = 15
ERROR = 1e-8
# Initial and final state of the published reference (rad, rad/s).
EXACT = (0.6316954496532437, 14.846153572263320, 1.6832078686201084, 7.171679436733452)

# A run returns the final state and its time (s).
Run = Callable[[], tuple[tuple[float, ...], float]]


def timed(function: Callable[[], tuple[float, ...]]) -> Run:
    """Return a run that times the whole call of a function."""

    def run() -> tuple[tuple[float, ...], float]:
        start = time.perf_counter()
        state = function()
        return state, time.perf_counter() - start

    return run


def taylor(formulation: EquationsName, scene: Scene, order: int | None = None) -> Run:
    """Return a run of the bare integrator for a formulation, timed like heyoka's own."""
    ends = (0.0, scene.duration)

    def run() -> tuple[tuple[float, ...], float]:
        result = taylor_run(scene, ends, formulation=formulation, order=order, code=OPTIMISED)
        return (*result.q[:, -1], *result.u[:, -1]), result.run_seconds

    return run


def error_of(run: Run) -> float:
    """Return the final error of a run (rad, rad/s)."""
    return max(abs(float(x) - y) for x, y in zip(run()[0], EXACT, strict=True))


def cheapest_order(scene: Scene) -> int:
    """Return the lowest order of the Taylor series that reaches the error."""
    orders = range(7, PRECISIONS["double"].full_order, 2)
    return next(order for order in orders if error_of(taylor("momenta", scene, order)) <= ERROR)


def engine(name: str, method: str, scene: Scene, parameter: float) -> Run:
    """Return a run of an external engine at one setting, timed without set-up."""
    engine = by_name(name, {each.name: each for each in SIMULATORS})
    prepared, ends = engine.prepared(scene, method), np.array([0.0, scene.duration])

    def run() -> tuple[tuple[float, ...], float]:
        motion = prepared(parameter, ends)
        return (*motion.q[:, -1], *motion.u[:, -1]), motion.seconds

    return run


def whole_simulate(scene: Scene, accuracy: float) -> Run:
    """Return a run of `simulate`, including samples and all runs that measure the error."""

    def run() -> tuple[float, ...]:
        trajectory = simulate(scene, accuracy=accuracy)
        return (*trajectory.q[:, -1], *trajectory.u[:, -1])

    return timed(run)


def main() -> None:
    """Measure and print the tables."""
    scene = Scene.load(data_path("scenes") / "general.toml")
    order = cheapest_order(scene)
    runs = {f"Taylor on {name}, order {order}": taylor(name, scene, order) for name in EQUATIONS}
    runs["heyoka's lagrangian(), same order"] = engine(
        "heyoka", "taylor", scene, PRECISIONS["double"].step_tolerance(order)
    )
    runs["Taylor on momenta, full order"] = taylor("momenta", scene)
    runs["SciPy DOP853 over pin.aba"] = engine("SciPy over Pinocchio", "DOP853", scene, 3e-14)
    runs["simulate(accuracy=1e-6)"] = whole_simulate(scene, 1e-6)
    runs["simulate(accuracy=1e-8)"] = whole_simulate(scene, 1e-8)
    compare(f"10 s of the chain under gravity, median of {ROUNDS} runs", runs)
    again = replace(scene, effects=(Gravity(), JointDamping((0.1, 0.1)), JointSpring((1.0, 1.0))))
    named = {
        "the scene": taylor("momenta", scene),
        "with damping and springs": taylor("momenta", again),
        "left out again": taylor("momenta", replace(again, effects=again.effects[:1])),
    }
    compare("Absent effects cost nothing", named, with_errors=False)
    print_overhead(scene)


def print_overhead(scene: Scene) -> None:
    """Print the overhead of `simulate` over its integrations."""
    shares = []
    for _ in range(100 * ROUNDS):
        start = time.perf_counter()
        trajectory = simulate(scene, accuracy=1e-6)
        taken = time.perf_counter() - start
        shares.append(taken / trajectory.statistics.run_seconds - 1)
    # By then all its integrators are compiled.
    share = statistics.median(shares[-10 * ROUNDS :])
    Console(width=110).print(f"simulate adds {share:.0%} to the bare integrations in it")


def compare(title: str, runs: dict[str, Run], with_errors: bool = True) -> None:
    """Run all in turn, and print their medians relative to the first."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    errors = {name: error_of(run) for name, run in runs.items()}
    for _ in range(ROUNDS):
        for name, run in runs.items():
            times[name].append(run()[1])
    first = statistics.median(times[next(iter(times))])
    table = Table(title=title)
    table.add_column("method")
    for column in (
        "ms",
        "ratio to the first",
        "spread",
        *(("error at 10 s",) if with_errors else ()),
    ):
        table.add_column(column, justify="right")
    for name, taken in times.items():
        median = statistics.median(taken)
        row = [f"{median * 1e3:.3f}", f"{median / first:.2f}", f"{max(taken) / min(taken):.2f}"]
        table.add_row(name, *row, *((f"{errors[name]:.1e}",) if with_errors else ()))
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
