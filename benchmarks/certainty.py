"""The price of a measured error: `uv run python -m benchmarks.certainty [--scenes N] [--seed S]`.

Random general chains from random starts, 10 s, and random scenes with friction, stops and impacts
(one for three smooth ones). For each decade of accuracy: the time of all runs of `simulate` and of
the measurement of their errors, without compilation, divided by that of the cheapest bare run whose
true error meets the accuracy, by the same integrator compiled in the same way, over its orders,
precisions and formulations. The two are timed in turn, several times, and the shortest processor
times are compared, of all threads: those depend little on other load of the machine. Beside it is
the ratio of floating-point operations of the steps, which does not depend on the machine, counts
those of all lanes of vector instructions, and does not count the evaluation of defects and events.
Then the true error divided by the reported one, at 41 times: 21 samples, and 20 times between them.
The true error is that to a quadruple run by Kane's equations, or, with events, to a run of accuracy
1e-14 by them.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from twolink.chain import Chain
from twolink.effects import Effect
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.errors import SimulationError
from twolink.integration.precisions import PrecisionName
from twolink.limits import UNLIMITED
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid import flow, judged, run
from twolink.simulation.hybrid import measure as hybrid_measure
from twolink.simulation.motion import has_events, motion_run
from twolink.simulation.run import MotionRun
from twolink.simulation.smooth import bundled, lane_run, step_errors, taylor
from twolink.simulation.smooth import runs as smooth_runs
from twolink.simulation.smooth.bundled import Bundled
from twolink.simulation.smooth.taylor import taylor_run

DECADES = tuple(range(3, 14))
SAMPLES = 21
ROUNDS: dict[str, int] = {"double": 9, "long double": 5, "quadruple": 2}
# The modules whose times are taken, by this name: those of a run in its own thread, and that of a
# whole measurement of a smooth motion in all threads, where runs go on side by side.
TIMED_MODULE = import_module("twolink.simulation.simulate")
TIMED_MODULES_OF_RUNS = (
    taylor,
    lane_run,
    bundled,
    step_errors,
    run,
    flow,
    hybrid_measure,
    judged,
)
CLOCK = "perf_counter"
AIM_OF_MEDIAN, AIM_OF_WORST = 4.0, 8.0
# A bare run is tried with each of these, the cheapest precision first.
ORDERS: dict[PrecisionName, range] = {
    "double": range(7, 22, 2),
    "long double": range(13, 24, 2),
    "quadruple": range(21, 34, 4),
}
FORMULATIONS: tuple[EquationsName, ...] = ("momenta", "lagrange")
# As many of the fastest bare runs are timed together with `simulate`.
TIMED = 2

Array = np.ndarray[Any, np.dtype[np.float64]]


def random_chain(random: np.random.Generator) -> Chain:
    """Return a chain of general proportions."""
    m, L = 10 ** random.uniform(-0.7, 0.7, 2), 10 ** random.uniform(-0.5, 0.35, 2)
    centre = zip(
        (L * random.uniform(0.1, 1, 2)).tolist(),
        (L * random.uniform(-0.25, 0.25, 2)).tolist(),
        strict=True,
    )
    inertia = m * L * L * random.uniform(0.02, 0.2, 2)
    first, second = centre
    return Chain(
        (float(m[0]), float(m[1])),
        (float(L[0]), float(L[1])),
        (first, second),
        (float(inertia[0]), float(inertia[1])),
    )


def random_scene(random: np.random.Generator, events: bool) -> Scene:
    """Return a scene of 10 s, or, with events, of 3 s: friction, a stop, or a floor."""
    chain = random_chain(random)
    q, u = random.uniform(-3, 3, (2, 2)).tolist()
    effects: tuple[Effect, ...] = (Gravity(),)
    if events:
        low = chain.L1 + chain.L2 * float(random.uniform(0.2, 0.6))
        torque = float(0.05 * 9.81 * chain.m2 * chain.L2)
        stop = float(abs(q[0]) + random.uniform(0.1, 1))
        kinds: tuple[Effect, ...] = (
            JointFriction((torque, torque)),
            JointStop("A", lower=-stop, upper=stop, restitution=0.5),
            Surface((0.0, float(low)), (0.0, -1.0), restitution=0.5, friction=0.3),
        )
        effects = (*effects, kinds[int(random.integers(len(kinds)))])
        # Both links above a floor.
        q = [-abs(q[0]), -abs(q[1])]
    return Scene(chain, (q[0], q[1]), (u[0], u[1]), 3.0 if events else 10.0, effects)


@dataclass(frozen=True)
class Truth:
    """The true motion at the times that are compared; of a scene with events, beside impacts."""

    times: Array
    states: Any

    def errors(self, states: Any) -> Array:
        """Return the largest error of q and u (rad, rad/s) at each time."""
        states = np.asarray(states)
        if states.dtype != self.states.dtype:
            kind = type(self.states.flat[0])
            states = np.vectorize(kind, otypes=[self.states.dtype])(states)
        return np.asarray(np.abs(states - self.states).max(axis=0).astype(float))


def truth_of(scene: Scene) -> Truth:
    """Return the true motion at samples and between."""
    times = np.linspace(0.0, scene.duration, 2 * SAMPLES - 1)
    if not has_events(scene):
        exact = taylor_run(scene, times, formulation="kane", precision="quadruple")
        return Truth(times, np.concatenate([exact.q, exact.u]))
    reference = simulate(scene, accuracy=1e-14, formulation="kane")
    impacts = np.array([impact.time for impact in reference.impacts])
    rests = [(event.entered, event.time) for event in reference.events]
    clear = [
        not np.any(np.abs(impacts - t) < 1e-5)
        and not any(first - 1e-5 <= t <= last + 1e-5 for first, last in rests if last > first)
        and t <= reference.holds_until
        for t in times
    ]
    times = times[clear]
    return Truth(times, np.concatenate(reference.at(times)))


def bare(
    scene: Scene, times: Array, precision: PrecisionName, order: int, formulation: EquationsName
) -> MotionRun:
    """Return one run of the integrator."""
    return motion_run(
        scene, times, formulation=formulation, precision=precision, order=order, limits=UNLIMITED
    )


class Bare(NamedTuple):
    """A bare run: its true error (rad, rad/s), its shortest time (s), and its operations."""

    error: float
    seconds: float
    operations: float


@dataclass
class Case:
    """A scene, its true motion, and its bare runs by setting."""

    scene: Scene
    truth: Truth
    found: dict[tuple[PrecisionName, int, EquationsName], Bare] = field(default_factory=dict)

    @property
    def samples(self) -> Array:
        """The times that runs are asked for (s)."""
        return np.linspace(0.0, self.scene.duration, SAMPLES)

    def candidates(self, accuracy: float) -> tuple[list[Callable[[], float]], float]:
        """Return the fastest bare runs that meet an accuracy, and the fewest operations of one.

        Each run gives its time (s).
        """
        for precision in ORDERS:
            self._look_at(precision)
            good = sorted(
                (one.seconds, key, one.operations)
                for key, one in self.found.items()
                if one.error <= accuracy and key[0] == precision
            )
            if good:
                fewest = min(operations for _, _, operations in good)
                return [self._timer(key) for _, key, _ in good[:TIMED]], fewest
        raise SimulationError(f"no bare run meets {accuracy:g}")

    def _timer(self, key: tuple[PrecisionName, int, EquationsName]) -> Callable[[], float]:
        return lambda: bare(self.scene, self.samples, *key).run_seconds

    def _look_at(self, precision: PrecisionName) -> None:
        if any(key[0] == precision for key in self.found):
            return
        formulations = ("lagrange",) if has_events(self.scene) else FORMULATIONS
        for formulation in formulations if precision == "double" else formulations[:1]:
            for order in ORDERS[precision]:
                key = precision, order, formulation
                count = ROUNDS[precision] // 2
                try:
                    found = bare(self.scene, self.truth.times, *key)
                    # These end later, where the last true states are left out.
                    seconds = min(self._timer(key)() for _ in range(count))
                except SimulationError:
                    continue
                error = float(self.truth.errors(np.concatenate([found.q, found.u])).max())
                self.found[key] = Bare(error, seconds, found.arithmetic.number)


@dataclass(frozen=True)
class Price:
    """The cost of certainty at one accuracy, and the true error over the reported one.

    The cost is that in time, and in operations.
    """

    ratio: float
    of_operations: float
    shares: Array
    met: bool


def price(case: Case, accuracy: float) -> Price:
    """Measure the price of one accuracy."""
    others, fewest = case.candidates(accuracy)
    times: list[float] = []
    bares: list[float] = []
    with counted() as operations:
        trajectory = simulate(case.scene, accuracy=accuracy, samples=SAMPLES)
    rounds = ROUNDS[trajectory.precision]
    for _ in range(rounds):
        again = simulate(case.scene, accuracy=accuracy, samples=SAMPLES)
        times.append(again.statistics.run_seconds)
        bares.append(min(other() for other in others))
    q, u = trajectory.at(case.truth.times)
    shares = case.truth.errors(np.concatenate([q, u])) / trajectory.error
    return Price(min(times) / min(bares), sum(operations) / fewest, shares, trajectory.met)


@contextmanager
def counted() -> Iterator[list[float]]:
    """Collect the operations of all runs that are made meanwhile for a measured motion."""
    found: list[float] = []
    places = (
        (smooth_runs, "taylor_run"),
        (smooth_runs, "bundled"),
        (hybrid_measure, "hybrid_run"),
    )
    kept = [getattr(module, name) for module, name in places]

    def counting(made: Callable[..., Any]) -> Callable[..., Any]:
        def run(*given: Any, **options: Any) -> Any:
            result = made(*given, **options)
            one = result.first if isinstance(result, Bundled) else result
            found.append(one.arithmetic.number)
            return result

        return run

    for (module, name), made in zip(places, kept, strict=True):
        setattr(module, name, counting(made))
    try:
        yield found
    finally:
        for (module, name), made in zip(places, kept, strict=True):
            setattr(module, name, made)


def scenes(count: int, seed: int) -> Iterator[tuple[bool, Scene]]:
    """Yield smooth scenes, and one with events after every three."""
    random = np.random.default_rng(seed)
    for number in range(count):
        yield False, random_scene(random, events=False)
        if number % 3 == 2:
            yield True, random_scene(random, events=True)


def main() -> None:
    """Measure and print the tables."""
    parser = argparse.ArgumentParser(description="The price of a measured error.")
    parser.add_argument("--scenes", type=int, default=30, help="number of smooth scenes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--digits", type=int, nargs="*", default=DECADES)
    options = parser.parse_args()
    setattr(TIMED_MODULE, CLOCK, time.process_time)
    for module in TIMED_MODULES_OF_RUNS:
        setattr(module, CLOCK, time.thread_time)
    console = Console(width=110)
    prices: dict[tuple[bool, int], list[Price]] = {}
    for events, scene in scenes(options.scenes, options.seed):
        try:
            case = Case(scene, truth_of(scene))
        except SimulationError as error:
            console.print(f"left out: {error}")
            continue
        for digits in options.digits:
            try:
                found = price(case, 10.0**-digits)
            except SimulationError as error:
                console.print(f"left out at 1e-{digits}: {error}")
                continue
            prices.setdefault((events, digits), []).append(found)
    for events, title in ((False, "smooth scenes, 10 s"), (True, "scenes with events, 3 s")):
        console.print(table_of(title, events, prices))
    shares = np.array([p.shares.max() for every in prices.values() for p in every])
    count = sum(p.shares.size for every in prices.values() for p in every)
    console.print(
        f"true / reported error of {len(shares)} runs at {count} times: at most {shares.max():.3g},"
        f" median of the runs {np.median(shares):.3g}, above 1 in {np.count_nonzero(shares > 1)}"
    )
    load = os.getloadavg()[0]
    console.print(f"load of the machine: {load:.1f} on {os.cpu_count()} cores")


def table_of(title: str, events: bool, prices: dict[tuple[bool, int], list[Price]]) -> Table:
    """Return the table of all decades."""
    table = Table(title=f"simulate / cheapest bare run: {title}")
    names = (
        "scenes", "median ratio", "worst", "aim", "of operations", "median true/reported", "worst",
        "met",
    )  # fmt: skip
    table.add_column("accuracy")
    for name in names:
        table.add_column(name, justify="right")
    for digits in sorted({number for of_events, number in prices if of_events == events}):
        found = prices[events, digits]
        ratios = [p.ratio for p in found]
        median, worst = statistics.median(ratios), max(ratios)
        met = median <= AIM_OF_MEDIAN and worst <= AIM_OF_WORST
        shares = [float(p.shares.max()) for p in found]
        table.add_row(
            f"1e-{digits}",
            str(len(found)),
            f"{median:.2f}",
            f"{worst:.2f}",
            "met" if met else "not met",
            f"{statistics.median(p.of_operations for p in found):.2f}",
            f"{statistics.median(shares):.3f}",
            f"{max(shares):.3f}" if math.isfinite(max(shares)) else "—",
            f"{sum(p.met for p in found)}",
        )
    return table


if __name__ == "__main__":
    main()
