"""Work against precision: what each way costs for each error it reaches."""

from __future__ import annotations

from matplotlib.figure import Figure

from twolink.accuracy.front import ways_of
from twolink.accuracy.study import Study
from twolink.accuracy.ways import OWN
from twolink.accuracy.work_precision import Point
from viz.plots.style import (
    BLUE,
    GREEN,
    GREY,
    PURPLE,
    VERMILION,
    YELLOW,
    figure,
    in_theme,
    label_lines,
)

# Colour, dashes and marks by what a way is.
_TAYLOR = (BLUE, "-", "o")
_SYMPLECTIC = (GREEN, "--", "^")
_RUNGE_KUTTA = (VERMILION, "-.", "s")
_PEER = (PURPLE, ":", "D")
_KEEP_AREAS = ("semi-implicit-euler", "implicit-midpoint", "gauss-legendre-4", "gauss-legendre-6")

# Errors beyond a good part of a radian tell nothing.
_LARGEST_ERROR = 1.0


def work_precision_plot(study: Study, theme: str = "light") -> Figure:
    """Return a plot of time (s) against error (rad, rad/s), a line for each way.

    Accuracy grows to the right. The best that can be had for any time is a broad band behind.
    """
    measured = study.work_precision
    drawn, axes = figure(theme, (8.4, 5.6))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.invert_xaxis()
    front = [point for point in study.front if point.error < _LARGEST_ERROR]
    axes.plot(*_xy(front), color=YELLOW, linewidth=9, alpha=0.55, solid_capstyle="round", zorder=1)
    labels = {}
    for name, points in ways_of(study.points).items():
        seen = [p for p in points if not p.failed and 0 < p.error < _LARGEST_ERROR]
        if not seen:
            continue
        colour, dashes, mark = _family(seen[0])
        (line,) = axes.plot(
            *_xy(seen),
            color=in_theme(colour, theme),
            linestyle=dashes,
            linewidth=1.2,
            marker=mark,
            markersize=3.5,
            label=name,
        )
        labels[line] = name
    axes.axvline(study.floor.error, color=GREY, linewidth=1, linestyle=(0, (1, 2)), zorder=0)
    axes.text(
        study.floor.error, 0.99, " float64 ends here", transform=axes.get_xaxis_transform(),
        fontsize=8, va="top", ha="left", color=GREY,
    )  # fmt: skip
    axes.set_xlabel(f"error at {measured.judged_at} (rad, rad/s)")
    axes.set_ylabel("time to run (s), median")
    axes.set_title(f"{measured.scene.title}, {measured.scene.duration:g} s: what accuracy costs")
    label_lines(axes, labels)
    return drawn


def _xy(points: list[Point]) -> tuple[list[float], list[float]]:
    return [point.error for point in points], [point.seconds for point in points]


def _family(point: Point) -> tuple[str, str, str]:
    if point.engine != OWN:
        return _PEER
    if point.method == "taylor":
        return _TAYLOR
    return _SYMPLECTIC if point.method in _KEEP_AREAS else _RUNGE_KUTTA
