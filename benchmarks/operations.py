"""Operations and time of a Taylor step: `uv run python -m benchmarks.operations`.

A product of two power series of order p costs about p² floating-point operations, a convolution;
all else in a step costs about p. heyoka's decomposition of the equations shows their number: a
product, a quotient, and a sine or cosine cost one convolution each, a square half of one. Nine
suffice for this chain under gravity, if M u = p is solved for the coefficients of u one by one
instead of by a quotient of series: c u2, c u1, s u1, s u2 with the sine and cosine of q2 − q1
(whose recurrences are these products), (s u1) u2, and the sines and cosines of q1 and q2. heyoka's
language has no such implicit equation.

Then the code of a step by the momenta: its size, its time, and that of its compilation, as
`simulate` compiles it for short runs and for long ones. A step that does not fit the processor's
cache for instructions takes longer than its operations say.

Then random general chains for 10 s under gravity: the shortest time of a bare run whose final error
meets each accuracy, over its orders, by the momenta and by heyoka's own `lagrangian()`, in turn.
With `--fast-math` both are compiled with heyoka's option of that name, which `simulate` does not
use: such code may reorder sums, and need not propagate infinities and NaN.
"""

from __future__ import annotations

import argparse
import re
import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

import heyoka
import numpy as np
from rich.console import Console
from rich.table import Table

from twolink import lagrange
from twolink.chain import Chain
from twolink.effects import potential_energy
from twolink.effects.gravity import Gravity
from twolink.environment import load_of_machine
from twolink.integration.operations import of_taylor_step
from twolink.integration.precisions import PRECISIONS
from twolink.limits import UNLIMITED
from twolink.scene import Scene
from twolink.simulation.motion import motion_run
from twolink.simulation.smooth.equations import EQUATIONS

LEAST = 9
"""Convolutions of the recurrences with an implicit solution of M u = p."""

COUNTED = (9, 15, 21)
"""Orders of steps whose operations are counted."""

ORDERS = range(9, 24, 2)
ACCURACIES = (1e-3, 1e-5, 1e-7, 1e-9)
ROUNDS = 7
DURATION = 10.0

# A decomposed operation of heyoka's with two series; a number times a series costs little.
_PRODUCT = re.compile(
    r"\(u_\d+ \* u_\d+\)|div\((?!-?[\d.]).*u_\d+\)|combined_(sin|cos)|pow\(|inv\("
)


def convolutions(integrator: Any) -> float:
    """Return the number of convolutions of a decomposition, squares as halves."""
    count = 0.0
    for expression, _ in integrator.decomposition:
        text = str(expression)
        if _PRODUCT.match(text):
            factors = re.findall(r"u_\d+", text)
            count += 0.5 if text.startswith("(") and len(set(factors)) == 1 else 1.0
    return count


def by_momenta(
    scene: Scene, order: int, level: int = 3, *, fast_math: bool = False
) -> tuple[Any, list[float]]:
    """Return an integrator of q and p, at a level of optimization, and its initial state."""
    q, p = _variables("q1", "q2"), _variables("p1", "p2")
    form = EQUATIONS["momenta"]
    first, second = form.rates(scene.chain, scene.effects, q, p, heyoka.time)
    start = [*scene.q, *form.from_speeds(scene.chain, scene.q, scene.u)]
    return _integrator([*q, *p], [*first, *second], start, order, level, fast_math), start


def by_lagrangian(
    scene: Scene, order: int, level: int = 3, *, fast_math: bool = False
) -> tuple[Any, list[float]]:
    """Return an integrator of q and u by heyoka's `lagrangian()`, and its initial state."""
    q, u = _variables("q1", "q2"), _variables("u1", "u2")
    L = lagrange.kinetic_energy(scene.chain, q, u)
    L -= potential_energy(scene.effects, scene.chain, q)
    system = heyoka.lagrangian(L, list(q), list(u))
    start = [*scene.q, *scene.u]
    variables, rates = [x for x, _ in system], [rate for _, rate in system]
    return _integrator(variables, rates, start, order, level, fast_math), start


SYSTEMS: dict[str, Callable[..., tuple[Any, list[float]]]] = {
    "momenta": by_momenta,
    "heyoka's lagrangian()": by_lagrangian,
}


def final_speeds(name: str, scene: Scene, state: Any) -> list[float]:
    """Return q and u of the final state of a system."""
    q, second = state[:2], state[2:]
    if name == "momenta":
        second = EQUATIONS["momenta"].to_speeds(scene.chain, q, second)
    return [*map(float, q), *map(float, second)]


def random_scenes(count: int, seed: int) -> Iterator[Scene]:
    """Yield general chains, their centres off the lines of joints, from random starts."""
    dice = np.random.default_rng(seed)

    def pair(low: float, high: float) -> tuple[float, float]:
        first, second = dice.uniform(low, high, 2)
        return float(first), float(second)

    for _ in range(count):
        mass, length, (I1, I2) = pair(0.3, 2), pair(0.4, 1.2), pair(0.02, 0.2)
        (a1, a2), (b1, b2) = pair(0.2, 0.8), pair(-0.2, 0.2)
        (m1, m2), (L1, L2) = mass, length
        centre = (a1 * L1, b1 * L1), (a2 * L2, b2 * L2)
        chain = Chain(mass, length, centre, (I1 * m1 * L1 * L1, I2 * m2 * L2 * L2))
        yield Scene(chain, pair(-1, 1), pair(-1, 1), DURATION, (Gravity(),))


def cheapest(scene: Scene, *, fast_math: bool) -> dict[str, dict[float, float]]:
    """Return the shortest time (s) of each system at each accuracy; infinity if none meets it."""
    times = np.array([0.0, DURATION])
    true = motion_run(scene, times, formulation="kane", precision="quadruple", limits=UNLIMITED)
    exact = np.array([*true.q[:, -1], *true.u[:, -1]], float)
    runs: dict[tuple[str, int], tuple[Any, list[float]]] = {
        (name, order): system(scene, order, fast_math=fast_math)
        for name, system in SYSTEMS.items()
        for order in ORDERS
    }
    errors: dict[tuple[str, int], float] = {}
    shortest = dict.fromkeys(runs, np.inf)
    for _ in range(ROUNDS):
        for key, (integrator, start) in runs.items():
            integrator.time, integrator.state[:] = 0.0, start
            begin = time.process_time()
            integrator.propagate_until(DURATION)
            shortest[key] = min(shortest[key], time.process_time() - begin)
            found = final_speeds(key[0], scene, integrator.state)
            errors[key] = float(np.max(np.abs(found - exact)))
    return {
        name: {
            accuracy: min(
                (shortest[name, order] for order in ORDERS if errors[name, order] <= accuracy),
                default=np.inf,
            )
            for accuracy in ACCURACIES
        }
        for name in SYSTEMS
    }


def code_of_steps(scene: Scene) -> Table:
    """Return the table of the compiled code of a step by the momenta, for each order."""
    table = Table(title="Code of a step by the momenta")
    kinds = {"short runs": 0, "long runs": 3}
    columns = [f"{name}: {what}" for name in kinds for what in ("kB", "µs a step", "ms to compile")]
    for column in ("order", *columns):
        table.add_column(column, justify="right")
    for order in ORDERS:
        row = []
        for level in kinds.values():
            begin = time.process_time()
            integrator, start = by_momenta(scene, order, level)
            compiling = time.process_time() - begin
            size, (seconds, steps) = len(integrator.llvm_state.object_code), _run(integrator, start)
            row += [f"{size / 1e3:.0f}", f"{seconds / steps * 1e6:.2f}", f"{compiling * 1e3:.0f}"]
        table.add_row(f"{order}", *row)
    return table


def _run(integrator: Any, start: list[float]) -> tuple[float, int]:
    """Return the shortest time (s) of a run, and its steps."""
    shortest, steps = np.inf, 1
    for _ in range(ROUNDS):
        integrator.time, integrator.state[:] = 0.0, start
        begin = time.process_time()
        steps = integrator.propagate_until(DURATION)[3]
        shortest = min(shortest, time.process_time() - begin)
    return shortest, steps


def main() -> None:
    """Count the operations, measure the times, and print both."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.operations")
    parser.add_argument("--chains", type=int, default=20, help="how many random chains")
    parser.add_argument("--seed", type=int, default=1, help="which")
    parser.add_argument("--fast-math", action="store_true", help="compile runs with fast_math")
    given = parser.parse_args()
    console = Console(width=100)
    scenes = list(random_scenes(given.chains, given.seed))
    table = Table(title="A Taylor step of a general chain under gravity")
    columns = ("convolutions", "ratio to the least", *(f"operations, order {p}" for p in COUNTED))
    for column in ("equations", *columns):
        table.add_column(column, justify="left" if column == "equations" else "right")
    for name, system in SYSTEMS.items():
        integrators = [system(scenes[0], order)[0] for order in COUNTED]
        count = convolutions(integrators[0])
        whole = [f"{of_taylor_step(each).number:,.0f}" for each in integrators]
        table.add_row(name, f"{count:g}", f"{count / LEAST:.2f}", *whole)
    table.add_row("least, implicit", f"{LEAST}", "1.00", *("" for _ in COUNTED))
    console.print(table)
    # Not the first one, whose code is in heyoka's cache.
    (other,) = random_scenes(1, given.seed + 1)
    console.print(code_of_steps(other))
    found = [cheapest(scene, fast_math=given.fast_math) for scene in scenes]
    table = Table(title=f"Processor time of a bare run, {given.chains} chains, seed {given.seed}")
    for column in ("accuracy", *(f"{name}, ms" for name in SYSTEMS), "median ratio", "range"):
        table.add_column(column, justify="right")
    for accuracy in ACCURACIES:
        ours, theirs = ([times[name][accuracy] for times in found] for name in SYSTEMS)
        ratios = [b / a for a, b in zip(ours, theirs, strict=True) if np.isfinite([a, b]).all()]
        table.add_row(
            f"{accuracy:g}",
            *(f"{statistics.median(times) * 1e3:.3f}" for times in (ours, theirs)),
            f"{statistics.median(ratios):.2f}",
            f"{min(ratios):.2f} to {max(ratios):.2f} ({len(ratios)} chains)",
        )
    console.print(table)
    console.print(f"load of the machine: {load_of_machine()}")


def _variables(*names: str) -> Any:
    return tuple(heyoka.make_vars(*names))


def _integrator(
    variables: list[Any],
    rates: list[Any],
    start: list[float],
    order: int,
    level: int,
    fast_math: bool,
) -> Any:
    tolerance = PRECISIONS["double"].step_tolerance(order)
    system = list(zip(variables, rates, strict=True))
    return heyoka.taylor_adaptive(
        system, start, tol=tolerance, opt_level=level, fast_math=fast_math
    )


if __name__ == "__main__":
    main()
