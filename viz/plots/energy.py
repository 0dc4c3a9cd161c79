"""The energy balance: stored energy and the work of each effect."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from twolink.errors import SimulationError
from twolink.simulation import Trajectory
from viz.plots.moments import moments, time_axis
from viz.plots.style import figure, label_lines, note, palette_of, stroke


def energy(trajectory: Trajectory, theme: str = "light") -> Figure:
    """Return a plot of T, V and T + V (J) over time (s), and of the work of each effect.

    The works add up to the change of T; a note states the difference. For a trajectory without
    dense output the works are unknown, and a note states that they are omitted.
    """
    palette = palette_of(theme)
    shown = moments(trajectory)
    trajectory = replace(trajectory, t=shown.t, q=shown.q, u=shown.u)
    try:
        works = trajectory.work()
    except SimulationError:
        works = None
    title = f"{trajectory.scene.title}: energy"
    made, axes = figure(palette, title, rows=1 if works is None else 2, sharex=True)
    stored = {
        "$T$, kinetic": trajectory.kinetic_energy,
        "$V$, potential": trajectory.potential_energy,
        "$T + V$": trajectory.energy,
    }
    for number, (name, values) in enumerate(stored.items()):
        axes[0].plot(trajectory.t, values, label=name, **stroke(palette, number))
    axes[0].set_ylabel("energy (J)")
    if works is None:
        note(
            made, palette, "The works of the effects are unknown: the trajectory has only samples."
        )
    else:
        change = trajectory.kinetic_energy - _start(trajectory)
        axes[1].plot(trajectory.t, change, label="change of $T$", **stroke(palette, 0))
        for number, (name, values) in enumerate(works.items(), start=3):
            axes[1].plot(trajectory.t, values, label=in_words(name), **stroke(palette, number))
        axes[1].set_ylabel("work since the start (J)")
        left = float(np.abs(change - sum(works.values())).max())
        note(made, palette, f"The works add up to the change of T within {left:.1e} J.")
    time_axis(axes, trajectory, palette)
    label_lines(*axes)
    return made


def in_words(name: str) -> str:
    """Return the name of an effect's class in words: CompliantSurface is "compliant surface"."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()


def _start(trajectory: Trajectory) -> float:
    """Return the initial T (J), before impacts at t = 0."""
    at_start = [i for i in trajectory.impacts if i.time == trajectory.t[0]]
    return at_start[0].kinetic_energy[0] if at_start else float(trajectory.kinetic_energy[0])
