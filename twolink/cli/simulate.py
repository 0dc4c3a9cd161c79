"""The command `twolink simulate`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.importing import imported_meanwhile, importing
from twolink.cli.limits import Force, limits_of
from twolink.cli.options import Samples, SceneName, check_unused
from twolink.cli.progress import progress_bar
from twolink.cli.terminal import FAILED, RENDERING, check_target, console, print_table
from twolink.cli.trajectories import simulated
from twolink.names import EQUATIONS_NAMES
from twolink.suffixes import TRAJECTORIES
from twolink.text import either

if TYPE_CHECKING:
    from rich.console import Console

    from twolink.limits import Limits
    from twolink.names import EquationsName
    from twolink.scene import Scene
    from twolink.simulation import Trajectory

# More lines of a log than these are not read.
_LOG_LINES = 40

_Accuracy = Annotated[
    float | None,
    typer.Option(
        help="Global error allowed in all angles (rad) and speeds (rad/s). Default: the scene's."
    ),
]
_Method = Annotated[str | None, typer.Option(help="Integration method. Default: the scene's.")]
_Formulation = Annotated[
    str, typer.Option(help=f"Variables and equations: {either(EQUATIONS_NAMES)}.")
]
_Out = Annotated[
    Path | None,
    typer.Option(help=f"Write the trajectory to this {either(TRAJECTORIES)} file."),
]
_EffectsCost = Annotated[
    bool,
    typer.Option(
        "--effects-cost", help="Print the cost of each effect in a step, and nothing else."
    ),
]


def simulate(
    context: typer.Context,
    scene: SceneName,
    accuracy: _Accuracy = None,
    method: _Method = None,
    formulation: _Formulation = "momenta",
    samples: Samples = 501,
    out: _Out = None,
    effects_cost: _EffectsCost = False,
    force: Force = False,
) -> None:
    """Simulate a scene to a measured accuracy.

    Prints the motion, its cost and its accuracy. Exit code 0: the accuracy is
    met. 1: only up to the time that is printed. 2: the input was refused.
    """
    if effects_cost:
        check_unused(context, "--effects-cost", "accuracy", "method", "samples", "out")
    check_target("--out", out, TRAJECTORIES, inputs=[scene])
    with importing():
        from twolink.integration.methods import METHODS, method_named
        from twolink.scene import Scene
        from twolink.simulation import RunOptions
        from twolink.simulation.smooth.equations import equations_named

        if out is not None:
            from twolink.simulation.storage import check_kind

            check_kind(out)
        loaded = Scene.load(scene)
    if effects_cost:
        _print_effects_cost(loaded, equations_named(formulation), limits_of(force))
        return
    options = RunOptions(
        accuracy=accuracy,
        method=None if method is None else method_named(method),
        formulation=equations_named(formulation),
        samples=samples,
        limits=limits_of(force),
    )
    with importing():
        METHODS[options.method or loaded.method].import_libraries()
    with imported_meanwhile(*RENDERING), progress_bar(patience=0.5) as bar:
        trajectory = simulated(loaded, options, bar)
    _print_trajectory(trajectory)
    if out is not None:
        trajectory.save(out)
    if not trajectory.met:
        raise typer.Exit(FAILED)


def _print_effects_cost(scene: Scene, formulation: EquationsName, limits: Limits) -> None:
    """Print the cost of a step with all effects, and without each of them."""
    from twolink.simulation.effects_cost import effects_cost

    page = console()
    print_table(page, effects_cost(scene, formulation=formulation, limits=limits).table())
    page.print("Only the effects of the scene are simulated. Each is removed in turn.")


def _print_trajectory(trajectory: Trajectory) -> None:
    """Print the motion, its cost and its accuracy."""
    page = console()
    print_table(page, trajectory.summary())
    _print_log(page, trajectory)
    for note in trajectory.notes:
        style = None if note in trajectory.scene.notes else "bold red"
        page.print(note, style=style, soft_wrap=True)


def _print_log(page: Console, trajectory: Trajectory) -> None:
    """Print the modes and impacts; of very many the first and the last."""
    log = trajectory.log
    hidden = len(log) - _LOG_LINES if len(log) > _LOG_LINES else 0
    shown = log if not hidden else (*log[: _LOG_LINES // 2], *log[-(_LOG_LINES // 2) :])
    for number, entry in enumerate(shown):
        if hidden and number == _LOG_LINES // 2:
            page.print(f"  … {hidden} more, in Trajectory.log …")
        until = f" to {entry.until:.9g}" if entry.until > entry.time else ""
        page.print(f"  {entry.time:.9g}{until} s: {entry.words}", soft_wrap=True)
    gains = [impact.energy_change for impact in trajectory.impacts if impact.creates_energy]
    if gains:
        page.print(
            f"{len(gains)} of {len(trajectory.impacts)} impacts created energy, "
            f"{sum(gains):.6g} J in all: so does Newton's law with friction.",
            style="bold red",
            soft_wrap=True,
        )
