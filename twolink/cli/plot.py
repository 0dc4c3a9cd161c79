"""The command `twolink plot`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.limits import Force, limits_of
from twolink.cli.terminal import FAILED, check_target, progress_bar, refuse, say, warn
from twolink.errors import ParameterError
from twolink.suffixes import PLOTS, TRAJECTORIES
from twolink.text import choice, either

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.progress import Progress

    from twolink.simulation import Trajectory
    from twolink.urdf import PlanarUrdf

OF_MOTION = ("angles", "phase", "path", "energy", "reactions", "contact")
KINDS = (*OF_MOTION, "difference", "verification", "all")


def plot(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SCENE|TRAJECTORY",
            help="A scene (its name or TOML file), or a trajectory that `twolink simulate --out` "
            "wrote; a URDF for --kind verification.",
        ),
    ],
    kind: Annotated[str, typer.Option(help=f"Kind of plot: {', '.join(KINDS)}.")],
    out: Annotated[
        Path,
        typer.Option(help=f"The {either(PLOTS)} file to write; with --kind all NAME-angles.svg, …"),
    ],
    others: Annotated[
        list[Path] | None,
        typer.Option(
            "--with",
            help="Another scene or trajectory in the same plot (repeatable); for --kind "
            "difference exactly one.",
        ),
    ] = None,
    theme: Annotated[str, typer.Option(help="light or dark.")] = "light",
    samples: Annotated[
        int, typer.Option(help="How many evenly spaced samples a scene is simulated at.")
    ] = 2001,
    states: Annotated[
        int, typer.Option(help="How many random states a verification compares at.")
    ] = 10_000,
    seed: Annotated[int, typer.Option(help="Seed of these states.")] = 1,
    force: Force = False,
) -> None:
    """Plot a motion, its energy and contacts, or a verification.

    Exit code 0: the plots are written. 1: they are, and the motion is accurate only up to the time
    that is printed. 2: the input was refused.
    """
    source, beside = _source(source), [_source(other) for other in others or []]
    _check(source, beside, kind, out, theme, states, seed)
    if samples < 2:
        refuse(f"--samples must be 2 or more; got {samples}")
    with progress_bar() as bar:
        trajectory = None
        if kind != "verification":
            trajectory = _trajectory(source, samples, bar, force)
        together = {other.stem: _trajectory(other, samples, bar, force) for other in beside}
        drawn = _drawn(source, trajectory, together, kind, theme, states, seed, bar, force)
        written = _write(drawn, out, kind)
    for path in written:
        say(path)
    if kind == "all" and "contact" not in drawn:
        say("No plot of contact: the scene has no friction and no obstacle.")
    for note in () if trajectory is None else trajectory.notes:
        warn(note)
    if trajectory is not None and not trajectory.met:
        raise typer.Exit(FAILED)


def _source(named: Path) -> Path:
    """Return the file that is plotted: that of a shipped scene for its name."""
    from twolink.scene import scene_file

    return scene_file(named)


def _check(
    source: Path, beside: list[Path], kind: str, out: Path, theme: str, states: int, seed: int
) -> None:
    """Refuse invalid options before any work is done."""
    from viz.themes import THEMES

    if kind not in KINDS:
        refuse(choice("--kind", kind, KINDS))
    if theme not in THEMES:
        refuse(choice("--theme", theme, THEMES))
    check_target("--out", out, PLOTS)
    if states < 1:
        refuse(f"--states must be a positive whole number; got {states}")
    if seed < 0:
        refuse(f"--seed must be zero or a positive whole number; got {seed}")
    if beside and kind in ("contact", "verification", "all"):
        refuse(f"--with must be given with a kind of one motion or several; got --kind {kind}")
    if kind == "difference" and len(beside) != 1:
        refuse(f"--kind difference must be given with one --with; got {len(beside)}")
    if source.suffix == ".urdf" and kind != "verification":
        refuse(f"--kind must be verification for a URDF; got {kind} for {source}")
    wrong = [other for other in beside if other.suffix not in (".toml", *TRAJECTORIES)]
    if source.suffix not in (".toml", ".urdf", *TRAJECTORIES):
        wrong = [source]
    if wrong:
        refuse(
            f"{wrong[0]}: must be a scene (.toml) or a trajectory ({', '.join(TRAJECTORIES)}); "
            f"got the suffix '{wrong[0].suffix}'"
        )


def _trajectory(source: Path, samples: int, bar: Progress, force: bool) -> Trajectory:
    """Return the trajectory in a file, or of the scene in it."""
    from twolink.scene import Scene
    from twolink.simulation import Trajectory, simulate

    if source.suffix in TRAJECTORIES:
        return Trajectory.load(source)
    task = bar.add_task("simulating", total=1.0)
    return simulate(
        Scene.load(source),
        samples=samples,
        limits=limits_of(force),
        progress=lambda stage, share: bar.update(
            task, description=f"simulating, {stage}", completed=share
        ),
    )


def _drawn(
    source: Path,
    trajectory: Trajectory | None,
    others: dict[str, Trajectory],
    kind: str,
    theme: str,
    states: int,
    seed: int,
    bar: Progress,
    force: bool,
) -> dict[str, Figure]:
    """Return the figures of a kind, or of all that there are, by the names of their kinds."""
    found: dict[str, Figure] = {}
    if trajectory is not None:
        from viz.plots.kinds import plot_of

        wanted = OF_MOTION if kind == "all" else (kind,)
        task = bar.add_task("drawing", total=float(len(wanted)))
        for name in (name for name in wanted if name != "verification"):
            # A smooth motion has no contact to draw.
            if kind != "all" or name != "contact" or trajectory.events:
                found[name] = plot_of(name, trajectory, theme, others)
            bar.advance(task)
    if kind in ("verification", "all"):
        found["verification"] = _verification(_urdf(source), theme, states, seed, bar, force)
    return found


def _urdf(source: Path) -> PlanarUrdf:
    """Return the URDF that is verified: the file itself, or one of a scene's chain."""
    from twolink.scene import Scene
    from twolink.simulation import Trajectory
    from twolink.urdf import parse_planar_urdf, read_planar_urdf

    if source.suffix == ".urdf":
        return read_planar_urdf(source)
    scene = Scene.load(source) if source.suffix == ".toml" else Trajectory.load(source).scene
    return parse_planar_urdf(scene.chain.to_urdf())


def _verification(
    urdf: PlanarUrdf, theme: str, states: int, seed: int, bar: Progress, force: bool
) -> Figure:
    """Return the plot of the differences on a URDF."""
    from twolink.verification.differences import differences
    from viz.plots.verification import verification

    task = bar.add_task(f"comparing at {states} states", total=1.0)
    found = differences(
        urdf,
        states=states,
        seed=seed,
        progress=lambda share: bar.update(task, completed=share),
        limits=limits_of(force),
    )
    return verification(found, theme)


def _write(drawn: dict[str, Figure], out: Path, kind: str) -> list[Path]:
    """Write figures to a file, or each to one of its own, and return which."""
    from viz.plots.style import save

    paths = []
    for name, made in drawn.items():
        path = out.with_stem(f"{out.stem}-{name}") if kind == "all" else out
        if os.path.isdir(path):
            raise ParameterError(f"{path}: must be a file; got a folder")
        save(made, path)
        paths.append(path)
    return paths
