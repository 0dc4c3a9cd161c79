"""One style for all plots: sizes, colours, dashes, labels at the lines, files that are the same.

The colours are Okabe and Ito's, which colour-blind people tell apart (jfly.uni-koeln.de/color).
Lines differ in their dashes, too, so that a print in grey says as much.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation
from matplotlib.transforms import offset_copy

from twolink.errors import ParameterError
from twolink.files import written_whole
from viz.themes import theme_named

KINDS_OF_FILE = (".svg", ".png")
"""What a plot can be written to, by the end of its name."""

# Points; a figure is 7.2 inches wide, as a page's column is.
_WIDTH, _HEIGHT_OF_ROW, _HEIGHT_OF_TITLE = 7.2, 2.35, 0.75
_TEXT, _SMALL, _TITLE = 10.0, 9.0, 12.0
_DPI = 160

_LINE_WIDTH = 1.7
_DASHES: tuple[Any, ...] = (
    "solid",
    (0, (5, 1.6)),
    (0, (1, 1.1)),
    (0, (6, 1.4, 1.2, 1.4)),
    (0, (9, 2.5)),
    (0, (3.5, 1.2, 1, 1.2, 1, 1.2)),
    (0, (2.4, 2.4)),
)

# From a line's end to its label, in points: the way across, and what is left free before the text.
_ACROSS, _FREE = 16.0, 3.0
# A line that ends right of this part of the axes' width ends at their edge.
_EDGE = 0.97
# A label takes this many times the height of its letters.
_LEADING = 1.12


@dataclass(frozen=True)
class Palette:
    """The colours of a plot: paper, ink, what stays in the background, and the lines in order."""

    paper: str
    ink: str
    faint: str
    bands: tuple[str, ...]
    lines: tuple[str, ...]


PALETTES = {
    "light": Palette(
        paper="#ffffff",
        ink="#1c1c1c",
        faint="#c9c9c9",
        bands=("#d9e7f3", "#f6dcc8", "#d5ece3", "#eedfe9", "#ececec"),
        lines=("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#1c1c1c", "#E69F00", "#56B4E9"),
    ),
    "dark": Palette(
        paper="#14171c",
        ink="#ececec",
        faint="#464c55",
        bands=("#1f3b52", "#4f3420", "#1d4437", "#46303f", "#33373d"),
        lines=("#56B4E9", "#E69F00", "#009E73", "#CC79A7", "#ececec", "#F0E442", "#D55E00"),
    ),
}
"""The palettes by the names of their themes."""


def palette_of(theme: str) -> Palette:
    """Return a theme's palette. Raises `PictureError` for a theme that is none."""
    return PALETTES[theme_named(theme).name]


def figure(
    palette: Palette,
    title: str = "",
    *,
    rows: int = 1,
    columns: int = 1,
    size: tuple[float, float] | None = None,
    **subplots: Any,
) -> tuple[Figure, list[Axes]]:
    """Return an empty figure in a palette's colours, and its axes row by row.

    `size` is the width and height (inch), by default as the rows need; `subplots` go to
    matplotlib, such as `sharex=True`.
    """
    height = _HEIGHT_OF_ROW * rows + _HEIGHT_OF_TITLE
    made = Figure(
        figsize=size or (_WIDTH, height), layout="constrained", facecolor=palette.paper, dpi=100
    )
    grid = made.subplots(rows, columns, squeeze=False, **subplots)
    if title:
        made.suptitle(title, x=0.012, ha="left", color=palette.ink, fontsize=_TITLE)
    found = list(grid.flat)
    for axes in found:
        _dress(axes, palette)
    made.align_ylabels(found)
    return made, found


def _dress(axes: Axes, palette: Palette) -> None:
    """Give axes a palette's colours: all that matplotlib makes late is told now, too."""
    axes.set_facecolor(palette.paper)
    axes.set_axisbelow(True)
    axes.grid(color=palette.faint, linewidth=0.6, alpha=0.6)
    axes.tick_params(
        which="both", color=palette.faint, labelcolor=palette.ink, labelsize=_SMALL, length=3
    )
    for side, spine in axes.spines.items():
        spine.set_color(palette.faint)
        spine.set_visible(side in ("left", "bottom"))
    for axis in (axes.xaxis, axes.yaxis):
        axis.label.set(color=palette.ink, fontsize=_TEXT)
    axes.title.set(color=palette.ink, fontsize=_TEXT)


def note(made: Figure, palette: Palette, sentence: str) -> None:
    """Write a sentence below a figure."""
    made.supxlabel(sentence, x=0.012, ha="left", color=palette.ink, fontsize=_SMALL)


def stroke(palette: Palette, number: int) -> dict[str, Any]:
    """Return how the line of this number (from 0) is drawn, as keywords of `Axes.plot`."""
    return {
        "color": palette.lines[number % len(palette.lines)],
        "linestyle": _DASHES[number % len(_DASHES)],
        "linewidth": _LINE_WIDTH,
        "solid_capstyle": "round",
    }


def label_lines(*every: Axes) -> list[Annotation]:
    """Write each line's label beside its last point, at the right of its axes, none on another.

    To be called for all axes of a figure once all is drawn and the limits are set. Lines without a
    label are left out. A stroke like the line's leads from its end to the words, which are in the
    palette's ink.
    """
    whole = every[0].get_figure(root=True)
    assert isinstance(whole, Figure)
    # The height of the axes is known after the layout.
    layout = whole.get_layout_engine()
    if layout is not None:
        layout.execute(whole)
    return [words for axes in every for words in _labels_of(axes, whole.dpi)]


def _labels_of(axes: Axes, dpi: float) -> list[Annotation]:
    """Write the labels of the lines of some axes."""
    lines = [line for line in axes.lines if not str(line.get_label()).startswith("_")]
    ends = [_end(axes, line) for line in lines]
    height = _LEADING * _SMALL * 1.2 / (axes.bbox.height * 72 / dpi)
    places = spread([y for _, y in ends], height)
    return [
        _label(axes, line, end, place) for line, end, place in zip(lines, ends, places, strict=True)
    ]


def _end(axes: Axes, line: Line2D) -> tuple[float, float]:
    """Return where a line's last point is, in parts of the axes, and inside of them."""
    known = np.asarray(line.get_xydata(), dtype=float)
    known = known[np.isfinite(known).all(axis=1)]
    if not len(known):
        return 1.0, 0.5
    transform = line.get_transform() - axes.transAxes
    x, y = transform.transform(known[-1])
    return float(np.clip(x, 0, 1)), float(np.clip(y, 0, 1))


def _label(axes: Axes, line: Line2D, end: tuple[float, float], place: float) -> Annotation:
    """Write a line's label at a place (in parts of the axes' height), and lead its end there."""
    whole = axes.get_figure(root=True)
    # Within the axes a leader must not look like more of the line.
    inside = end[0] < _EDGE
    words = axes.annotate(
        str(line.get_label()),
        xy=(1.0, place),
        xycoords="axes fraction",
        xytext=(_ACROSS + _FREE, 0),
        textcoords="offset points",
        va="center",
        ha="left",
        color=axes.xaxis.label.get_color(),
        fontsize=_SMALL,
        annotation_clip=False,
    )
    axes.annotate(
        "",
        xy=end,
        xycoords="axes fraction",
        xytext=(1.0, place),
        textcoords=offset_copy(axes.transAxes, whole, x=_ACROSS, units="points"),
        arrowprops={
            "arrowstyle": "-",
            "color": line.get_color(),
            "linestyle": "solid" if inside else line.get_linestyle(),
            "linewidth": 0.5 if inside else 0.6 * line.get_linewidth(),
            "shrinkA": 0,
            "shrinkB": 0,
        },
        annotation_clip=False,
    )
    return words


def spread(wanted: list[float], height: float) -> list[float]:
    """Return places as near to the wanted ones as labels of a height allow, none on another.

    All are within 0 to 1 as long as there is room for so many. Labels that would meet are taken
    together, about the mean of where they would be.
    """
    order = sorted(range(len(wanted)), key=wanted.__getitem__)
    groups: list[list[int]] = []
    for index in order:
        groups.append([index])
        while len(groups) > 1 and _top(groups[-2], wanted, height) > _bottom(
            groups[-1], wanted, height
        ):
            last = groups.pop()
            groups[-1] += last
    places = [0.0] * len(wanted)
    for group in groups:
        first = _bottom(group, wanted, height) + height / 2
        for number, index in enumerate(group):
            places[index] = first + number * height
    return places


def _bottom(group: list[int], wanted: list[float], height: float) -> float:
    """Return the lower edge of labels that stand on each other, moved inside of 0 to 1."""
    long = len(group) * height
    middle = sum(wanted[index] for index in group) / len(group)
    return max(0.0, min(middle - long / 2, 1.0 - long)) if long < 1 else (1.0 - long) / 2


def _top(group: list[int], wanted: list[float], height: float) -> float:
    return _bottom(group, wanted, height) + len(group) * height


def overlaps(words: list[Annotation]) -> bool:
    """Return whether any two labels lie on each other, as they are drawn."""
    boxes = sorted((text.get_window_extent() for text in words), key=lambda box: box.y0)
    return any(low.overlaps(high) for low, high in pairwise(boxes))


def save(made: Figure, path: Path) -> None:
    """Write a figure whole to an .svg or .png file: the same picture, the same bytes.

    Raises `ParameterError` for other kinds of file, `OSError` where it cannot be written.
    """
    if path.suffix not in KINDS_OF_FILE:
        raise ParameterError(f"{path} is the file; allowed is one of {' or '.join(KINDS_OF_FILE)}")
    # Letters are drawn as outlines, so that they look alike wherever the file is opened.
    same = mpl.rc_context({"svg.hashsalt": "twolink", "svg.fonttype": "path"})
    metadata = {"Date": None} if path.suffix == ".svg" else None
    with same, written_whole(path) as file:
        made.savefig(file, format=path.suffix[1:], metadata=metadata, dpi=_DPI)
