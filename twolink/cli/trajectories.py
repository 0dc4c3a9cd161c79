"""Trajectories that commands show: simulated with a progress bar, or read from files."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from twolink.cli.terminal import warn
from twolink.suffixes import TRAJECTORIES

if TYPE_CHECKING:
    from twolink.cli.progress import ProgressBar
    from twolink.scene import Scene
    from twolink.simulation import RunOptions, Trajectory


def simulated(
    scene: Scene, options: RunOptions, bar: ProgressBar, doing: str = "simulating"
) -> Trajectory:
    """Simulate a scene, with a line of a progress bar."""
    from twolink.simulation import simulate_with

    task = bar.add_task(doing, total=1.0)

    def update(stage: str, share: float) -> None:
        bar.update(task, description=f"{doing}, {stage}", completed=share)

    found = simulate_with(scene, replace(options, progress=update))
    bar.update(task, completed=1.0)
    return found


def print_notes(motions: Iterable[Trajectory]) -> None:
    """Print the notes on all motions, which pictures do not show, each once."""
    for note in dict.fromkeys(note for motion in motions for note in motion.notes):
        warn(note)


def trajectory_of(file: Path, options: RunOptions, bar: ProgressBar) -> Trajectory:
    """Return the trajectory in a file, or of the scene in it."""
    from twolink.scene import Scene
    from twolink.simulation import Trajectory

    if file.suffix in TRAJECTORIES:
        return Trajectory.load(file)
    return simulated(Scene.load(file), options, bar, f"simulating {file.stem}")
