"""What a call costs, beside Pinocchio's: `uv run python -m benchmarks.formulations`.

Every row is taken side by side, several times in turn, and the medians are compared; the
spread says how far to trust them. Operation counts do not depend on the machine.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np
import pinocchio
from rich.console import Console
from rich.table import Table

from twolink import kane, lagrange
from twolink.chain import Chain
from twolink.compilation import Compiled
from twolink.effects.gravity import Gravity
from twolink.engines.pinocchio import Pinocchio
from twolink.shipped import shipped
from twolink.urdf import read_planar_urdf

ROUNDS = 9
CALLS = 20_000
BATCH = 1_000_000
LOOPED = 50_000


def seconds_side_by_side(*functions: Callable[[], object]) -> list[list[float]]:
    """Return the times of each function (s), taken in turn so that noise strikes all alike."""
    times: list[list[float]] = [[] for _ in functions]
    for function in functions:
        function()
    for _ in range(ROUNDS):
        for function, taken in zip(functions, times, strict=True):
            start = time.perf_counter()
            function()
            taken.append(time.perf_counter() - start)
    return times


def repeated(function: Callable[..., object], *arguments: object) -> Callable[[], None]:
    """Return a loop of calls, as plain as Python has it."""

    def loop() -> None:
        for _ in range(CALLS):
            function(*arguments)

    return loop


def text_of(name: str, formulation: object, chain: Chain) -> Callable[..., object]:
    """Return a formulation's text of a quantity; the inverse dynamics is under gravity."""
    gravity = Gravity()
    if name == "mass matrix":
        return lambda q: formulation.mass_matrix(chain, q)  # type: ignore[attr-defined]
    return lambda q, u, du: formulation.inverse_dynamics(  # type: ignore[attr-defined]
        chain, q, u, du, gravity.loads(chain, q, u)
    )


def main() -> None:
    """Measure and print the tables."""
    console = Console(width=110)
    urdf = read_planar_urdf(shipped("twolink.urdf"))
    chain = Chain.from_links(urdf.links)
    engine = Pinocchio(urdf)
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
    call_table = Table(title=f"One call (median of {ROUNDS} × {CALLS} calls; aim: ratio ≤ 2)")
    batch_table = Table(title=f"A batch of {BATCH} states, per state (aim: Pinocchio/ours ≥ 20)")
    for table in (call_table, batch_table):
        for column in ("quantity", "text", "ours ns", "Pinocchio ns", "ratio", "spread", "aim"):
            table.add_column(column, justify="left" if column in ("quantity", "text") else "right")
    call_table.add_column("operations")
    for name, (pin_function, pin_arguments, pin_loop) in pins.items():
        for formulation in (kane, lagrange):
            compiled = Compiled(text_of(name, formulation, chain))
            inputs = state[: len(compiled.arguments)]
            batch = states[: len(compiled.arguments)]
            label = formulation.__name__.rpartition(".")[2]
            ours, theirs = seconds_side_by_side(
                repeated(compiled, *inputs), repeated(pin_function, *pin_arguments)
            )
            add_row(call_table, (name, label), ours, CALLS, theirs, CALLS, compiled, False)
            ours, theirs = seconds_side_by_side(partial(compiled.batch, *batch), pin_loop)
            add_row(batch_table, (name, label), ours, BATCH, theirs, LOOPED, compiled, True)
    console.print(call_table)
    console.print(batch_table)
    print_start_up(console)


def add_row(
    table: Table,
    labels: tuple[str, str],
    ours: list[float],
    our_calls: int,
    theirs: list[float],
    their_calls: int,
    compiled: Compiled,
    batch: bool,
) -> None:
    """Add the medians per call (ns), their ratio, and the larger spread of the two."""
    mine = statistics.median(ours) / our_calls * 1e9
    pin = statistics.median(theirs) / their_calls * 1e9
    spread = max(max(times) / min(times) for times in (ours, theirs))
    ratio = pin / mine if batch else mine / pin
    met = ratio >= 20 if batch else ratio <= 2
    cells = [
        f"{mine:.1f}",
        f"{pin:.0f}",
        f"{ratio:.2f}",
        f"{spread:.2f}",
        "met" if met else "not met",
    ]
    operations = [] if batch else [" ".join(f"{n}{op}" for op, n in compiled.operations.items())]
    table.add_row(*labels, *cells, *operations)


def print_start_up(console: Console) -> None:
    """Print what starting costs, beside a bare interpreter that imports Pinocchio."""
    commands = {
        "twolink --help (aim: < 0.5 s)": [sys.executable, "-m", "twolink.cli", "--help"],
        "twolink verify --states 1": [
            sys.executable,
            "-m",
            "twolink.cli",
            "verify",
            "--states",
            "1",
        ],
        "python -c 'import pinocchio'": [sys.executable, "-c", "import pinocchio"],
    }
    functions = [
        partial(subprocess.run, command, capture_output=True, check=True)
        for command in commands.values()
    ]
    table = Table(title="Start-up (median)")
    table.add_column("command")
    table.add_column("s", justify="right")
    for name, times in zip(commands, seconds_side_by_side(*functions), strict=True):
        table.add_row(name, f"{statistics.median(times):.2f}")
    console.print(table)


if __name__ == "__main__":
    main()
