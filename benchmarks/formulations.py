"""The cost of a call against Pinocchio's: `uv run python -m benchmarks.formulations`.

The entries of a row are timed in turn, several times, and the medians are compared; the spread
indicates their reliability. Operation counts do not depend on the machine.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import pinocchio
from rich.console import Console
from rich.table import Table

from twolink import kane, lagrange
from twolink.chain import Chain
from twolink.compilation import Compiled
from twolink.data import data_path
from twolink.effects.gravity import Gravity
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.urdf import read_planar_urdf

ROUNDS = 9
CALLS = 20_000
BATCH = 1_000_000
LOOPED = 50_000


def seconds_side_by_side(
    *functions: Callable[[], object], rounds: int = ROUNDS
) -> list[list[float]]:
    """Return the times of each function (s), measured in turn so that noise affects all alike."""
    times: list[list[float]] = [[] for _ in functions]
    for function in functions:
        function()
    for _ in range(rounds):
        for function, taken in zip(functions, times, strict=True):
            start = time.perf_counter()
            function()
            taken.append(time.perf_counter() - start)
    return times


def repeated(function: Callable[..., object], *arguments: object) -> Callable[[], None]:
    """Return a plain Python loop of calls."""

    def loop() -> None:
        for _ in range(CALLS):
            function(*arguments)

    return loop


def text_of(name: str, formulation: object, chain: Chain) -> Callable[..., object]:
    """Return a formulation's function of a quantity; the inverse dynamics includes gravity."""
    gravity = Gravity()
    if name == "mass matrix":
        return lambda q: formulation.mass_matrix(chain, q)  # type: ignore[attr-defined]
    return lambda q, u, du: formulation.inverse_dynamics(  # type: ignore[attr-defined]
        chain, q, u, du, gravity.loads(chain, q, u)
    )


def main() -> None:
    """Measure and print the tables."""
    console = Console(width=120)
    urdf = read_planar_urdf(data_path("twolink.urdf"))
    chain = Chain.from_links(urdf.links)
    engine = PinocchioChain(urdf)
    model, data = engine.model, engine.model.createData()
    random = np.random.default_rng(1)
    states = random.uniform(-3, 3, (3, 2, BATCH))
    rows = [np.ascontiguousarray(state[:, :LOOPED].T) for state in states]
    configurations = [pinocchio.integrate(model, pinocchio.neutral(model), row) for row in rows[0]]
    state = [tuple(map(float, s[:, 0])) for s in states]

    def loop_crba() -> None:
        result = np.empty((LOOPED, 2, 2))
        for i, q in enumerate(configurations):
            result[i] = pinocchio.crba(model, data, q)

    def loop_rnea() -> None:
        result = np.empty((LOOPED, 2))
        for i, q in enumerate(configurations):
            result[i] = pinocchio.rnea(model, data, q, rows[1][i], rows[2][i])

    pins: dict[str, tuple[Callable[..., object], list[object], Callable[[], None]]] = {
        "mass matrix": (pinocchio.crba, [model, data, configurations[0]], loop_crba),
        "inverse dynamics": (
            pinocchio.rnea,
            [model, data, configurations[0], rows[1][0], rows[2][0]],
            loop_rnea,
        ),
    }
    calls = table_of(
        f"One call (median of {ROUNDS} × {CALLS}; aim: ratio ours/Pinocchio ≤ 2)",
        ("uncompiled ns", "operations"),
    )
    batches = table_of(f"A batch of {BATCH} states, per state (aim: Pinocchio/ours ≥ 20)", ())
    for name, (pin_function, pin_arguments, pin_loop) in pins.items():
        for formulation in (kane, lagrange):
            text = text_of(name, formulation, chain)
            compiled = Compiled(text)
            inputs = state[: len(compiled.arguments)]
            batch = states[: len(compiled.arguments)]
            labels = (name, formulation.__name__.rpartition(".")[2])
            ours, theirs, plain = seconds_side_by_side(
                repeated(compiled, *inputs),
                repeated(pin_function, *pin_arguments),
                repeated(text, *inputs),
            )
            cost = Cost(ours, CALLS, theirs, CALLS)
            counts = " ".join(f"{n}{symbol}" for symbol, n in compiled.operations.items())
            uncompiled = f"{statistics.median(plain) / CALLS * 1e9:.0f}"
            met = cost.ratio <= 2
            calls.add_row(*labels, *cost.cells(cost.ratio), met_or_not(met), uncompiled, counts)
            ours, theirs = seconds_side_by_side(partial(compiled.batch, *batch), pin_loop)
            cost = Cost(ours, BATCH, theirs, LOOPED)
            gain = 1 / cost.ratio
            batches.add_row(*labels, *cost.cells(gain), met_or_not(gain >= 20))
    console.print(calls)
    console.print(batches)
    print_start_up(console)


@dataclass(frozen=True)
class Cost:
    """Times of our code and of Pinocchio (s), each for a number of calls."""

    ours: list[float]
    our_calls: int
    theirs: list[float]
    their_calls: int

    @property
    def nanoseconds(self) -> tuple[float, float]:
        """The medians per call of our code and of Pinocchio."""
        return (
            statistics.median(self.ours) / self.our_calls * 1e9,
            statistics.median(self.theirs) / self.their_calls * 1e9,
        )

    @property
    def ratio(self) -> float:
        """Our median divided by Pinocchio's."""
        ours, theirs = self.nanoseconds
        return ours / theirs

    def cells(self, ratio: float) -> list[str]:
        """Return both medians, the target ratio, and the larger of both spreads."""
        ours, theirs = self.nanoseconds
        spread = max(max(times) / min(times) for times in (self.ours, self.theirs))
        return [f"{ours:.1f}", f"{theirs:.0f}", f"{ratio:.2f}", f"{spread:.2f}"]


def met_or_not(met: bool) -> str:
    """Return the verdict on a target."""
    return "met" if met else "not met"


def table_of(title: str, more: tuple[str, ...]) -> Table:
    """Return an empty table of costs."""
    table = Table(title=title)
    for column in ("quantity", "text"):
        table.add_column(column)
    for column in ("ours ns", "Pinocchio ns", "ratio", "spread", "aim", *more):
        table.add_column(column, justify="right")
    return table


_STARTS = 15
_PINOCCHIO = "python -c 'import pinocchio'"
# Those of `twolink simulate`. heyoka would import SymPy, which it does not need for this.
_LIBRARIES = "import sys; sys.modules['sympy'] = None; " + "; ".join(
    f"import {name}" for name in ("numpy", "pydantic", "typer", "rich.console", "heyoka")
)


def print_start_up(console: Console) -> None:
    """Print start-up times against a bare interpreter that imports Pinocchio.

    All processes find compiled modules of Python, which a first round writes, and nothing else.
    """
    twolink = [sys.executable, "-m", "twolink.cli"]
    free_fall = str(data_path("scenes") / "free_fall.toml")
    commands = {
        "twolink --help (aim: < 0.5 s)": [*twolink, "--help"],
        "twolink verify --states 1": [*twolink, "verify", "--states", "1"],
        "twolink simulate free_fall.toml (aim: ratio 2.5)": [*twolink, "simulate", free_fall],
        "imports of the libraries of twolink simulate": [sys.executable, "-c", _LIBRARIES],
        _PINOCCHIO: [sys.executable, "-c", "import pinocchio"],
    }
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    functions = [
        partial(subprocess.run, command, capture_output=True, check=True, env=environment)
        for command in commands.values()
    ]
    found = seconds_side_by_side(*functions, rounds=_STARTS)
    measured = [statistics.median(times) for times in found]
    table = Table(title="Start-up (median)")
    table.add_column("command")
    for column in ("s", "ratio"):
        table.add_column(column, justify="right")
    unit = measured[list(commands).index(_PINOCCHIO)]
    for name, seconds in zip(commands, measured, strict=True):
        table.add_row(name, f"{seconds:.2f}", f"{seconds / unit:.1f}")
    console.print(table)


if __name__ == "__main__":
    main()
