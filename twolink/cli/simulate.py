"""The command `twolink simulate`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twolink.cli.limits import Force, limits_of
from twolink.cli.terminal import FAILED, check_target, console, progress_bar

if TYPE_CHECKING:
    from rich.console import Console

    from twolink.formulations import EquationsName
    from twolink.scene import Scene
    from twolink.simulation import Trajectory

# More lines of a log than these are not read.
_LOG_LINES = 40


def simulate(
    scene: Annotated[Path, typer.Argument(help="A scene: its name, or a TOML file.")],
    accuracy: Annotated[
        float | None,
        typer.Option(help="Global error allowed in q (rad) and u (rad/s). Default: the scene's."),
    ] = None,
    method: Annotated[
        str | None, typer.Option(help="Integration method. Default: the scene's.")
    ] = None,
    formulation: Annotated[
        str, typer.Option(help="Variables and equations: momenta, lagrange or kane.")
    ] = "momenta",
    samples: Annotated[int, typer.Option(help="How many evenly spaced samples to keep.")] = 501,
    out: Annotated[
        Path | None,
        typer.Option(help="Write the trajectory to this .npz, .csv or .parquet file."),
    ] = None,
    effects_cost: Annotated[
        bool,
        typer.Option(
            "--effects-cost", help="Print the cost of each effect in a step, and nothing else."
        ),
    ] = False,
    force: Force = False,
) -> None:
    """Simulate a scene to a measured accuracy.

    Prints the motion, its cost and its accuracy. Exit code 0: the accuracy is
    met. 1: only up to the time that is printed. 2: the input was refused.
    """
    check_target("--out", out, (".npz", ".csv", ".parquet"))
    from twolink.scene import Scene
    from twolink.simulation import simulate as run
    from twolink.simulation.smooth.equations import equations_named
    from twolink.simulation.storage import check_kind

    if out is not None:
        check_kind(out)
    if effects_cost:
        _print_effects_cost(Scene.load(scene), equations_named(formulation))
        return
    loaded = Scene.load(scene)
    with progress_bar() as bar:
        task = bar.add_task("simulating", total=1.0)
        trajectory = run(
            loaded,
            accuracy=accuracy,
            method=method,
            formulation=equations_named(formulation),
            samples=samples,
            limits=limits_of(force),
            progress=lambda stage, share: bar.update(
                task, description=f"simulating, {stage}", completed=share
            ),
        )
    _print_trajectory(trajectory)
    if out is not None:
        trajectory.save(out)
    if not trajectory.met:
        raise typer.Exit(FAILED)


def _print_effects_cost(scene: Scene, formulation: EquationsName) -> None:
    """Print the cost of a step with all effects, and without each of them."""
    from rich import box
    from rich.table import Table

    from twolink.simulation.effects_cost import effects_cost

    cost = effects_cost(scene, formulation=formulation)
    table = Table(title="Cost of a step", title_justify="left", box=box.SIMPLE_HEAD)
    for column in ("", "operations a term", "ns a step", "it adds"):
        table.add_column(column, justify="left" if column == "" else "right")
    whole = cost.whole
    table.add_row("all effects", f"{whole.operations}", f"{whole.seconds * 1e9:.0f}", "")
    for name, step in cost.without.items():
        added = whole.operations - step.operations, whole.seconds - step.seconds
        table.add_row(
            f"without {name}",
            f"{step.operations}",
            f"{step.seconds * 1e9:.0f}",
            f"{added[0]} operations, {added[1] * 1e9:+.0f} ns",
        )
    console().print(table)


def _print_trajectory(trajectory: Trajectory) -> None:
    """Print the motion, its cost and its accuracy."""
    from rich import box
    from rich.table import Table

    scene, statistics = trajectory.scene, trajectory.statistics
    energy = trajectory.energy
    table = Table(title=scene.title, title_justify="left", box=box.SIMPLE_HEAD, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column()
    # As many decimals as are right.
    known = 0 < trajectory.error < math.inf
    decimals = max(0, min(15, int(-math.log10(trajectory.error)))) if known else 6
    q, u = (
        [f"{x + 0.0:.{decimals}f}" for x in pair[:, -1]] for pair in (trajectory.q, trajectory.u)
    )
    rows = {
        "simulated": f"{scene.duration:g} s with {', '.join(trajectory.effects) or 'no effects'}",
        "method": f"{trajectory.method} on {trajectory.formulation}, {trajectory.precision}",
        "global error": f"{trajectory.error:.1e} measured, {trajectory.accuracy:.1e} allowed",
        "steps": f"{statistics.steps} kept, in {statistics.runs} runs",
        "time": f"{statistics.run_seconds * 1e3:.1f} ms to run, "
        f"{statistics.compile_seconds * 1e3:.0f} ms to compile",
        "energy T + V": f"{energy[0]:.9g} J at the start, {energy[-1]:.9g} J at the end",
        "q at the end": f"{q[0]}, {q[1]} rad",
        "u at the end": f"{u[0]}, {u[1]} rad/s",
    }
    for name, pair, unit in (("θ", trajectory.theta, "rad"), ("ω", trajectory.omega, "rad/s")):
        if pair is not None:
            one, two = (f"{x + 0.0:.{decimals}f}" for x in pair[:, -1])
            rows[f"{name} at the end"] = f"{one}, {two} {unit}"
    for name, value in rows.items():
        table.add_row(name, value)
    page = console()
    page.print(table)
    _print_log(page, trajectory)
    for note in trajectory.notes:
        style = None if note in scene.notes else "bold red"
        page.print(note, style=style, soft_wrap=True)


def _print_log(page: Console, trajectory: Trajectory) -> None:
    """Print the times of modes and the impacts; of very many the first and the last."""
    log: list[Any] = [*trajectory.impacts, *trajectory.events]
    log.sort(key=lambda entry: entry.time)
    hidden = len(log) - _LOG_LINES if len(log) > _LOG_LINES else 0
    shown = log if not hidden else [*log[: _LOG_LINES // 2], *log[-(_LOG_LINES // 2) :]]
    for number, entry in enumerate(shown):
        if hidden and number == _LOG_LINES // 2:
            page.print(f"  … {hidden} more, in Trajectory.events and Trajectory.impacts …")
        page.print(f"  {entry.time:.9g} s: {entry.what}", soft_wrap=True)
    gains = [impact.energy_change for impact in trajectory.impacts if impact.creates_energy]
    if gains:
        page.print(
            f"{len(gains)} of {len(trajectory.impacts)} impacts created energy, "
            f"{sum(gains):.6g} J in all: so does Newton's law with friction.",
            style="bold red",
            soft_wrap=True,
        )
