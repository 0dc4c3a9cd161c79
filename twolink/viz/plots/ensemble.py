"""Pictures of an ensemble: a map of first times over two axes, or their distribution.

A pixel of a map has the colour of its time, or it is one of three kinds without a time: it never
happens, it is undecided, or the run failed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogFormatterSciNotation

from twolink.ensembles.first_time import HAPPENS, NEVER, UNDECIDED
from twolink.ensembles.results import Results
from twolink.errors import PictureError
from twolink.viz.plots.style import Palette, figure, note, palette_of, plain

_VERDICT = "_verdict"


def ensemble_plot(found: Results, theme: str = "light") -> Figure:
    """Return a map of the first condition that is kept, or the distribution of its times.

    A map has the first fixed axis along x and the second along y. Raises `PictureError` for results
    without first times.
    """
    times = map_of(found)
    palette = palette_of(theme)
    if times is None:
        return _distribution(found, _condition(found), palette)
    return _map(found, times, palette)


class TimeMap(NamedTuple):
    """First times over two axes: a row for each value of y, a column for each of x.

    `x` and `y` are the names of the axes, `places` their rising values and `units` theirs, "" if
    not known; `times` (s) are NaN without a time, and `failed` says which runs failed. `grid` has
    all that is kept of these runs.
    """

    condition: str
    x: str
    y: str
    places: tuple[Any, Any]
    units: tuple[str, str]
    times: Any
    verdicts: Any
    failed: Any
    grid: Any


def map_of(found: Results) -> TimeMap | None:
    """Return the first times of the first condition, or None where they are not over two axes.

    Raises `PictureError` for results without first times.
    """
    name = _condition(found)
    grid = found.grid()
    dims = grid[f"{name}{_VERDICT}"].dims
    # Lists of values may have a value twice, and need not rise.
    grid = grid.drop_duplicates([dim for dim in dims if dim != "draw"])
    long = [dim for dim in dims if grid.sizes[dim] > 1]
    if len(long) != 2 or "draw" in long:
        return None
    x, y = long
    grid = grid.squeeze([dim for dim in dims if dim not in long]).sortby([x, y])
    times, verdicts, reasons = (
        grid[key].transpose(y, x).values for key in (f"{name}_time", f"{name}{_VERDICT}", "reason")
    )
    places = grid[x].values, grid[y].values
    units = _unit(grid[x].attrs), _unit(grid[y].attrs)
    return TimeMap(name, x, y, places, units, times, verdicts, reasons != "", grid)


def _condition(found: Results) -> str:
    """Return the name of the first condition that is kept."""
    first = found.attributes["sweep"]["keep"]["first"]
    if not first:
        raise PictureError(
            "the results of a sweep must have first times for a picture (first in [keep]); got none"
        )
    return str(first[0]["name"])


def _map(found: Results, of: TimeMap, palette: Palette) -> Figure:
    drawn, (axes,) = figure(palette, plain(found.attributes["title"]), size=(7.2, 6.2))
    places, times, verdicts, failed = of.places, of.times, of.verdicts, of.failed
    kinds = np.full(times.shape, np.nan)
    kinds[(verdicts == NEVER) & ~failed] = 0
    kinds[(verdicts == UNDECIDED) & ~failed] = 1
    kinds[failed] = 2
    colours = [palette.bands[0], palette.faint, palette.lines[1]]
    axes.pcolormesh(
        *places, kinds, cmap=ListedColormap(colours), vmin=-0.5, vmax=2.5, rasterized=True
    )
    happens = np.where((verdicts == HAPPENS) & ~failed, times, np.nan)
    if np.isfinite(happens).any():
        least, most = np.nanmin(happens), np.nanmax(happens)
        scale = LogNorm(least, most) if 0 < least < most else None
        mesh = axes.pcolormesh(*places, happens, cmap="viridis_r", norm=scale, rasterized=True)
        bar = drawn.colorbar(mesh, ax=axes)
        bar.set_label(f"first time of {of.condition} (s)", color=palette.ink)
        if scale is not None:
            bar.ax.yaxis.set_major_formatter(_PlainNumbers())
            bar.ax.yaxis.set_minor_formatter(_PlainNumbers())
        bar.ax.tick_params(which="both", colors=palette.ink)
    axes.set_xlabel(_with_unit(of.x, of.units[0]))
    axes.set_ylabel(_with_unit(of.y, of.units[1]))
    _legend(axes, kinds, colours, palette)
    note(drawn, palette, _sentence(found, of.condition))
    return drawn


class _PlainNumbers(LogFormatterSciNotation):
    """The labels of a logarithmic axis, as 0.2 and 4 instead of 2 × 10⁻¹ and 4 × 10⁰."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of a value, or nothing where there is no room for it."""
        return f"{x:g}" if super().__call__(x, pos) else ""


# Units of the CF conventions, in which results are stored, as they are shown.
_SHOWN = {"rad s-1": "rad/s", "m s-2": "m/s²", "kg m2": "kg m²"}


def _unit(about: Mapping[str, Any]) -> str:
    """Return the unit of an array by its attributes, "" if it has none."""
    unit = str(about.get("units", ""))
    return _SHOWN.get(unit, unit)


def _with_unit(name: str, unit: str) -> str:
    return f"{plain(name)} ({unit})" if unit else plain(name)


def _legend(axes: Axes, kinds: Any, colours: list[str], palette: Palette) -> None:
    """Name the kinds of pixels without a time that are there."""
    words = ("never", "undecided", "failed")
    shown = [
        Patch(facecolor=colours[kind], edgecolor=palette.ink, linewidth=0.5, label=words[kind])
        for kind in range(3)
        if (kinds == kind).any()
    ]
    if shown:
        axes.legend(
            handles=shown, loc="upper left", bbox_to_anchor=(0.0, -0.1), ncols=3, frameon=False,
            labelcolor=palette.ink,
        )  # fmt: skip


def _distribution(found: Results, name: str, palette: Palette) -> Figure:
    """Return the share of runs in which a condition has happened, against time."""
    drawn, (axes,) = figure(palette, plain(found.attributes["title"]))
    done = found.runs_done & (found.array("reason") == "")
    verdicts, times = found.array(f"{name}{_VERDICT}")[done], found.array(f"{name}_time")[done]
    duration = float(found.attributes["sweep"]["scene"]["run"]["duration"])
    happened = np.sort(times[verdicts == HAPPENS])
    count = max(len(verdicts), 1)
    steps = np.concatenate([[0.0], happened, [duration]])
    shares = np.concatenate([np.arange(len(happened) + 1), [len(happened)]]) / count
    axes.step(steps, shares, where="post", color=palette.lines[0])
    undecided = int((verdicts == UNDECIDED).sum())
    if undecided:
        # They may have happened at any time, or never.
        axes.fill_between(
            steps, shares, shares + undecided / count, step="post", color=palette.bands[0],
            linewidth=0,
        )  # fmt: skip
    axes.set_xlabel("time (s)")
    axes.set_ylabel(f"share of runs with {name}")
    axes.set_ylim(0, 1)
    note(drawn, palette, _sentence(found, name))
    return drawn


def _sentence(found: Results, name: str) -> str:
    """Return the counts of runs and times, and the largest bound, in a sentence."""
    bounds = found.array(f"{name}_bound")
    known = bounds[np.isfinite(bounds)]
    largest = f"; their bounds are {known.max():.1e} s or less" if len(known) else ""
    done, count = int(found.runs_done.sum()), len(bounds)
    missed = found.missed if found.keeps_states else 0
    less = f" {missed} motions miss the accuracy {found.accuracy:g}." if missed else ""
    return f"{done} of {count} runs, {len(known)} times{largest}.{less}"
