"""The command `twolink plot`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.limits import Force, limits_of
from twolink.cli.options import check_unused
from twolink.cli.progress import ProgressBar, progress_bar
from twolink.cli.showing import ThemeName
from twolink.cli.terminal import FAILED, check_target, refuse, say
from twolink.cli.trajectories import print_notes, trajectory_of
from twolink.suffixes import PLOTS, TRAJECTORIES
from twolink.text import choice, distinct_names, either

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from twolink.simulation import Trajectory
    from twolink.urdf import PlanarUrdf

OF_MOTION = ("angles", "phase", "path", "energy", "reactions", "contact")
KINDS = (*OF_MOTION, "difference", "verification", "all")

_Source = Annotated[
    Path,
    typer.Argument(
        metavar="SCENE|TRAJECTORY",
        help="A scene (its name or TOML file), or a trajectory that `twolink simulate --out` "
        "wrote; a URDF for --kind verification.",
    ),
]
_Kind = Annotated[str, typer.Option(help=f"Kind of plot: {', '.join(KINDS)}.")]
_Out = Annotated[
    Path,
    typer.Option(
        help=f"The {either(PLOTS)} file to write. With --kind all, NAME.svg is NAME-angles.svg and "
        "so on."
    ),
]
_Others = Annotated[
    list[Path] | None,
    typer.Option(
        "--with",
        metavar="PATH",
        help="Another scene or trajectory in the same plot. May be repeated; for --kind "
        "difference exactly one.",
    ),
]
_Theme = Annotated[str, typer.Option(help=f"{either(list(ThemeName))}.")]
_Samples = Annotated[
    int, typer.Option(help="How many evenly spaced samples a scene is simulated at.")
]
_States = Annotated[int, typer.Option(help="How many random states a verification compares at.")]
_Seed = Annotated[int, typer.Option(help="Seed of these states.")]


def plot(
    context: typer.Context,
    source: _Source,
    kind: _Kind,
    out: _Out,
    others: _Others = None,
    theme: _Theme = "light",
    samples: _Samples = 2001,
    states: _States = 10_000,
    seed: _Seed = 1,
    force: Force = False,
) -> None:
    """Plot a motion, its energy and contacts, or a verification.

    Exit code 0: the plots are written. 1: they are, and a motion is accurate only up to the time
    that is printed. 2: the input was refused.
    """
    asked = _Asked(
        _source(source), tuple(map(_source, others or [])),
        kind, out, theme, samples, states, seed, force,
    )  # fmt: skip
    _check(asked)
    _check_unused(context, asked)
    motions, drawn, written = _plotted(asked)
    for path in written:
        say(path)
    if kind == "all" and "contact" not in drawn:
        say("No plot of contact: the scene has no friction and no obstacle.")
    print_notes(motions)
    if not all(motion.met for motion in motions):
        raise typer.Exit(FAILED)


def _source(named: Path) -> Path:
    """Return the file that is plotted: that of a shipped scene for its name."""
    from twolink.scene import scene_file

    return scene_file(named)


@dataclass(frozen=True)
class _Asked:
    """The options of the command."""

    source: Path
    beside: tuple[Path, ...]
    kind: str
    out: Path
    theme: str
    samples: int
    states: int
    seed: int
    force: bool

    @property
    def targets(self) -> list[Path]:
        """The files that may be written, of all kinds."""
        return [self.target(kind) for kind in (*OF_MOTION, "verification")]

    def target(self, drawn: str) -> Path:
        """Return the file of a kind of plot."""
        return self.out.with_stem(f"{self.out.stem}-{drawn}") if self.kind == "all" else self.out


def _plotted(asked: _Asked) -> tuple[list[Trajectory], dict[str, Figure], list[Path]]:
    """Return the motions that are drawn, the figures by kind, and the files written."""
    from twolink.simulation import RunOptions

    options = RunOptions(samples=asked.samples, limits=limits_of(asked.force))
    with progress_bar() as bar:
        trajectory = None
        if asked.kind != "verification":
            trajectory = trajectory_of(asked.source, options, bar)
        names = distinct_names(other.stem for other in asked.beside)
        motions = (trajectory_of(other, options, bar) for other in asked.beside)
        others = dict(zip(names, motions, strict=True))
        drawn = _drawn(asked, trajectory, others, bar)
        first = [] if trajectory is None else [trajectory]
        return [*first, *others.values()], drawn, _write(drawn, asked)


def _check(asked: _Asked) -> None:
    """Refuse invalid options before any work is done."""
    from twolink.viz.themes import THEMES

    if asked.kind not in KINDS:
        refuse(choice("--kind", asked.kind, KINDS))
    if asked.theme not in THEMES:
        refuse(choice("--theme", asked.theme, THEMES))
    check_target(
        "--out",
        asked.out,
        PLOTS,
        inputs=[asked.source, *asked.beside],
        targets=asked.targets,
    )
    if asked.states < 1:
        refuse(f"--states must be a positive whole number; got {asked.states}")
    if asked.seed < 0:
        refuse(f"--seed must be zero or a positive whole number; got {asked.seed}")
    if asked.beside and asked.kind in ("contact", "verification", "all"):
        refuse(
            f"--with must be given with a kind of one motion or several; got --kind {asked.kind}"
        )
    if asked.kind == "difference" and len(asked.beside) != 1:
        refuse(f"--kind difference must be given with one --with; got {len(asked.beside)}")
    if asked.source.suffix == ".urdf" and asked.kind != "verification":
        refuse(f"--kind must be verification for a URDF; got {asked.kind} for {asked.source}")
    wrong = [other for other in asked.beside if other.suffix not in (".toml", *TRAJECTORIES)]
    if asked.source.suffix not in (".toml", ".urdf", *TRAJECTORIES):
        wrong = [asked.source]
    if wrong:
        refuse(
            f"{wrong[0]}: must be a scene (.toml) or a trajectory ({', '.join(TRAJECTORIES)}); "
            f"got the suffix '{wrong[0].suffix}'"
        )
    if asked.samples < 2:
        refuse(f"--samples must be 2 or more; got {asked.samples}")


def _check_unused(context: typer.Context, asked: _Asked) -> None:
    """Refuse options without effect on plots of this kind, or of trajectories alone."""
    beside = f"--kind {asked.kind}"
    if asked.kind == "verification":
        check_unused(context, beside, "samples")
    elif asked.kind != "all":
        check_unused(context, beside, "states", "seed")
    if all(file.suffix in TRAJECTORIES for file in (asked.source, *asked.beside)):
        check_unused(context, "a trajectory, which has its own", "samples")


def _drawn(
    asked: _Asked, trajectory: Trajectory | None, others: dict[str, Trajectory], bar: ProgressBar
) -> dict[str, Figure]:
    """Return the figures of a kind, or of all that there are, by the names of their kinds."""
    found: dict[str, Figure] = {}
    if trajectory is not None:
        from twolink.viz.plots.kinds import plot_of

        wanted = OF_MOTION if asked.kind == "all" else (asked.kind,)
        task = bar.add_task("drawing", total=float(len(wanted)))
        for name in (name for name in wanted if name != "verification"):
            # A smooth motion has no contact to draw.
            if asked.kind != "all" or name != "contact" or trajectory.events:
                found[name] = plot_of(name, trajectory, asked.theme, others)
            bar.advance(task)
    if asked.kind in ("verification", "all"):
        found["verification"] = _verification(asked, bar)
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


def _verification(asked: _Asked, bar: ProgressBar) -> Figure:
    """Return the plot of the differences on a URDF."""
    from twolink.verification.differences import differences
    from twolink.viz.plots.verification import verification

    task = bar.add_task(f"comparing at {asked.states} states", total=1.0)
    found = differences(
        _urdf(asked.source),
        states=asked.states,
        seed=asked.seed,
        progress=lambda share: bar.update(task, completed=share),
        limits=limits_of(asked.force),
    )
    return verification(found, asked.theme)


def _write(drawn: dict[str, Figure], asked: _Asked) -> list[Path]:
    """Write figures to a file, or each to one of its own, and return which."""
    from twolink.viz.plots.style import save

    for name, made in drawn.items():
        save(made, asked.target(name))
    return [asked.target(name) for name in drawn]
