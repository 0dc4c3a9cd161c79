"""The errors of lanes side by side, in their bounds: `uv run python -m benchmarks.lanes`.

Random general chains from random starts, 10 s, by bundles of each order at random sizes of the
state. Of those whose errors grow in proportion: the true errors of the first two lanes divided by
their bounds, at 401 times at which lanes are compared, and the largest distance of the lanes
anywhere, at eight times in each of the longest steps, divided by that where they are compared. The
true error is that to a run in long doubles by Kane's equations. Then the time of a step of four
lanes, in that of one run of the same order.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.certainty import random_scene
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.smooth.bundle_plan import BundlePlan
from twolink.simulation.smooth.bundled import Bundled, bundled
from twolink.simulation.smooth.bundles import FIRST, LONGEST, SECOND
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.simulation.smooth.taylor import taylor_run

ORDERS = range(9, 20, 2)
# The size of the state, in the largest variable: from twice that to e^(0.3 p) times, as in plans.
SMALLEST, OF_ORDER = 2.0, 0.3
TIMES, COARSE, WITHIN, ROUNDS = 401, 21, 8, 9


class Found(NamedTuple):
    """The errors of two lanes in their bounds, and the distance anywhere in that at some times."""

    order: int
    first: float
    second: float
    between: float


def made(scene: Scene, order: int, size: float, times: Array) -> Bundled:
    """Return a bundle whose lanes are compared often enough."""
    visit = np.zeros(0)
    for _ in range(3):
        found = bundled(
            scene, times, BundlePlan(order, size), formulation="momenta",
            longest_step=default_longest_step(scene), visit=visit,
        )  # fmt: skip
        if found.lanes.is_resolved:
            break
        visit = found.lanes.places
    return found


def looked_at(scene: Scene, order: int, size: float, exact: Array) -> Found | None:
    """Return the shares of a bundle, or None if its errors have no bounds."""
    times = np.linspace(0.0, scene.duration, TIMES)
    try:
        fine = made(scene, order, size, times)
        coarse = made(scene, order, size, times[:: TIMES // (COARSE - 1)])
    except SimulationError:
        return None
    if fine.bounds is None or coarse.bounds is None or not coarse.lanes.is_resolved:
        return None
    errors = (
        float(np.abs(np.concatenate([run.q, run.u]) - exact).max())
        for run in (fine.first, fine.second)
    )
    first, second = (error / bound for error, bound in zip(errors, fine.bounds, strict=True))
    return Found(order, first, second, anywhere(coarse) / coarse.distance)


def anywhere(found: Bundled) -> float:
    """Return the distance of the second lane from the first, at times in each of the long steps."""
    ends = np.unique([0.0, *found.found.ends[LONGEST]])
    shares = np.arange(WITHIN) / WITHIN
    inside = (ends[:-1, None] + np.diff(ends)[:, None] * shares).ravel()
    times = np.union1d(found.grid, inside)
    lanes = found.lanes
    motions = lanes.compiled.follow(lanes.scene, times, lanes.size, lanes.longest_step).motions
    return float(np.abs(motions[SECOND] - motions[FIRST]).max())


def drawn(random: np.random.Generator, seconds: float) -> Iterator[list[Found]]:
    """Yield what bundles of all orders show of random motions, for some time (s)."""
    begun = time.monotonic()
    while time.monotonic() - begun < seconds:
        scene = random_scene(random, events=False)
        times = np.linspace(0.0, scene.duration, TIMES)
        try:
            run = taylor_run(scene, times, formulation="kane", precision="long double")
        except SimulationError:
            continue
        exact = np.concatenate([run.q, run.u])
        largest = max(1.0, float(np.abs(exact).max()))
        found = []
        for order in ORDERS:
            part = np.exp(random.uniform(np.log(SMALLEST), OF_ORDER * order))
            found.append(looked_at(scene, order, float(part) * largest, exact))
        yield [each for each in found if each is not None]


def shortest(work: Callable[[], object]) -> float:
    """Return the shortest processor time (s) of some work."""
    times = []
    for _ in range(ROUNDS):
        begun = time.thread_time()
        work()
        times.append(time.thread_time() - begun)
    return min(times)


def cost(scene: Scene, order: int) -> float:
    """Return the time of a step of four lanes in that of one run."""
    ends = np.array([0.0, scene.duration])
    plan = BundlePlan(order, 50.0)
    cap = default_longest_step(scene)
    found = bundled(scene, ends, plan, formulation="momenta", longest_step=cap, visit=np.zeros(0))
    lanes = found.lanes
    alone = taylor_run(scene, ends, formulation="momenta", order=order)
    of_lanes = shortest(lambda: lanes.compiled.follow(scene, ends, plan.size, cap))
    of_one = shortest(lambda: taylor_run(scene, ends, formulation="momenta", order=order))
    return of_lanes / max(lanes.found.steps) / (of_one / alone.steps)


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description="The errors of lanes side by side.")
    parser.add_argument("--seconds", type=float, default=60.0, help="time for random motions")
    parser.add_argument("--seed", type=int, default=21)
    options = parser.parse_args()
    random = np.random.default_rng(options.seed)
    motions = list(drawn(random, options.seconds))
    every = [each for found in motions for each in found]
    scene = random_scene(np.random.default_rng(1), events=False)
    table = Table(title=f"{len(every)} bundles of {len(motions)} random motions")
    table.add_column("order")
    names = "bundles", "first/bound", "second/bound", "anywhere/compared", "a step of four lanes"
    for name in names:
        table.add_column(name, justify="right")
    for order in ORDERS:
        own = [each for each in every if each.order == order]
        largest = (max((each[k] for each in own), default=0.0) for k in (1, 2, 3))
        table.add_row(
            str(order), str(len(own)), *(f"{x:.2f}" for x in largest), f"{cost(scene, order):.2f}"
        )
    Console(width=100).print(table)


if __name__ == "__main__":
    main()
