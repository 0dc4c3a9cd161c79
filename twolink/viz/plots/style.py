"""The common style of plots: sizes, colours, dashes, line labels, reproducible files.

The colours are Okabe and Ito's, distinguishable for colour-blind readers (jfly.uni-koeln.de/color).
Lines also differ in dashes, so that they are distinguishable in grey.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import IO, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation
from matplotlib.transforms import offset_copy

from twolink.errors import ParameterError
from twolink.files import atomic_write
from twolink.suffixes import PLOTS
from twolink.text import one_line
from twolink.viz.themes import DARK, LIGHT, recoloured, theme_named

"""File suffixes of plots."""

# Files without a date are reproducible.
_UNDATED: dict[str, dict[str, Any]] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}

# Points; a figure is 7.2 inches wide, the width of a page's column.
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

# Distance from a line's end to its label, and the gap before the text, in points.
_ACROSS, _FREE = 16.0, 3.0
# A line that ends beyond this part of the axes' width counts as ending at their edge.
_EDGE = 0.97
# A tag of an SVG, and a colour in it.
_TAG, _COLOUR = re.compile(r"<[^>]*>"), re.compile("#[0-9a-f]{6}(?![0-9a-f])")
# Height of a label relative to its letters.
_LEADING = 1.12


@dataclass(frozen=True)
class Palette:
    """The colours of a plot: paper, ink, background elements, and lines in order."""

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
        lines=(*LIGHT.links, "#009E73", "#CC79A7", "#1c1c1c", "#D55E00", "#56B4E9"),
    ),
    "dark": Palette(
        paper="#14171c",
        ink="#ececec",
        faint="#464c55",
        bands=("#1f3b52", "#4f3420", "#1d4437", "#46303f", "#33373d"),
        lines=(*DARK.links, "#009E73", "#CC79A7", "#ececec", "#D55E00", "#F0E442"),
    ),
}
"""The palettes by the name of their theme."""


def palette_of(theme: str) -> Palette:
    """Return a theme's palette. Raises `PictureError` for an unknown theme."""
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

    `size` is the width and height (inch), by default by the number of rows; `subplots` are passed
    to matplotlib, such as `sharex=True`.
    """
    height = _HEIGHT_OF_ROW * rows + _HEIGHT_OF_TITLE
    made = Figure(
        figsize=size or (_WIDTH, height), layout="constrained", facecolor=palette.paper, dpi=100
    )
    grid = made.subplots(rows, columns, squeeze=False, **subplots)
    if title:
        made.suptitle(plain(title), x=0.012, ha="left", color=palette.ink, fontsize=_TITLE)
    found = list(grid.flat)
    for axes in found:
        _dress(axes, palette)
    made.align_ylabels(found)
    return made, found


def _dress(axes: Axes, palette: Palette) -> None:
    """Apply a palette's colours to axes, including elements that matplotlib creates later."""
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
    """Return the style of a line by number (from 0), as keywords of `Axes.plot`."""
    return {
        "color": palette.lines[number % len(palette.lines)],
        "linestyle": _DASHES[number % len(_DASHES)],
        "linewidth": _LINE_WIDTH,
        "solid_capstyle": "round",
    }


def label_lines(*every: Axes) -> list[Annotation]:
    """Write each line's label beside its last point, at the right of its axes, without overlap.

    Call it once for all axes of a figure, after drawing and setting the limits. Lines without a
    label are ignored. A leader in the line's style connects its end and the text, which has the
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
    """Write the labels of the lines of axes."""
    lines = [line for line in axes.lines if not str(line.get_label()).startswith("_")]
    ends = [_end(axes, line) for line in lines]
    height = _LEADING * _SMALL * 1.2 / (axes.bbox.height * 72 / dpi)
    places = spread([y for _, y in ends], height)
    return [
        _label(axes, line, end, place) for line, end, place in zip(lines, ends, places, strict=True)
    ]


def _end(axes: Axes, line: Line2D) -> tuple[float, float]:
    """Return a line's last point in axes coordinates, clipped to the axes."""
    known = np.asarray(line.get_xydata(), dtype=float)
    known = known[np.isfinite(known).all(axis=1)]
    if not len(known):
        return 1.0, 0.5
    transform = line.get_transform() - axes.transAxes
    x, y = transform.transform(known[-1])
    return float(np.clip(x, 0, 1)), float(np.clip(y, 0, 1))


def _label(axes: Axes, line: Line2D, end: tuple[float, float], place: float) -> Annotation:
    """Write a line's label at a height (axes coordinates), with a leader to the line's end."""
    whole = axes.get_figure(root=True)
    # Inside the axes a leader must not look like a part of the line.
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
    """Return positions close to the wanted ones, without overlap of labels of a given height.

    All are within 0 to 1 if there is enough space. Overlapping labels are grouped around the mean
    of their wanted positions.
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
    """Return the lower edge of a stack of labels, moved inside 0 to 1."""
    long = len(group) * height
    middle = sum(wanted[index] for index in group) / len(group)
    return max(0.0, min(middle - long / 2, 1.0 - long)) if long < 1 else (1.0 - long) / 2


def _top(group: list[int], wanted: list[float], height: float) -> float:
    return _bottom(group, wanted, height) + len(group) * height


def overlaps(words: list[Annotation]) -> bool:
    """Return whether any two drawn labels overlap."""
    boxes = sorted((text.get_window_extent() for text in words), key=lambda box: box.y0)
    return any(low.overlaps(high) for low, high in pairwise(boxes))


def save(made: Figure, path: Path) -> None:
    """Write a figure atomically to an .svg, .png or .pdf file, with reproducible bytes.

    Raises `ParameterError` for other suffixes, `FileError` if the file cannot be written.
    """
    if path.suffix not in PLOTS:
        raise ParameterError(
            f"{path}: the suffix must be {' or '.join(PLOTS)}; got '{path.suffix}'"
        )
    with atomic_write(path) as file:
        write_to(made, file, path.suffix)


def write_to(made: Figure, target: Path | IO[bytes], suffix: str) -> None:
    """Write a figure in the format of a suffix, with reproducible bytes."""
    # Text remains text, which can be searched and selected.
    same = mpl.rc_context({"svg.hashsalt": "twolink", "svg.fonttype": "none", "pdf.fonttype": 42})
    metadata = _UNDATED.get(suffix)
    with same, warnings.catch_warnings():
        # A letter that the font lacks is drawn as a box; matplotlib's warning adds nothing.
        warnings.filterwarnings("ignore", r"Glyph \d+", UserWarning)
        made.savefig(target, format=suffix[1:], metadata=metadata, dpi=_DPI)


def svg_into(svg: str, theme: str, other: str) -> str:
    """Return a figure (SVG) of a theme with the colours of another one.

    The result is the figure as drawn in the other theme, except for its internal ids.
    """
    colours = _recoloured(theme, other)
    # Only inside tags: a title may contain the name of a colour.
    return _TAG.sub(lambda tag: _COLOUR.sub(lambda c: colours.get(c[0], c[0]), tag[0]), svg)


def _recoloured(theme: str, other: str) -> dict[str, str]:
    """Return the mapping of all colours of a theme's figures to those of another theme."""
    one, two = palette_of(theme), palette_of(other)
    pairs = {
        **recoloured(theme_named(theme), theme_named(other)),
        **dict(zip((one.paper, one.ink, one.faint), (two.paper, two.ink, two.faint), strict=True)),
        **dict(zip(one.bands + one.lines, two.bands + two.lines, strict=True)),
    }
    return {old.lower(): new.lower() for old, new in pairs.items()}


def plain(text: str) -> str:
    """Return text that matplotlib draws letter by letter: no formula begins at a $."""
    return one_line(text, 200).replace("$", r"\$")
