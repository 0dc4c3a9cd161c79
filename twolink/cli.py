"""The command `twolink`: words in, words out; the only place that prints."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Callable
from dataclasses import asdict
from enum import StrEnum
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from twolink.errors import TwolinkError
from twolink.files import written_whole

if TYPE_CHECKING:
    from twolink.scene import Scene
    from twolink.simulation import Trajectory
    from twolink.verification import Comparison, Verdict

FAILED, BAD_INPUT = 1, 2

# Columns that the widest table needs; so wide is the output to files, too.
_WIDE = 104

# More lines of a log than these are not read.
_LOG_LINES = 40

app = typer.Typer(
    help="The reference suite for the planar two-link chain (double pendulum).",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


class FormulationName(StrEnum):
    """The formulations of the equations of motion, as the command line names them."""

    kane = "kane"
    lagrange = "lagrange"


@app.callback()
def _commands() -> None:
    """Keep the name of a command required, also while there is only one."""


@app.command()
def verify(
    urdf: Annotated[
        Path | None,
        typer.Option(help="A URDF of a planar two-link chain. Default: the shipped chain."),
    ] = None,
    states: Annotated[int, typer.Option(help="How many random states to compare at.")] = 10_000,
    seed: Annotated[int, typer.Option(help="Seed of the random states.")] = 1,
    formulation: Annotated[
        FormulationName | None, typer.Option(help="Check this one alone. Default: both.")
    ] = None,
    tip: Annotated[
        str | None, typer.Option(help="The URDF's link to take as the free end D.")
    ] = None,
    oblique_gravity: Annotated[
        bool,
        typer.Option(
            "--oblique-gravity",
            help="Allow a plane of motion that is not vertical; gravity's part in it acts.",
        ),
    ] = False,
    contact: Annotated[
        bool,
        typer.Option(
            "--contact",
            help="Compare contact at D instead: impacts, what holds D on a surface, a given force.",
        ),
    ] = False,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the verdict to this file as JSON.")
    ] = None,
) -> None:
    """Check Kane's and Lagrange's equations against Pinocchio.

    At random states, each quantity by each formulation and by Pinocchio; and Kane against
    Lagrange. Exit code 0: all agree. 1: some do not. 2: the input was refused.
    """
    if states < 1:
        _refuse(f"--states is {states}; allowed is a positive whole number")
    if seed < 0:
        _refuse(f"--seed is {seed}; allowed is zero or a positive whole number")
    _check_target("--json", json_file)
    try:
        verdict = _verdict(urdf, states, seed, formulation, tip, oblique_gravity, contact)
    except TwolinkError as error:
        _refuse(str(error))
    _print_verdict(verdict, contact)
    if json_file is not None:
        _write_json(json_file, verdict)
    if not verdict.passed:
        raise typer.Exit(FAILED)


def _verdict(
    urdf: Path | None,
    states: int,
    seed: int,
    formulation: FormulationName | None,
    tip: str | None,
    oblique_gravity: bool,
    contact: bool,
) -> Verdict:
    """Run the verification under a progress bar."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from twolink.shipped import shipped
    from twolink.urdf import read_planar_urdf
    from twolink.verification.jointspace import FORMULATIONS

    compare = _comparing(contact)
    read = read_planar_urdf(
        urdf or shipped("twolink.urdf"), tip=tip, oblique_gravity=oblique_gravity
    )
    names = list(FORMULATIONS) if formulation is None else [formulation.value]
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(f"comparing at {states} states", total=1.0)
        return compare(
            read,
            states=states,
            seed=seed,
            formulations={name: FORMULATIONS[name] for name in names},
            progress=lambda share: bar.update(task, completed=share),
        )


def _comparing(contact: bool) -> Callable[..., Verdict]:
    """Return what compares the equations of motion, or contact at D."""
    if contact:
        from twolink.verification.contact import verify_contact

        return verify_contact
    from twolink.verification import verify

    return verify


def _print_verdict(verdict: Verdict, contact: bool) -> None:
    """Print what was compared, and the sentence that sums it up."""
    from rich.console import Console

    console = Console(width=None if sys.stdout.isatty() else _WIDE, highlight=False)
    console.print(f"{Path(verdict.urdf).name} in {verdict.engine}, seed {verdict.seed}\n")
    motion = [c for c in verdict.comparisons if c.source == "Section 6.1"]
    dynamics = [c for c in verdict.comparisons if c.source != "Section 6.1"]
    wide = console.width >= _WIDE
    console.print(_table("Contact at D" if contact else "Equations of motion", dynamics, wide))
    if motion:
        console.print(_table("Motion of the points", motion, wide))
    console.print(
        "d/n: the largest difference is d units in the last place of what was summed;\n"
        "in that state two correct computations may differ by n.\n"
    )
    for assumption in verdict.assumptions:
        console.print(assumption)
    console.print(
        verdict.sentence, soft_wrap=True, style="bold green" if verdict.passed else "bold red"
    )
    for comparison in verdict.comparisons:
        if not comparison.passed:
            console.print(
                f"  {comparison.quantity}, {comparison.source} − {comparison.against}: "
                f"{comparison.difference:.17g} {comparison.unit} at {comparison.state}",
                soft_wrap=True,
            )


def _table(title: str, comparisons: list[Comparison], wide: bool) -> Any:
    """Return a table of quantities by sources; the points C1, C2 and D share a row.

    Where the terminal is not `wide`, the engine's names for the quantities are left out.
    """
    from rich import box
    from rich.table import Table

    pairs = list(dict.fromkeys((c.source, c.against) for c in comparisons))
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    table.add_column("quantity", no_wrap=True)
    if wide:
        table.add_column("Pinocchio's algorithm", no_wrap=True)
    for source, against in pairs:
        table.add_column(f"{source}\n− {against.split()[0]}", justify="right", no_wrap=True)
    for row in dict.fromkeys(c.quantity.partition(" of ")[0] for c in comparisons):
        inside = [c for c in comparisons if c.quantity.partition(" of ")[0] == row]
        points = dict.fromkeys(c.quantity.partition(" of ")[2] for c in inside)
        label = f"{row} of {', '.join(points)}" if len(points) > 1 else row
        worst = (
            max((c for c in inside if (c.source, c.against) == pair), key=lambda c: c.share)
            for pair in pairs
        )
        names = (label, inside[0].algorithm) if wide else (label,)
        table.add_row(*names, *map(_cell, worst))
    return table


def _cell(comparison: Comparison) -> str:
    mark = "[green]✓[/]" if comparison.passed else "[bold red]✗[/]"
    # Never longer than "<0.01", so that the mark is never cut off.
    units = f"{comparison.units:.2g}" if comparison.units < 100 else f"{comparison.units:.0e}"
    if 0 < comparison.units < 0.01:
        units = "<0.01"
    return f"{units}/{comparison.allowed_units:.0f} {mark}"


def _write_json(path: Path, verdict: Verdict) -> None:
    """Write a verdict whole or not at all."""
    comparisons = [{**asdict(c), "passed": c.passed} for c in verdict.comparisons]
    document = {
        **asdict(verdict),
        "comparisons": comparisons,
        "passed": verdict.passed,
        "sentence": verdict.sentence,
    }
    text = json.dumps(_as_json(document), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    with written_whole(path) as file:
        file.write_text(text, encoding="utf-8")


def _as_json(value: Any) -> Any:
    """Return a value with NaN and infinities as words, since JSON has no numbers for them."""
    if isinstance(value, dict):
        return {key: _as_json(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_as_json(entry) for entry in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _check_target(option: str, path: Path | None, suffixes: tuple[str, ...] = ()) -> None:
    """Refuse a file that could not be written in the end, before any work is done."""
    if path is None:
        return
    kind = f"a {' or '.join(suffixes)} file" if suffixes else "a file"
    wrong_kind = bool(suffixes) and path.suffix not in suffixes
    if wrong_kind or path.is_dir() or not os.access(path.parent, os.W_OK):
        _refuse(f"{option} is {path}; allowed is {kind} in a folder that can be written to")


@app.command()
def simulate(
    scene: Annotated[Path, typer.Argument(help="A scene file (TOML); see `twolink scenes`.")],
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
            "--effects-cost", help="Print what each effect adds to a step's cost, and nothing else."
        ),
    ] = False,
) -> None:
    """Simulate a scene to a measured accuracy.

    Says what was simulated, what it cost and how accurate it is. Exit code 0: the accuracy is
    met. 1: only up to the time that is printed. 2: the input was refused.
    """
    _check_target("--out", out, (".npz", ".csv", ".parquet"))
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from twolink.scene import Scene
    from twolink.simulation import simulate as run
    from twolink.simulation.storage import check_kind

    try:
        if out is not None:
            check_kind(out)
        if effects_cost:
            _print_effects_cost(Scene.load(scene), formulation)
            return
        loaded = Scene.load(scene)
        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task("simulating", total=1.0)
            trajectory = run(
                loaded,
                accuracy=accuracy,
                method=method,
                formulation=formulation,
                samples=samples,
                progress=lambda what, share: bar.update(
                    task, description=f"simulating, {what}", completed=share
                ),
            )
    except TwolinkError as error:
        _refuse(str(error))
    _print_trajectory(trajectory)
    if out is not None:
        _save(trajectory, out)
    if not trajectory.met:
        raise typer.Exit(FAILED)


@app.command()
def scenes(
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON schema of scene files, for editors.")
    ] = False,
) -> None:
    """List the scenes that come along, or print the schema."""
    from twolink.scene import Scene, scene_model
    from twolink.shipped import shipped

    if schema:
        typer.echo(json.dumps(scene_model().model_json_schema(), indent=2))
        return
    for file in sorted(shipped("scenes").rglob("*.toml")):
        typer.echo(f"{file.relative_to(Path.cwd()) if file.is_relative_to(Path.cwd()) else file}")
        scene = Scene.load(file)
        typer.echo(f"    {scene.title}: {scene.shows}")


def _print_effects_cost(scene: Scene, formulation: str) -> None:
    """Print the cost of a step, and what it is without each effect."""
    from rich import box
    from rich.console import Console
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
    Console(width=None if sys.stdout.isatty() else _WIDE, highlight=False).print(table)


def _print_trajectory(trajectory: Trajectory) -> None:
    """Print what was simulated, what it cost, and how accurate it is."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    scene, statistics = trajectory.scene, trajectory.statistics
    energy = trajectory.energy
    table = Table(title=scene.title, title_justify="left", box=box.SIMPLE_HEAD, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column()
    # As many decimals as are right.
    decimals = max(0, min(15, int(-math.log10(trajectory.error))))
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
    for name, value in rows.items():
        table.add_row(name, value)
    console = Console(width=None if sys.stdout.isatty() else _WIDE, highlight=False)
    console.print(table)
    _print_log(console, trajectory)
    for note in trajectory.notes:
        console.print(note, style="bold red", soft_wrap=True)


def _save(trajectory: Trajectory, path: Path) -> None:
    """Write a trajectory to a file, or say why that is not possible."""
    try:
        trajectory.save(path)
    except TwolinkError as error:
        _refuse(str(error))


def _print_log(console: Any, trajectory: Trajectory) -> None:
    """Print when modes begin and what impacts do; of very many the first and the last."""
    log: list[Any] = [*trajectory.impacts, *trajectory.events]
    log.sort(key=lambda entry: entry.time)
    hidden = len(log) - _LOG_LINES if len(log) > _LOG_LINES else 0
    shown = log if not hidden else [*log[: _LOG_LINES // 2], *log[-(_LOG_LINES // 2) :]]
    for number, entry in enumerate(shown):
        if hidden and number == _LOG_LINES // 2:
            console.print(f"  … {hidden} more, in Trajectory.events and Trajectory.impacts …")
        console.print(f"  {entry.time:.9g} s: {entry.what}", soft_wrap=True)
    gains = [impact.energy_change for impact in trajectory.impacts if impact.creates_energy]
    if gains:
        console.print(
            f"{len(gains)} of {len(trajectory.impacts)} impacts created energy, "
            f"{sum(gains):.6g} J in all: so does Newton's law with friction.",
            style="bold red",
            soft_wrap=True,
        )


def _refuse(sentence: str) -> NoReturn:
    """Say in one sentence what was received and what is allowed, and end with exit code 2."""
    typer.echo(f"twolink: {sentence}", err=True)
    raise typer.Exit(BAD_INPUT)


def main() -> None:
    """Run the command line."""
    for stream in (sys.stdout, sys.stderr):
        # A terminal without Greek letters shows question marks, not a traceback.
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")
    app()


if __name__ == "__main__":
    main()
