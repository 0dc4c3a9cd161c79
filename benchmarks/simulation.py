"""What a motion costs, beside others: `uv run python -m benchmarks.simulation`.

The free chain for 10 s, from a state without symmetry. Each method runs at settings that keep its
error at the end below 1e-8, in turn with the others; the medians are compared, compiling apart.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio
from rich.console import Console
from rich.table import Table
from scipy import integrate

from twolink.scene import Scene
from twolink.shipped import shipped
from twolink.simulation import simulate
from twolink.simulation.equations import EQUATIONS
from twolink.simulation.taylor import default_longest_step, heyoka, taylor_run
from twolink.urdf import read_planar_urdf

ROUNDS = 7
# The start and the end of the published reference point (rad, rad/s).
EXACT = (0.6316954496532437, 14.846153572263320, 1.6832078686201084, 7.171679436733452)

# A run returns the state at the end, and the time it took (s).
Run = Callable[[], tuple[tuple[float, ...], float]]


def timed(function: Callable[[], tuple[float, ...]]) -> Run:
    """Return a run of a function, timed as a whole."""

    def run() -> tuple[tuple[float, ...], float]:
        start = time.perf_counter()
        state = function()
        return state, time.perf_counter() - start

    return run


def taylor(formulation: str, scene: Scene) -> Run:
    """Return the bare integrator on a set of equations, timed as heyoka's own is."""
    ends = (0.0, scene.duration)

    def run() -> tuple[tuple[float, ...], float]:
        result = taylor_run(scene, ends, formulation=formulation)
        return (*result.q[:, -1], *result.u[:, -1]), result.run_seconds

    return run


def heyokas_lagrangian(scene: Scene) -> Run:
    """Return heyoka on its own `lagrangian()` of the same chain."""
    hy = heyoka()
    q1, q2, v1, v2 = hy.make_vars("q1", "q2", "v1", "v2")
    T = 2 / 3 * v1 * v1 + v2 * v2 / 6 + v1 * v2 * hy.cos(q2 - q1) / 2
    V = -9.81 * (1.5 * hy.sin(q1) + 0.5 * hy.sin(q2))
    system = hy.lagrangian(T - V, qs=[q1, q2], qdots=[v1, v2])
    integrator = hy.taylor_adaptive(system, [0.0] * 4, tol=1e-17)

    def run() -> tuple[float, ...]:
        integrator.state[:] = [*scene.q, *scene.u]
        integrator.time = 0.0
        integrator.propagate_grid([0.0, scene.duration], max_delta_t=default_longest_step(scene))
        return tuple(integrator.state)

    return timed(run)


def scipy_over_pinocchio(scene: Scene) -> Run:
    """Return SciPy's DOP853 over Pinocchio's ABA, on the shipped URDF with revolute joints."""
    text = read_planar_urdf(shipped("twolink.urdf")).xml
    limits = '"revolute"><limit effort="1" velocity="1"/>'
    model = pinocchio.buildModelFromXML(text.replace('"continuous">', limits))
    data, no_torque = model.createData(), np.zeros(2)

    def rates(_: float, x: Any) -> Any:
        return np.concatenate([x[2:], pinocchio.aba(model, data, x[:2], x[2:], no_torque)])

    (q1, q2), (u1, u2) = scene.q, scene.u
    start = [q1, q2 - q1, u1, u2 - u1]
    solve: Any = integrate.solve_ivp

    def run() -> tuple[float, ...]:
        end = solve(rates, (0, scene.duration), start, method="DOP853", rtol=2e-13, atol=2e-13).y[
            :, -1
        ]
        return end[0], end[0] + end[1], end[2], end[2] + end[3]

    return timed(run)


def whole_simulate(scene: Scene) -> Run:
    """Return `simulate` at accuracy 1e-8: its samples, its error and all runs that measure it."""

    def run() -> tuple[float, ...]:
        trajectory = simulate(scene, accuracy=1e-8)
        return (*trajectory.q[:, -1], *trajectory.u[:, -1])

    return timed(run)


def main() -> None:
    """Measure and print the table."""
    scene = Scene.load(shipped("scenes") / "general.toml")
    runs = {f"Taylor on {name}": taylor(name, scene) for name in EQUATIONS}
    runs["heyoka's lagrangian()"] = heyokas_lagrangian(scene)
    runs["SciPy DOP853 over pin.aba"] = scipy_over_pinocchio(scene)
    runs["simulate(accuracy=1e-8)"] = whole_simulate(scene)
    times: dict[str, list[float]] = {name: [] for name in runs}
    errors = {
        name: max(abs(float(x) - y) for x, y in zip(run()[0], EXACT, strict=True))
        for name, run in runs.items()
    }
    for _ in range(ROUNDS):
        for name, run in runs.items():
            times[name].append(run()[1])
    fastest = statistics.median(times["Taylor on momenta"])
    table = Table(title=f"10 s of the free chain, median of {ROUNDS} runs")
    table.add_column("method")
    for column in ("ms", "ratio to Taylor on momenta", "spread", "error at 10 s"):
        table.add_column(column, justify="right")
    for name, taken in times.items():
        median = statistics.median(taken)
        table.add_row(
            name,
            f"{median * 1e3:.3f}",
            f"{median / fastest:.2f}",
            f"{max(taken) / min(taken):.2f}",
            f"{errors[name]:.1e}",
        )
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
