"""The film that `twolink view` and `twolink record` show: its runs, and their options."""

from __future__ import annotations

import os
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.limits import limits_of
from twolink.cli.progress import ProgressBar, progress_bar
from twolink.cli.terminal import refuse
from twolink.cli.trajectories import simulated, trajectory_of
from twolink.names import EQUATIONS_NAMES
from twolink.suffixes import TRAJECTORIES
from twolink.text import choice, either

if TYPE_CHECKING:
    from twolink.limits import Limits
    from twolink.simulation import RunOptions, Trajectory
    from twolink.viz.film import Film
    from twolink.viz.run import Run

_PINOCCHIO = "pinocchio"

Motion = Annotated[
    Path,
    typer.Argument(
        metavar="SCENE|TRAJECTORY",
        help=f"A scene (name or TOML file), or a trajectory ({', '.join(TRAJECTORIES)}).",
    ),
]
Ghosts = Annotated[
    list[str] | None,
    typer.Option(
        "--ghost",
        metavar="RUN",
        help="Another run beside it: a scene, a trajectory, "
        f"{either((*EQUATIONS_NAMES, _PINOCCHIO))}. May be repeated.",
    ),
]
Nearby = Annotated[
    float | None, typer.Option(help="A ghost whose initial q1 is larger by this angle (rad).")
]
OwnGeometry = Annotated[
    Path | None, typer.Option(help="Show this URDF's own geometry. Default: the scene's.")
]
Speed = Annotated[float, typer.Option(help="Playback speed; 0.5 is slow motion.")]

# The tolerance of SciPy's steps where Pinocchio moves the chain: near the finest it accepts.
_ENGINE_TOLERANCE = 1e-13


# Memory (bytes) of a point of a trail while it is computed: measured as 310 to 460.
_BYTES_OF_A_POINT = 500

# Memory of a frame in a page that plays a film: measured as 45 kB to 73 kB, for the scene "drop"
# at 60 and 240 frames per second.
BYTES_OF_A_FRAME = 70_000


class ThemeName(StrEnum):
    """The themes of pictures, as the command line names them."""

    light = "light"
    dark = "dark"


Surroundings = Annotated[
    ThemeName | None,
    typer.Option(help="Colours. Default: those of the reader's screen in a page, else light."),
]


def film_of(
    motion: Path,
    *,
    ghosts: list[str],
    nearby: float | None,
    urdf: Path | None,
    fps: float,
    speed: float,
    theme: str | None,
    force: bool = False,
    frame_bytes: int = 0,
) -> Film:
    """Return the film of a scene or trajectory, with ghosts beside it.

    `frame_bytes` is the memory that a frame takes besides its points. Scenes are simulated, with a
    progress bar. Raises `TwolinkError` for motions that cannot be shown.
    """
    from twolink.scene import scene_file
    from twolink.simulation import RunOptions
    from twolink.viz.film import Film, check_rates
    from twolink.viz.run import Run
    from twolink.viz.themes import theme_named
    from twolink.viz.urdf_bodies import urdf_bodies

    motion = scene_file(motion)
    colours = theme_named(theme or ThemeName.light)
    check_rates(fps, speed)
    with progress_bar() as bar:
        options = RunOptions(limits=limits_of(force))
        first = trajectory_of(motion, options, bar)
        check_frames(first.scene.duration, fps, speed, frame_bytes, options.limits)
        runs = [Run(f"{motion.stem}, {first.formulation}", first)]
        for ghost in ghosts:
            runs.append(_ghost(ghost, first, speed / fps, bar, options))
        if nearby is not None:
            scene = replace(first.scene, q=(first.scene.q[0] + nearby, first.scene.q[1]))
            moved = simulated(scene, options, bar, "simulating the start nearby")
            runs.append(Run(f"q1 {nearby:+g} rad", moved))
    file = urdf or _urdf_of(motion)
    bodies = urdf_bodies(file, first.chain, own=urdf is None) if file else ()
    return Film(tuple(runs), fps=fps, speed=speed, theme=colours, bodies=bodies)


def check_frames(
    duration: float, fps: float, speed: float, frame_bytes: int, limits: Limits
) -> None:
    """Refuse more frames, or more points of trails between them, than memory can hold."""
    from twolink.viz.run import points_of_a_frame

    _, points = points_of_a_frame(fps)
    limits.check_memory(
        f"{duration:g} s at {fps:g} frames a second and a speed of {speed:g}",
        (frame_bytes + _BYTES_OF_A_POINT * points) * duration * fps / speed,
    )


def _ghost(
    ghost: str, first: Trajectory, step: float, bar: ProgressBar, options: RunOptions
) -> Run:
    """Return the run that a word or a file names."""
    from twolink.scene import scene_file
    from twolink.simulation.smooth.equations import equations_named
    from twolink.viz.run import Run

    if ghost in EQUATIONS_NAMES:
        own = replace(options, formulation=equations_named(ghost))
        return Run(ghost, simulated(first.scene, own, bar, f"simulating {ghost}"))
    if ghost == _PINOCCHIO:
        return Run("Pinocchio, by SciPy's DOP853", _by_pinocchio(first, step))
    file = scene_file(ghost)
    # Of a name that no file can have, a path would raise an error.
    if not os.path.exists(file):
        refuse(
            choice(
                "--ghost, unless it is the path of a scene or a trajectory,",
                ghost,
                (*EQUATIONS_NAMES, _PINOCCHIO),
            )
        )
    return Run(file.stem, trajectory_of(file, options, bar))


def _by_pinocchio(first: Trajectory, step: float) -> Trajectory:
    """Return the same motion by SciPy over Pinocchio, at the times of frames and some between."""
    import math

    import numpy as np

    from twolink.engines.scipy_pinocchio import ScipyOverPinocchio
    from twolink.simulation.run import Statistics
    from twolink.times import merged
    from twolink.viz.run import TRAIL_RATE

    scene = first.scene
    # States at frames are the engine's own, not interpolated between samples.
    finer = max(1, math.ceil(step * TRAIL_RATE))
    frames = np.arange(math.floor(scene.duration / step * (1 + 1e-12)) + 1) * step
    between = (frames[:, None] + step * np.arange(finer) / finer).ravel()
    times = merged(between[between < scene.duration], [0.0, scene.duration])
    run = ScipyOverPinocchio().prepared(scene, "DOP853")(_ENGINE_TOLERANCE, times)
    return replace(
        first,
        t=times,
        q=run.q,
        u=run.u,
        accuracy=math.nan,
        error=math.nan,
        method="DOP853 over Pinocchio's aba",
        formulation="pinocchio",
        statistics=Statistics(0, run.evaluations or 0, 1, run.setup_seconds, run.seconds),
        notes=(),
        _dense=None,
    )


def _urdf_of(motion: Path) -> Path | None:
    """Return the URDF that a scene file names for its chain."""
    from twolink.scene.text import read_text, tables

    if motion.suffix in TRAJECTORIES:
        return None
    named = tables(read_text(motion), str(motion))["chain"].get("urdf")
    return motion.parent / named if named is not None else None
