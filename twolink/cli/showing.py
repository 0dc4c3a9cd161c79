"""What `twolink view` and `twolink record` share: which runs are shown, and how."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twolink.cli.terminal import progress_bar, refuse
from twolink.errors import SceneError

if TYPE_CHECKING:
    from rich.progress import Progress

    from twolink.scene import Scene
    from twolink.simulation import Trajectory
    from viz.film import Film
    from viz.run import Run

Motion = Annotated[
    Path,
    typer.Argument(
        metavar="SCENE|TRAJECTORY", help="A scene (TOML), or a trajectory (.npz, .csv, .parquet)."
    ),
]
Ghosts = Annotated[
    list[str] | None,
    typer.Option(
        "--ghost",
        help="Another run beside it: a scene, a trajectory, momenta, lagrange, kane or "
        "pinocchio. May be given several times.",
    ),
]
Nearby = Annotated[
    float | None, typer.Option(help="A ghost that starts with q1 larger by so much (rad).")
]
OwnGeometry = Annotated[
    Path | None, typer.Option(help="Show this URDF's own geometry. Default: the scene's.")
]

KEPT = (".npz", ".csv", ".parquet")
_FORMULATIONS = ("momenta", "lagrange", "kane")
_PINOCCHIO = "pinocchio"

# The tolerance of SciPy's steps where Pinocchio moves the chain: near the finest it accepts.
_PEER_TOLERANCE = 1e-13


class ThemeName(StrEnum):
    """The themes of pictures, as the command line names them."""

    light = "light"
    dark = "dark"


Surroundings = Annotated[ThemeName, typer.Option(help="Light or dark surroundings.")]


def film_of(
    motion: Path,
    *,
    ghosts: list[str],
    nearby: float | None,
    urdf: Path | None,
    fps: float,
    speed: float,
    theme: str,
) -> Film:
    """Return the film of a scene or trajectory, with ghosts beside it.

    Simulates what must be, with a progress bar. Raises `TwolinkError` for what cannot be shown.
    """
    from viz.film import Film
    from viz.run import Run
    from viz.themes import theme_named
    from viz.urdf_bodies import urdf_bodies

    colours = theme_named(theme)
    with progress_bar() as bar:
        first = _trajectory(motion, bar)
        runs = [Run(f"{motion.stem}, {first.formulation}", first)]
        for ghost in ghosts:
            runs.append(_ghost(ghost, first, speed / fps, bar))
        if nearby is not None:
            scene = replace(first.scene, q=(first.scene.q[0] + nearby, first.scene.q[1]))
            runs.append(Run(f"q1 {nearby:+g} rad", _simulated(scene, bar, "the start nearby")))
    file = urdf or _urdf_of(motion)
    bodies = urdf_bodies(file, first.chain, own=urdf is None) if file else ()
    return Film(tuple(runs), fps=fps, speed=speed, theme=colours, bodies=bodies)


def _ghost(ghost: str, first: Trajectory, step: float, bar: Progress) -> Run:
    """Return the run that a word or a file names."""
    from viz.run import Run

    if ghost in _FORMULATIONS:
        return Run(ghost, _simulated(first.scene, bar, ghost, formulation=ghost))
    if ghost == _PINOCCHIO:
        return Run("Pinocchio, by SciPy's DOP853", _by_pinocchio(first, step))
    file = Path(ghost)
    if not file.exists():
        refuse(
            f"--ghost is '{ghost}'; allowed are the path of a scene or a trajectory, "
            f"{', '.join(_FORMULATIONS)} and {_PINOCCHIO}"
        )
    return Run(file.stem, _trajectory(file, bar))


def _trajectory(file: Path, bar: Progress) -> Trajectory:
    """Return the trajectory in a file, or of the scene in it."""
    from twolink.scene import Scene
    from twolink.simulation import Trajectory

    if file.suffix in KEPT:
        return Trajectory.load(file)
    if file.suffix == ".urdf":
        raise SceneError(
            f"{file}: a URDF says how a chain is made and not how it moves; allowed is a scene "
            'file with urdf = "…" in [chain]'
        )
    return _simulated(Scene.load(file), bar, file.stem)


def _simulated(scene: Scene, bar: Progress, what: str, **asked: Any) -> Trajectory:
    from twolink.simulation import simulate

    task = bar.add_task(f"simulating {what}", total=1.0)
    found = simulate(scene, progress=lambda run, share: bar.update(task, completed=share), **asked)
    bar.update(task, completed=1.0)
    return found


def _by_pinocchio(first: Trajectory, step: float) -> Trajectory:
    """Return the same motion by SciPy over Pinocchio, at the times of frames and some between."""
    import math

    import numpy as np

    from twolink.engines.scipy_pinocchio import ScipyOverPinocchio
    from twolink.simulation.trajectory import Statistics

    scene = first.scene
    # At frames its states are its own, and not what lies between two samples.
    finer = max(1, math.ceil(step * 120))
    frames = np.arange(math.floor(scene.duration / step * (1 + 1e-12)) + 1) * step
    between = (frames[:, None] + step * np.arange(finer) / finer).ravel()
    times = np.union1d(between[between < scene.duration], [0.0, scene.duration])
    run = ScipyOverPinocchio().prepared(scene, "DOP853")(_PEER_TOLERANCE, times)
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
    import tomllib

    if motion.suffix in KEPT:
        return None
    named = tomllib.loads(motion.read_text(encoding="utf-8"))["chain"].get("urdf")
    return motion.parent / named if named is not None else None
