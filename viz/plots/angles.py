"""Angles and speeds over time."""

from __future__ import annotations

from matplotlib.figure import Figure

from twolink.simulation import Trajectory
from viz.plots.moments import moments, time_axis
from viz.plots.style import figure, label_lines, palette_of, stroke


def angles(trajectory: Trajectory, theme: str = "light") -> Figure:
    """Return a plot of the absolute q (rad) and u (rad/s) over time (s)."""
    palette = palette_of(theme)
    made, axes = figure(
        palette, f"{trajectory.scene.title}: angles and speeds", rows=2, sharex=True
    )
    shown = moments(trajectory)
    for each, pair, symbol, unit in zip(
        axes, (shown.q, shown.u), "qu", ("angle (rad)", "speed (rad/s)"), strict=True
    ):
        for link, values in enumerate(pair):
            each.plot(shown.t, values, label=f"${symbol}_{link + 1}$", **stroke(palette, link))
        each.set_ylabel(unit)
    time_axis(axes, trajectory, palette)
    label_lines(*axes)
    return made
