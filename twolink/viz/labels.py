"""Labels of a picture, and the marks that they keep clear of."""

from __future__ import annotations

from typing import Any, NamedTuple

from twolink.viz.shapes import Place

Label = list[Any]
"""A word of the picture: text, x, y (m), the way it steps aside (x, y), and its kind.

One that stands behind another has the number of its line, from 1 on, at the end."""

Mark = list[float]
"""A line with round ends that no label may cover: x, y of both ends, and the radius (m)."""


class Drawn(NamedTuple):
    """A part of a frame: commands of meshcat's viewer, labels, and marks."""

    commands: list[bytes]
    labels: list[Label]
    marks: list[Mark]


def round_mark(centre: Place, radius: float) -> Mark:
    """Return the mark of a disc or ring (m)."""
    return line_mark(centre, centre, 2 * radius)


def line_mark(start: Place, end: Place, width: float) -> Mark:
    """Return the mark of a line of a width (m)."""
    x, y = (float(part) for part in start)
    x_end, y_end = (float(part) for part in end)
    return [x, y, x_end, y_end, width / 2]
