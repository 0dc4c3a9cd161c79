"""Contact: convergence of compliant surfaces to the rigid one, and restitution with yielding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twolink.viz.plots.style import Palette, figure, label_lines, palette_of, stroke


@dataclass(frozen=True)
class Limit:
    """Difference of the rebound of a compliant law to the rigid law's (m/s), by stiffness.

    `stiffness` is in `unit`; `rate` is the measured exponent of the differences, and `expected` the
    theoretical one.
    """

    law: str
    unit: str
    stiffness: tuple[float, ...]
    misses: tuple[float, ...]
    rate: float
    expected: Fraction


@dataclass(frozen=True)
class Restitution:
    """The coefficient of restitution over the approach speed (m/s), for a material.

    `measured` is from simulated impacts, `computed` from the areas below the law's curves.
    `yields` is the approach speed at the onset of yielding.
    """

    material: str
    speeds: tuple[float, ...]
    measured: tuple[float, ...]
    computed: tuple[float, ...]
    yields: float


def contact_plot(limits: Sequence[Limit], restitution: Restitution, theme: str = "light") -> Figure:
    """Return two stacked plots: differences over stiffness, and restitution over speed."""
    palette = palette_of(theme)
    drawn, (above, below) = figure(
        palette, "Compliant contact: the rigid limit, and losses by yielding", rows=2,
        size=(7.2, 6.4),
    )  # fmt: skip
    _draw_limits(above, limits, palette)
    _draw_restitution(below, restitution, palette)
    for axes in (above, below):
        label_lines(axes)
    return drawn


def _draw_limits(axes: Axes, limits: Sequence[Limit], palette: Palette) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for number, limit in enumerate(limits):
        stiffest, last = limit.stiffness[-1], limit.misses[-1]
        theory = [last * (stiffest / k) ** float(limit.expected) for k in limit.stiffness]
        axes.plot(limit.stiffness, theory, color=palette.ink, linewidth=0.8, label="_theory")
        axes.plot(
            limit.stiffness, limit.misses, **stroke(palette, number), marker="os"[number % 2],
            markersize=4.5, label=f"{limit.law}, {limit.unit}:\nslope −{limit.rate:.3f},\n"
            f"in theory −{limit.expected} (thin)",
        )  # fmt: skip
    axes.set_xlabel("stiffness of the surface (unit of its law)")
    axes.set_ylabel("difference to the\nrigid rebound (m/s)")


def _draw_restitution(axes: Axes, restitution: Restitution, palette: Palette) -> None:
    axes.set_xscale("log")
    style = stroke(palette, 0)
    axes.plot(
        restitution.speeds, restitution.computed, **style,
        label=f"{restitution.material}:\nsimulated (points), and by\nthe areas of the law (line)",
    )  # fmt: skip
    axes.plot(
        restitution.speeds, restitution.measured, "o", color=style["color"], markersize=4.5,
        label="_simulated",
    )  # fmt: skip
    axes.axvline(
        restitution.yields, color=palette.ink, linewidth=0.8, linestyle=(0, (1, 2)), label="_yields"
    )
    axes.text(
        restitution.yields, 0.04, " yields from here",
        transform=axes.get_xaxis_transform(), color=palette.ink, fontsize=9, va="bottom",
    )  # fmt: skip
    axes.set_ylim(0, 1.05)
    axes.set_xlabel("approach speed (m/s)")
    axes.set_ylabel("coefficient of restitution")
