"""The path of the end point D in the plane of motion, y downward."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from twolink import kinematics
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.surface import Surface
from twolink.simulation import Trajectory
from twolink.viz.plots.curves import Others, line_style
from twolink.viz.plots.moments import Array, Moments, moments
from twolink.viz.plots.phase import mark
from twolink.viz.plots.style import Palette, figure, note, palette_of, plain, stroke

# A figure's width and margins (inch); bounds of the axes' aspect ratio.
_WIDTH, _BESIDE, _ABOVE = 7.2, 0.75, 1.15
_LOWEST, _HIGHEST = 0.45, 0.95
# The margin and the hatching of a surface, relative to the drawing.
_FREE, _HATCH = 0.09, 0.022
# A path is refined until it turns by less than this (rad) from step to step, so many times at most,
# where its steps are longer than this part of its size.
_TURN, _HALVINGS, _VISIBLE, _MOST = 0.1, 6, 1e-3, 20_000


def path(trajectory: Trajectory, theme: str = "light", others: Others | None = None) -> Figure:
    """Return a plot of the path of D (m), the chain at start and end, surfaces and impacts of D.

    Of other motions it has the paths, with a legend.
    """
    palette = palette_of(theme)
    shown = path_moments(trajectory)
    chain = trajectory.chain
    x, y = np.array(kinematics.position(chain, tuple(shown.q), chain.D))
    beside = {name: _end_path(other) for name, other in (others or {}).items()}
    elbows = np.array(kinematics.position(chain, tuple(shown.q[:, [0, -1]]), chain.B))
    view = View.around(np.column_stack([[x, y], *beside.values(), elbows, [0.0, 0.0]]))
    made, (axes,) = figure(palette, f"{trajectory.scene.title}: path of D", size=view.size)
    axes.set_aspect("equal")
    axes.set_xlim(view.left, view.right)
    axes.set_ylim(view.bottom, view.top)
    for effect in trajectory.scene.effects:
        if isinstance(effect, (Surface, CompliantSurface)):
            draw_surface(axes, palette, view, effect)
    for moment, alpha in ((0, 0.35), (-1, 0.8)):
        draw_chain(axes, palette, trajectory, shown.q[:, moment], alpha)
    axes.plot(x, y, label="_path", **{**stroke(palette, 2), "linestyle": "solid", "linewidth": 1.2})
    for number, (name, way) in enumerate(beside.items(), start=1):
        style = line_style(palette, number + 2, number)
        axes.plot(*way, **style, label=plain(name))
    if beside:
        axes.legend(frameon=False, fontsize=9, labelcolor=palette.ink)
    struck = _draw_impacts(axes, palette, trajectory, shown)
    mark(axes, palette, (x[0], y[0]), "start", above=True)
    mark(axes, palette, (x[-1], y[-1]), "end", above=False)
    axes.annotate(
        "A", (0, 0), xytext=(-7, 7), textcoords="offset points", ha="right", color=palette.ink
    )
    if struck:
        note(made, palette, struck)
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m), downward")
    return made


def path_moments(trajectory: Trajectory) -> Moments:
    """Return the moments of a path: between them D turns by a small angle.

    A trajectory without dense output has only its samples.
    """
    shown = moments(trajectory)
    if not shown.known_between:
        return shown
    times = shown.t
    for _ in range(_HALVINGS):
        q, _ = trajectory.at(times)
        x, y = np.array(kinematics.position(trajectory.chain, tuple(q), trajectory.chain.D))
        steps = np.array([np.diff(x), np.diff(y)])
        turns = np.abs(np.angle((steps[0] + 1j * steps[1])[1:] * (steps[0] - 1j * steps[1])[:-1]))
        lengths = np.hypot(*steps)
        # Short steps turn invisibly, as at a cusp.
        sharp = (turns > _TURN) & (
            np.maximum(lengths[1:], lengths[:-1]) > _VISIBLE * np.ptp([x, y])
        )
        split = np.unique(np.concatenate([np.flatnonzero(sharp), np.flatnonzero(sharp) + 1]))
        middles = (times[split] + times[split + 1]) / 2
        middles = middles[(middles > times[split]) & (middles < times[split + 1])]
        if not len(middles) or len(times) > _MOST:
            break
        times = np.union1d(times, middles)
    q, u = trajectory.at(times)
    return Moments(times, q, u, known_between=True)


def _end_path(trajectory: Trajectory) -> Array:
    """Return the path of D (m), shape (2, n)."""
    q = path_moments(trajectory).q
    return np.array(kinematics.position(trajectory.chain, tuple(q), trajectory.chain.D))


@dataclass(frozen=True)
class View:
    """The visible part of the plane (m); y increases downward, from top to bottom."""

    left: float
    right: float
    top: float
    bottom: float

    @classmethod
    def around(cls, points: Array) -> View:
        """Return a view of points, shape (2, n), with a margin and bounds on its aspect ratio."""
        low, high = points.min(axis=1), points.max(axis=1)
        middle, half = (low + high) / 2, (high - low) / 2 + _FREE * float(np.hypot(*(high - low)))
        half = np.maximum(half, [half[1] / _HIGHEST, half[0] * _LOWEST])
        (left, top), (right, bottom) = middle - half, middle + half
        return cls(float(left), float(right), float(top), float(bottom))

    @property
    def size(self) -> tuple[float, float]:
        """The width and height of a figure for this view (inch)."""
        share = (self.bottom - self.top) / (self.right - self.left)
        return _WIDTH, (_WIDTH - _BESIDE) * share + _ABOVE

    @property
    def diagonal(self) -> float:
        """The length of the diagonal (m)."""
        return float(np.hypot(self.right - self.left, self.bottom - self.top))

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Return a mask of the points, shape (2, n), that are in the view."""
        x, y = points
        return (self.left <= x) & (x <= self.right) & (self.top <= y) & (y <= self.bottom)


def draw_chain(
    axes: Axes,
    palette: Palette,
    trajectory: Trajectory,
    q: Array,
    alpha: float,
    width: float = 5.0,
) -> None:
    """Draw both links in a pose, in lines of a width (points)."""
    chain = trajectory.chain
    B, D = (kinematics.position(chain, tuple(q), point) for point in (chain.B, chain.D))
    for link, (start, end) in enumerate((((0.0, 0.0), B), (B, D))):
        axes.plot(
            (start[0], end[0]),
            (start[1], end[1]),
            color=palette.lines[link],
            linewidth=width,
            alpha=alpha,
            solid_capstyle="round",
            label=f"_link {link + 1}",
        )
    for x, y in ((0.0, 0.0), B):
        axes.plot(
            x,
            y,
            "o",
            markersize=width,
            color=palette.paper,
            markeredgecolor=palette.ink,
            alpha=alpha,
        )  # fmt: skip


def _draw_impacts(axes: Axes, palette: Palette, trajectory: Trajectory, shown: Moments) -> str:
    """Mark the impacts of D, with areas proportional to the impulse, and return a description."""
    of_D = [impact for impact in trajectory.impacts if impact.name.startswith("D on ")]
    if not of_D:
        return ""
    # The pose does not change in an impact.
    nearest = np.searchsorted(shown.t, [impact.time for impact in of_D]).clip(0, len(shown.t) - 1)
    chain = trajectory.chain
    places = np.array(kinematics.position(chain, tuple(shown.q[:, nearest]), chain.D))
    impulses = np.array([impact.normal_impulse for impact in of_D])
    axes.scatter(
        places[0],
        places[1],
        s=12 + 140 * impulses / impulses.max(),
        facecolors="none",
        edgecolors=palette.ink,
        linewidths=0.9,
        zorder=4,
    )
    return (
        f"{len(of_D)} impact{'s' if len(of_D) > 1 else ''} on D: circles, their area as the "
        f"impulse, the largest {impulses.max():.3g} N s"
    )


def draw_surface(
    axes: Axes, palette: Palette, view: View, surface: Any, *, named: bool = True
) -> None:
    """Draw the edge of a half-plane across the view, with hatching inside, and its name."""
    normal = np.array(surface.normal) / float(np.hypot(*surface.normal))
    along = np.array([-normal[1], normal[0]])
    point = np.array(surface.point)
    middle = np.array([(view.left + view.right) / 2, (view.top + view.bottom) / 2])
    foot = point + along * float(along @ (middle - point))
    step = _HATCH * view.diagonal
    places = step * np.arange(-round(1 / _HATCH), round(1 / _HATCH) + 1)
    edge = foot[:, None] + along[:, None] * places
    axes.plot(*edge, color=palette.ink, linewidth=1.2, label="_surface")
    for start in edge.T:
        end = start + step * (along - normal)
        axes.plot(*np.array([start, end]).T, color=palette.ink, linewidth=0.6, alpha=0.6)
    # The name is below a floor at the right, or at another visible part of its edge.
    inside = edge - 1.9 * step * normal[:, None]
    seen = inside[:, view.holds(inside)]
    if named and seen.size:
        x, y = seen[:, np.argsort(seen[0] + seen[1])[-min(4, seen.shape[1])]]
        axes.text(
            x, y, plain(surface.name), ha="center", va="center", color=palette.ink, fontsize=9,
            bbox={"facecolor": palette.paper, "edgecolor": "none", "pad": 0.8},
        )  # fmt: skip
