"""Phase portraits: each link's speed over its angle."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twolink.simulation import Trajectory
from viz.plots.moments import moments
from viz.plots.style import Palette, figure, palette_of, stroke

_SIZE = (7.2, 3.6)


def phase(trajectory: Trajectory, theme: str = "light") -> Figure:
    """Return u1 over q1 and u2 over q2 (rad/s, rad), with start and end marked."""
    palette = palette_of(theme)
    made, axes = figure(
        palette, f"{trajectory.scene.title}: phase portraits", columns=2, size=_SIZE
    )
    shown = moments(trajectory)
    for link, each in enumerate(axes):
        # Each link has separate axes, so that dashes are not needed.
        each.plot(
            shown.q[link],
            shown.u[link],
            **{**stroke(palette, link), "linestyle": "solid", "linewidth": 1.1},
        )
        each.set_xlabel(f"$q_{link + 1}$ (rad)")
        each.set_ylabel(f"$u_{link + 1}$ (rad/s)")
        each.set_title(f"link {link + 1}", loc="left", color=palette.ink, fontsize=10)
        each.margins(0.1)
        places = shown.q[link], shown.u[link]
        mark(each, palette, (places[0][0], places[1][0]), "start", above=True)
        mark(each, palette, (places[0][-1], places[1][-1]), "end", above=False)
    return made


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
