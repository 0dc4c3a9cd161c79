"""Work-precision diagram: time of each method configuration against error."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twolink.accuracy.method_configurations import OWN
from twolink.accuracy.pareto import by_configuration
from twolink.accuracy.study import Study
from twolink.accuracy.work_precision import Point
from twolink.integration.methods import METHODS
from twolink.viz.plots.style import Palette, figure, label_lines, palette_of

# The line number, dashes and marks of each kind of configuration.
_TAYLOR = (0, "-", "o")
_RUNGE_KUTTA = (1, "-.", "s")
_SYMPLECTIC = (2, "--", "^")
_ENGINE = (3, ":", "D")
_KEEP_AREAS = {name for name, method in METHODS.items() if method.symplectic}

# Errors beyond a large part of a radian are meaningless.
_LARGEST_ERROR = 1.0


def work_precision_plot(study: Study, theme: str = "light") -> Figure:
    """Return a plot of time (s) against error (rad, rad/s), one line per configuration.

    Accuracy increases to the right. The Pareto front is a broad band in the background.
    """
    measured, palette = study.work_precision, palette_of(theme)
    scene = measured.scene
    title = f"{scene.title}, {scene.duration:g} s: the cost of accuracy"
    drawn, (axes,) = figure(palette, title, size=(8.4, 5.8))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.invert_xaxis()
    front = [point for point in study.pareto_front if point.error < _LARGEST_ERROR]
    axes.plot(
        *_xy(front), color=palette.bands[0], linewidth=10, solid_capstyle="round", zorder=1,
        label="_Pareto front",
    )  # fmt: skip
    for name, points in by_configuration(study.points).items():
        seen = [p for p in points if not p.failed and 0 < p.error < _LARGEST_ERROR]
        if seen:
            number, dashes, mark = _family(seen[0])
            axes.plot(
                *_xy(seen), color=palette.lines[number], linestyle=dashes, linewidth=1.2,
                marker=mark, markersize=3.5, label=name,
            )  # fmt: skip
    _mark_the_floor(axes, study.roundoff_floor.error, palette)
    axes.set_xlabel(f"error at {measured.judged_at} (rad, rad/s)")
    axes.set_ylabel("time to run (s), median")
    label_lines(axes)
    return drawn


def _mark_the_floor(axes: Axes, error: float, palette: Palette) -> None:
    """Draw the round-off floor of double precision."""
    axes.axvline(
        error, color=palette.ink, linewidth=0.8, linestyle=(0, (1, 2)), zorder=0, label="_floor"
    )
    axes.annotate(
        "float64 round-off", (error, 0.99), xycoords=axes.get_xaxis_transform(), xytext=(3, 0),
        textcoords="offset points", fontsize=8, va="top", ha="left", color=palette.ink,
    )  # fmt: skip


def _xy(points: list[Point]) -> tuple[list[float], list[float]]:
    return [point.error for point in points], [point.seconds for point in points]


def _family(point: Point) -> tuple[int, str, str]:
    if point.engine != OWN:
        return _ENGINE
    if point.method == "taylor":
        return _TAYLOR
    return _SYMPLECTIC if point.method in _KEEP_AREAS else _RUNGE_KUTTA
