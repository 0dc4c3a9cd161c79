"""The visible part of the plane, and the pixel of each point.

The player in the browser uses the same rule (`fit` in player/player.js): the box of the motion is
shown as large as possible between the strips of text above and below.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twolink.viz.shapes import Array

# Pixels of a window of 960 × 600, and the range in which text scales with the window.
_DESIGNED = (960, 600)
_SMALLEST, _LARGEST = 0.8, 2.5
_TOP, _ROW, _BOTTOM, _SIDE = 46, 20, 62, 18

_ROOM = 0.07
_GRID_LINES = 9


@dataclass(frozen=True)
class Box:
    """A part of the plane (m), y downward."""

    left: float
    right: float
    top: float
    bottom: float

    @property
    def size(self) -> float:
        """The longer side (m)."""
        return max(self.right - self.left, self.bottom - self.top)


def box_of(points: Array, reach: float) -> Box:
    """Return the box of all points (m), shape (n, 2), with a margin.

    It is at least half of the chain's reach (m), so that small motions look small.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    room = _ROOM * reach
    least = reach / 2
    grown = np.maximum(high - low + 2 * room, least)
    middle = (low + high) / 2
    left, top = middle - grown / 2
    right, bottom = middle + grown / 2
    return Box(float(left), float(right), float(top), float(bottom))


def grid_spacing(box: Box) -> float:
    """Return the spacing of grid lines (m): 1, 2 or 5 times a power of ten."""
    wanted = box.size / _GRID_LINES
    power = 10.0 ** math.floor(math.log10(wanted))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= 0.999 * wanted)


@dataclass(frozen=True)
class Framing:
    """The mapping of a box to a window of a width and height in pixels, below `rows` of names."""

    box: Box
    width: int
    height: int
    rows: int = 0

    @property
    def unit(self) -> float:
        """Pixels per pixel of the design."""
        fitting = min(self.width / _DESIGNED[0], self.height / _DESIGNED[1])
        return min(max(fitting, _SMALLEST), _LARGEST)

    @property
    def scale(self) -> float:
        """Pixels per metre."""
        top, bottom, side = self._strips()
        across = (self.width - 2 * side) / (self.box.right - self.box.left)
        down = (self.height - top - bottom) / (self.box.bottom - self.box.top)
        return max(min(across, down), 1e-9)

    def pixel(self, points: Array) -> Array:
        """Return the window coordinates (pixels) of points (x, y) (m), shape (…, 2)."""
        top, bottom, _ = self._strips()
        middle = np.array(
            [(self.box.left + self.box.right) / 2, (self.box.top + self.box.bottom) / 2]
        )
        centre = np.array([self.width / 2, (top + self.height - bottom) / 2])
        return centre + self.scale * (np.asarray(points) - middle)

    def _strips(self) -> tuple[float, float, float]:
        """Return the heights of the strips above and below, and the side margins (pixels)."""
        return (
            self.unit * (_TOP + _ROW * self.rows),
            self.unit * _BOTTOM,
            self.unit * _SIDE,
        )

    @classmethod
    def rule(cls) -> dict[str, float]:
        """Return the constants of the rule, for the player."""
        return {
            "width": _DESIGNED[0],
            "height": _DESIGNED[1],
            "smallest": _SMALLEST,
            "largest": _LARGEST,
            "top": _TOP,
            "row": _ROW,
            "bottom": _BOTTOM,
            "side": _SIDE,
        }
