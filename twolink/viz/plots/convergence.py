"""Errors of an engine's motions against its steps and tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twolink.conformance.curves import MethodCurve, by_parameter
from twolink.viz.plots.style import Palette, figure, label_lines, palette_of, stroke

_MARKERS = "os^Dv"
_TITLES = {
    "step": ("fixed steps", "step (s), finer to the right"),
    "tolerance": ("variable steps", "tolerance (1), finer to the right"),
}

# Inches: the width, the least height of axes, a label, and the surroundings of axes; points.
_WIDTH, _LEAST, _LABEL, _AROUND = 8.4, 2.2, 0.18, 0.75
_TITLE = 10.0

# An error beyond it says no more than that the motion is lost.
_LARGEST_ERROR = 1e2


def convergence_plot(
    scenes: Mapping[str, Sequence[MethodCurve]], title: str = "", theme: str = "light"
) -> Figure:
    """Return errors (rad, rad/s) against settings, with axes for each scene and kind of setting.

    An engine has a colour and a mark, and each of its methods other dashes.
    """
    palette = palette_of(theme)
    panels = [
        (scene, parameter, curves)
        for scene, every in scenes.items()
        for parameter, curves in by_parameter(every).items()
    ]
    heights = [max(_LEAST, _LABEL * len(curves)) for _, _, curves in panels]
    size = _WIDTH, sum(heights) + _AROUND * len(panels)
    drawn, every = figure(palette, title, rows=len(panels), size=size, height_ratios=heights)
    for axes, (scene, parameter, curves) in zip(every, panels, strict=True):
        kind, label = _TITLES[parameter]
        words = f"{scene}, {kind}" if len(scenes) > 1 else kind
        axes.set_title(words, loc="left", color=palette.ink, fontsize=_TITLE)
        axes.set_xlabel(label)
        axes.set_ylabel("largest error (rad, rad/s)")
        _draw(axes, palette, curves)
    label_lines(*every)
    return drawn


def _draw(axes: Axes, palette: Palette, curves: Sequence[MethodCurve]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.invert_xaxis()
    for each in curves:
        points = [(x, y) for x, y in each.curve.points if 0 < y < _LARGEST_ERROR]
        if points:
            style = stroke(palette, each.number) | {"linewidth": 1.2}
            style["linestyle"] = stroke(palette, each.method_number)["linestyle"]
            axes.plot(
                *zip(*points, strict=True), **style, label=each.name, markersize=3.5,
                marker=_MARKERS[each.number % len(_MARKERS)],
            )  # fmt: skip
