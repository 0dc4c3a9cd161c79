"""Reactions at the joints over time."""

from __future__ import annotations

from matplotlib.figure import Figure

from twolink.simulation import Trajectory
from twolink.viz.plots.curves import Others, at_moments, line_style
from twolink.viz.plots.moments import time_axis
from twolink.viz.plots.style import figure, label_lines, palette_of


def reactions(trajectory: Trajectory, theme: str = "light", others: Others | None = None) -> Figure:
    """Return the force of the ground at A and that of link 1 on link 2 at B (N) over time (s).

    Impulses of impacts, which have no finite force, are not in it.
    """
    palette = palette_of(theme)
    made, axes = figure(palette, f"{trajectory.scene.title}: joint reactions", rows=2, sharex=True)
    named = {"": trajectory, **{f", {name}": other for name, other in (others or {}).items()}}
    for number, (name, motion) in enumerate(named.items()):
        drawn = at_moments(motion)
        for each, joint, force in zip(axes, "AB", drawn.reactions(), strict=True):
            for component, axis in enumerate("xy"):
                style = line_style(palette, component + 2, number)
                each.plot(drawn.t, force[component], label=f"${joint}_{axis}${name}", **style)
            each.set_ylabel(f"force at {joint} (N)")
    time_axis(axes, trajectory, palette)
    label_lines(*axes)
    return made
