"""The energy balance: stored energy and the work of each effect."""

from __future__ import annotations

import re

import numpy as np
from matplotlib.figure import Figure

from twolink.errors import SimulationError
from twolink.simulation import Trajectory
from twolink.viz.plots.curves import Others, at_moments, flat, line_style
from twolink.viz.plots.moments import Array, time_axis
from twolink.viz.plots.style import figure, label_lines, note, palette_of, stroke
from twolink.viz.themes import theme_named

# The palette's lines of T, V and T + V: those of the films.
_COLOURS = {"$T$, kinetic": "kinetic", "$V$, potential": "potential"}


def energy(trajectory: Trajectory, theme: str = "light", others: Others | None = None) -> Figure:
    """Return a plot of T, V and T + V (J) over time (s), and of the work of each effect.

    Energies that would be flat are drawn as changes since the start. The works add up to the change
    of T; a note states the difference. For a trajectory without dense output the works are unknown,
    and a note states that they are omitted, as they are where `others` are drawn.
    """
    palette = palette_of(theme)
    drawn = at_moments(trajectory)
    works = None if others else _works(drawn)
    title = f"{trajectory.scene.title}: energy"
    made, axes = figure(palette, title, rows=1 if works is None else 2, sharex=True)
    named = {"": drawn}
    named |= {f", {name}": at_moments(other) for name, other in (others or {}).items()}
    since = flat([e for run in named.values() for e in _stored(run).values()], every=True)
    for motion, (name, run) in enumerate(named.items()):
        for number, (label, values) in enumerate(_stored(run).items()):
            style = line_style(palette, number, motion)
            if label in _COLOURS:
                style["color"] = getattr(theme_named(theme), _COLOURS[label])
            shown = values - values[0] if since else values
            axes[0].plot(run.t, shown, label=f"{label}{name}", **style)
    axes[0].set_ylabel("change of energy (J)" if since else "energy (J)")
    if works is not None:
        change = drawn.kinetic_energy - _start(drawn)
        axes[1].plot(drawn.t, change, label="change of $T$", **stroke(palette, 0))
        axes[1].lines[-1].set_color(theme_named(theme).kinetic)
        for number, (name, values) in enumerate(works.items(), start=3):
            axes[1].plot(drawn.t, values, label=in_words(name), **stroke(palette, number))
        axes[1].set_ylabel("work since the start (J)")
        left = float(np.abs(change - sum(works.values())).max())
        note(made, palette, f"The works add up to the change of T within {left:.1e} J.")
    elif not others:
        note(
            made, palette, "The works of the effects are unknown: the trajectory has only samples."
        )
    time_axis(axes, trajectory, palette)
    label_lines(*axes)
    return made


def _works(trajectory: Trajectory) -> dict[str, Array] | None:
    """Return the work of each effect (J), or None for a trajectory without dense output."""
    try:
        return trajectory.work()
    except SimulationError:
        return None


def _stored(trajectory: Trajectory) -> dict[str, Array]:
    return {
        "$T$, kinetic": trajectory.kinetic_energy,
        "$V$, potential": trajectory.potential_energy,
        "$T + V$": trajectory.energy,
    }


def in_words(name: str) -> str:
    """Return the name of an effect's class in words: CompliantSurface is "compliant surface"."""
    words, _, rest = name.partition(" ")
    return " ".join([re.sub(r"(?<=[a-z])(?=[A-Z])", " ", words).lower(), rest]).strip()


def _start(trajectory: Trajectory) -> float:
    """Return the initial T (J), before impacts at t = 0."""
    at_start = [i for i in trajectory.impacts if i.time == trajectory.t[0]]
    return at_start[0].kinetic_energy[0] if at_start else float(trajectory.kinetic_energy[0])
