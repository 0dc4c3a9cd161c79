"""Differences of formulations and an engine over states, in units of the tolerance."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from twolink.verification.differences import Differences
from twolink.viz.plots.moments import Array
from twolink.viz.plots.style import Palette, figure, note, palette_of

Pair = tuple[str, str]

# Inches: a lane for each pair of sources, in a row for each quantity, and margins.
_LANE, _BETWEEN, _AROUND, _WIDTH = 0.125, 0.09, 1.35, 7.2
_MARKERS = "os^D"
_BINS_A_DECADE = 8
# Largest number of decades below and above the tolerance, and those reserved for text.
_LOWEST, _HIGHEST, _FREE = -12, 9, 1.5
# The axis ignores a smaller part of all differences at its lower end.
_RARE = 1e-3
# The part of a lane filled by its histogram; the size of its text (points).
_FILL, _TINY = 0.92, 6.5


def verification(found: Iterable[Differences], theme: str = "light") -> Figure:
    """Return histograms of the differences over states, for each quantity and pair of sources.

    Differences are in units of the tolerance at the state, on a logarithmic axis; a text states the
    fraction of zero differences. Quantities of C1, C2 and D share a row.
    """
    palette = palette_of(theme)
    rows = in_rows(found)
    pairs = list(dict.fromkeys(pair for row in rows.values() for pair in row))
    edges = bins(shares for row in rows.values() for shares in row.values())
    lanes = sum(len(row) for row in rows.values())
    height = _LANE * lanes + _BETWEEN * len(rows) + _AROUND
    made, (axes,) = figure(
        palette, "Differences over states, in units of the tolerance", size=(_WIDTH, height)
    )
    middles, y = [], 0.0
    for row in rows.values():
        first = y
        for pair, shares in row.items():
            _draw_lane(axes, palette, y, pairs.index(pair), shares, edges)
            y += 1
        middles.append((first + y) / 2)
        y += _BETWEEN / _LANE
    axes.set_ylim(y, -_BETWEEN / _LANE)
    axes.set_yticks(middles, list(rows))
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.set_xscale("log")
    axes.set_xlim(edges[0], edges[-1])
    axes.set_xlabel("difference / tolerance")
    axes.axvline(1.0, color=palette.ink, linewidth=1.3, label="_tolerance")
    axes.annotate(
        "tolerance",
        (1.0, 1.0),
        xycoords=axes.get_xaxis_transform(),
        xytext=(0, 3),
        textcoords="offset points",
        ha="center",
        color=palette.ink,
        fontsize=9,
    )
    _key(axes, palette, pairs)
    note(made, palette, _sentence(rows))
    return made


def in_rows(found: Iterable[Differences]) -> dict[str, dict[Pair, Array]]:
    """Return the differences by quantity and pair of sources, the largest of C1, C2 and D."""
    rows: dict[str, dict[Pair, Array]] = {}
    points: dict[str, list[str]] = {}
    for each in found:
        name, _, point = each.quantity.partition(" of ")
        row = rows.setdefault(name, {})
        pair = each.source, each.against.split()[0]
        row[pair] = np.maximum(row[pair], each.shares) if pair in row else each.shares
        if point and point not in points.setdefault(name, []):
            points[name].append(point)
    return {
        f"{name} of {', '.join(points[name])}" if name in points else name: row
        for name, row in rows.items()
    }


def bins(every: Iterable[Array]) -> Array:
    """Return logarithmically spaced edges of bins for all non-zero differences.

    They start well below the differences, which leaves space for the fraction of zeros, and end
    above 1.
    """
    known = np.concatenate([shares[(shares > 0) & np.isfinite(shares)] for shares in every])
    low, high = np.log10([np.quantile(known, _RARE), known.max()]) if known.size else (-2.0, 0.0)
    first = max(_LOWEST, int(np.floor(min(low, -1.0) - _FREE)))
    last = min(_HIGHEST, int(np.ceil(max(high, 0.5))))
    return np.logspace(first, last, (last - first) * _BINS_A_DECADE + 1)


def histogram(shares: Array, edges: Array) -> Array:
    """Return the number of states in each bin; values beyond the edges count in the outer bins."""
    differing = shares[shares > 0]
    inside = np.clip(differing, edges[0], np.nextafter(edges[-1], 0))
    return np.histogram(inside, edges)[0].astype(float)


def _draw_lane(
    axes: Axes, palette: Palette, y: float, number: int, shares: Array, edges: Array
) -> None:
    """Draw a histogram in a lane with top y, a mark at its maximum, and the fraction of zeros."""
    counts = histogram(shares, edges)
    colour = palette.lines[number]
    if counts.any():
        first, last = np.flatnonzero(counts)[[0, -1]]
        tops = y + 1 - _FILL * counts / counts.max()
        axes.stairs(
            tops[first : last + 1], edges[first : last + 2], baseline=y + 1, fill=True,
            color=colour, alpha=0.55, linewidth=0,
        )  # fmt: skip
        largest = min(float(shares.max()), float(edges[-1]))
        axes.plot(
            largest, y + 0.6, _MARKERS[number], color=colour, markersize=3.5, clip_on=False,
            markeredgecolor=palette.ink, markeredgewidth=0.5, label="_largest",
        )  # fmt: skip
    axes.annotate(
        f"{100 * np.mean(shares == 0):.0f} % equal",
        (0.0, y + 0.5),
        xycoords=axes.get_yaxis_transform(),
        xytext=(3, 0),
        textcoords="offset points",
        va="center_baseline",
        color=palette.ink,
        fontsize=_TINY,
    )


def _key(axes: Axes, palette: Palette, pairs: list[Pair]) -> None:
    """Draw the legend of colours and marks above the axes."""
    handles = [
        Line2D(
            [], [], color=palette.lines[number], marker=_MARKERS[number], linewidth=5, alpha=0.75,
            markersize=4, markeredgecolor=palette.ink, label=f"{source} − {against}",
        )
        for number, (source, against) in enumerate(pairs)
    ]  # fmt: skip
    axes.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(-0.28, 1.02),
        ncols=2,
        frameon=False,
        fontsize=8.5,
        labelcolor=palette.ink,
        borderpad=0,
        handlelength=1.6,
        columnspacing=1.2,
    )


def _sentence(rows: dict[str, dict[Pair, Array]]) -> str:
    """Return a sentence with the number of states and the largest difference."""
    largest, name = max(
        (float(shares.max()), name) for name, row in rows.items() for shares in row.values()
    )
    states = len(next(iter(next(iter(rows.values())).values())))
    return (
        f"{states} states; marks are the largest differences, "
        f"the largest of all is {largest:.2g} of its tolerance ({name})."
    )
