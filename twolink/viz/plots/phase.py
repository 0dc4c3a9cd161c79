"""Phase portraits: each link's speed over its angle, with the sense of time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twolink.simulation import Trajectory
from twolink.viz.plots.curves import Others, line_style, motions
from twolink.viz.plots.moments import Array
from twolink.viz.plots.style import Palette, figure, note, palette_of

_SIZE = (7.2, 3.6)

# Arrows at these parts of a curve's length show the sense of time.
_ARROWS = (0.1, 0.3, 0.5, 0.7, 0.9)


def phase(trajectory: Trajectory, theme: str = "light", others: Others | None = None) -> Figure:
    """Return u1 over q1 and u2 over q2 (rad/s, rad), with start, end and direction marked."""
    palette = palette_of(theme)
    made, axes = figure(
        palette, f"{trajectory.scene.title}: phase portraits", columns=2, size=_SIZE
    )
    shown = list(motions(trajectory, others or {}))
    for link, each in enumerate(axes):
        for number, _, motion in shown:
            style = line_style(palette, link, number)
            # One motion has axes of its own for each link, so that dashes are not needed.
            style |= {"linewidth": 1.1} | ({} if others else {"linestyle": "solid"})
            each.plot(motion.q[link], motion.u[link], **style)
        each.set_xlabel(f"$q_{link + 1}$ (rad)")
        each.set_ylabel(f"$u_{link + 1}$ (rad/s)")
        each.set_title(f"link {link + 1}", loc="left", color=palette.ink, fontsize=10)
        each.margins(0.1)
        for _, name, motion in shown:
            angle, speed = motion.q[link], motion.u[link]
            _direct(each, palette, angle, speed, link)
            end = f"end{name}"
            mark(each, palette, (angle[0], speed[0]), f"start{name}", above=True)
            mark(each, palette, (angle[-1], speed[-1]), end, above=False)
    note(made, palette, "Arrows show the direction of time.")
    return made


def _direct(axes: Axes, palette: Palette, angle: Array, speed: Array, link: int) -> None:
    """Draw arrowheads along a curve, in the direction of time."""
    spans = [float(np.ptp(values)) or 1.0 for values in (angle, speed)]
    steps = np.hypot(np.diff(angle) / spans[0], np.diff(speed) / spans[1])
    length = np.concatenate([[0.0], np.cumsum(steps)])
    if length[-1] == 0:
        return
    for part in _ARROWS:
        # The step that contains this part of the length has a length.
        index = int(np.searchsorted(length, part * length[-1], side="left"))
        axes.annotate(
            "",
            xy=(angle[index], speed[index]),
            xytext=(angle[index - 1], speed[index - 1]),
            arrowprops={
                "arrowstyle": "-|>",
                "color": palette.lines[link],
                "shrinkA": 0,
                "shrinkB": 0,
                "linewidth": 0,
                "mutation_scale": 11,
            },
        )


def mark(
    axes: Axes, palette: Palette, place: tuple[float, float], words: str, *, above: bool
) -> None:
    """Mark a point with a ring or a disc, and a text above or below."""
    axes.plot(
        *place,
        "o",
        markersize=5.5,
        color=palette.paper if above else palette.ink,
        markeredgecolor=palette.ink,
        zorder=5,
    )
    axes.annotate(
        words,
        xy=place,
        xytext=(5, 5 if above else -5),
        textcoords="offset points",
        va="bottom" if above else "top",
        color=palette.ink,
        fontsize=9,
        bbox={"facecolor": palette.paper, "edgecolor": "none", "alpha": 0.7, "pad": 0.8},
        zorder=6,
    )
