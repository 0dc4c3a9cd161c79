"""Energy error against time: linear drift, bounded errors, and random walks."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twolink.accuracy.drift import Drift, DriftStudy
from twolink.viz.plots.style import Palette, figure, label_lines, palette_of

# The palette's line number and the dashes of each kind of method, and the names of the kinds.
_FAMILIES = {"taylor": (0, "-"), "runge-kutta": (1, "-."), "symplectic": (2, (0, (5, 1.6)))}

# The guides at the lower right: this many decades long, each with its power of time.
_GUIDES = ((1.0, "∝ t"), (0.5, "∝ √t"), (0.0, "bounded"))
_GUIDE_DECADES = 1.3

# Space below the smallest error for the guides, in decades.
_ROOM = 2.6


def drift_plot(study: DriftStudy, theme: str = "light") -> Figure:
    """Return a plot of energy errors (relative to the greatest kinetic energy) against time (s).

    Each method has a line with its measured power of time; guides show the expected powers.
    """
    palette = palette_of(theme)
    title = f"{study.scene.title}, {study.seconds:g} s: energy drift"
    drawn, (axes,) = figure(palette, title, size=(8.4, 5.8))
    axes.set_xscale("log")
    axes.set_yscale("log")
    seen = [drift for drift in study.drifts if len(drift.times)]
    for drift in seen:
        number, dashes = _FAMILIES[drift.method.family]
        axes.plot(
            drift.times, drift.errors, color=palette.lines[number], linestyle=dashes,
            linewidth=1.5, label=_label(drift),
        )  # fmt: skip
    axes.set_xlim(min((drift.times[0] for drift in seen), default=1.0), study.seconds)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("energy error / greatest kinetic energy (1), RMS of starts")
    _guide(axes, study, palette)
    label_lines(axes)
    return drawn


def _label(drift: Drift) -> str:
    if drift.growth is None:
        return drift.method.name
    return f"{drift.method.name} ∝ $t^{{{drift.growth.rounded}}}$"


def _guide(axes: Axes, study: DriftStudy, palette: Palette) -> None:
    """Draw guides of the expected powers of time."""
    errors = (float(e) for drift in study.drifts for e in drift.errors if e > 0)
    least = min(errors, default=1.0)
    start = study.seconds * 10 ** (-_GUIDE_DECADES - 0.6)
    end, height = start * 10**_GUIDE_DECADES, least * 10 ** (-_ROOM + 0.5)
    axes.set_ylim(bottom=least * 10**-_ROOM)
    for power, name in _GUIDES:
        top = height * 10 ** (power * _GUIDE_DECADES)
        axes.plot(
            (start, end), (height, top), color=palette.ink, linewidth=0.8, label=f"_guide {power}"
        )
        axes.annotate(
            name, (end, top), xytext=(4, 0), textcoords="offset points", fontsize=8,
            va="center", color=palette.ink,
        )  # fmt: skip
