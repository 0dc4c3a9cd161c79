"""What contact costs, and how compliant contact nears the rigid one.

`uv run python -m benchmarks.contact`: 10 s of the source's chain over a floor, with some 50
impacts, beside the same without the floor; then the rebound from floors of ever higher stiffness,
and by how much it misses that of the rigid law.
"""

from __future__ import annotations

import math
import statistics
import time
from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from twolink.chain import Chain
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.surface import Surface
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.motion import motion_run

ROUNDS = 15
TIMES = np.linspace(0.0, 10.0, 501)
FALL = Scene(
    chain=Chain.uniform_bars(), q=(0.3, -0.2), u=(0.0, 0.0), duration=10.0, effects=(Gravity(),)
)
FLOOR = Surface((0.0, 1.2), (0.0, -1.0), restitution=0.9, name="floor")

POSE = (0.3, 1.1)
HEIGHT = math.sin(POSE[0]) + math.sin(POSE[1])
LAWS = {"kelvin-voigt": 1 / 2, "hertz": 2 / 5}


def main() -> None:
    """Measure and print both tables."""
    print_cost()
    print_limit()


def print_cost() -> None:
    """Print what a scene with impacts costs beside the same without the floor."""
    scenes = {"free": FALL, "over the floor": replace(FALL, effects=(*FALL.effects, FLOOR))}
    times: dict[str, list[float]] = {name: [] for name in scenes}
    runs = {}
    for _ in range(ROUNDS + 1):
        for name, scene in scenes.items():
            start = time.perf_counter()
            runs[name] = motion_run(scene, TIMES, formulation="lagrange")
            times[name].append(time.perf_counter() - start)
    table = Table(title=f"10 s in one run of the integrator, median of {ROUNDS}, compiling apart")
    table.add_column("scene")
    for column in ("impacts", "steps", "ms", "ratio", "spread"):
        table.add_column(column, justify="right")
    first = statistics.median(times["free"][1:])
    for name, taken in times.items():
        median, spread = statistics.median(taken[1:]), max(taken[1:]) / min(taken[1:])
        run = runs[name]
        table.add_row(
            name, f"{len(run.log)}", f"{run.steps}", f"{median * 1e3:.2f}", f"{median / first:.2f}",
            f"{spread:.2f}",
        )  # fmt: skip
    Console(width=100).print(table)


def print_limit() -> None:
    """Print how the rebound nears that of the rigid law, with the measured rate."""
    table = Table(title="Rebound at 1 m/s, sliding at 3 m/s with friction 0.1, without loss")
    table.add_column("law")
    for column in ("stiffness", "misses the rigid law by (m/s)", "rate", "expected rate"):
        table.add_column(column, justify="right")
    for law, expected in LAWS.items():
        misses: list[float] = []
        for exponent in range(5, 12):
            misses.append(miss(law, 10.0**exponent))
            rate = math.log10(misses[-2] / misses[-1]) if len(misses) > 1 else math.nan
            measured = "" if math.isnan(rate) else f"{rate:.3f}"
            table.add_row(law, f"1e{exponent}", f"{misses[-1]:.2e}", measured, f"{expected:.3f}")
    Console(width=100).print(table)


def miss(law: str, stiffness: float) -> float:
    """Return how much D's speeds after a compliant contact differ from those after a rigid one."""
    J = np.array([[-math.cos(q) for q in POSE], [-math.sin(q) for q in POSE]])
    u1, u2 = np.linalg.solve(J, [-1.0, 3.0]).tolist()
    place = (0.0, HEIGHT), (0.0, -1.0)
    start = replace(FALL, q=POSE, u=(u1, u2), duration=0.3, effects=(), accuracy=1e-10)
    rigid = simulate(replace(start, effects=(Surface(*place, restitution=1.0, friction=0.1),)))
    soft = simulate(
        replace(start, effects=(CompliantSurface(*place, law, stiffness, friction=0.1),))  # type: ignore[arg-type]
    )
    leaves = next(event.time for event in soft.events if str(event.mode) == "moves freely")
    q, u = soft.at(leaves)
    after = np.array([[-math.cos(x) for x in q[:, 0]], [-math.sin(x) for x in q[:, 0]]]) @ u[:, 0]
    return float(np.abs(after - J @ rigid.impacts[0].u[1]).max())


if __name__ == "__main__":
    main()
