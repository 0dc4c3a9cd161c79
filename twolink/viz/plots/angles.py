"""Angles and speeds over time."""

from __future__ import annotations

from matplotlib.figure import Figure

from twolink.simulation import Trajectory
from twolink.viz.plots.curves import Others, flat, line_style, motions
from twolink.viz.plots.moments import time_axis
from twolink.viz.plots.style import figure, label_lines, palette_of

_UNITS = {"q": "angle (rad)", "u": "speed (rad/s)"}


def angles(trajectory: Trajectory, theme: str = "light", others: Others | None = None) -> Figure:
    """Return a plot of the absolute q (rad) and u (rad/s) over time (s), also of other motions.

    Where one curve would be flat beside the other, each has its own axes.
    """
    palette = palette_of(theme)
    shown = list(motions(trajectory, others or {}))
    rows: list[tuple[str, tuple[int, ...]]] = []
    for symbol in "qu":
        curves = [values for *_, motion in shown for values in getattr(motion, symbol)]
        together = [(0, 1)] if not flat(curves) else [(0,), (1,)]
        rows += [(symbol, own) for own in together]
    made, axes = figure(
        palette, f"{trajectory.scene.title}: angles and speeds", rows=len(rows), sharex=True
    )
    for each, (symbol, links) in zip(axes, rows, strict=True):
        for number, name, motion in shown:
            for link in links:
                values = getattr(motion, symbol)[link]
                label = f"${symbol}_{link + 1}${name}"
                each.plot(motion.t, values, label=label, **line_style(palette, link, number))
        each.set_ylabel(_UNITS[symbol])
    time_axis(axes, trajectory, palette)
    label_lines(*axes)
    return made
