"""A drawing of the chain with its symbols: `python -m twolink.viz.schematic FILE.svg`."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from twolink import kinematics
from twolink.arithmetic import Pair
from twolink.chain import Chain, Point
from twolink.viz.themes import LIGHT

# The colours of films.
_LINK = dict(enumerate(LIGHT.links, start=1))
_INK, _FAINT = "#222222", "#9a9a9a"

_POSE = (math.radians(28), math.radians(64))


def schematic(chain: Chain | None = None, pose: Pair = _POSE) -> Figure:
    """Return a drawing of a chain (m) in a pose q1, q2 (rad), with the symbols of the equations."""
    chain = chain or Chain.uniform_bars()
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.set_axis_off()
    # y points down, in the chain's frame and in the picture.
    axes.invert_yaxis()

    def place(point: Point) -> Pair:
        return kinematics.position(chain, pose, point)

    A, B, D = (0.0, 0.0), place(chain.B), place(chain.D)
    # Lengths of marks are those of a chain with a reach of 2 m.
    size = float(sum(chain.length)) / 2
    _frame(axes, size)
    _support(axes, size)
    for link, (start, end) in {1: (A, B), 2: (B, D)}.items():
        axes.plot(*_xy(start, end), color=_LINK[link], linewidth=15, solid_capstyle="round")
    for x, y in (A, B):
        axes.plot(x, y, "o", markersize=8, color="white", markeredgecolor=_INK, zorder=5)
    axes.plot(*D, "o", markersize=7, color=_INK)
    _angle(axes, A, pose[0], 0.8, size, "$q_1$")
    _angle(axes, B, pose[1], 0.34, size, "$q_2$")
    for name, point in (("$C_1$", chain.C1), ("$C_2$", chain.C2)):
        _weight(axes, place(point), size, name)
    for name, (x, y), (dx, dy) in (
        ("$A$", A, (-0.13, 0.04)),
        ("$B$", B, (0.09, -0.09)),
        ("$D$", D, (0.1, 0.02)),
    ):
        where = x + size * dx, y + size * dy
        axes.text(*where, name, color=_INK, fontsize=14, ha="center", va="center")
    xs, ys = zip(A, B, D, strict=True)
    axes.set_xlim(min(xs) - 0.3 * size, max(*xs, 1.75 * size) + 0.3 * size)
    axes.set_ylim(max(*ys, 1.1 * size) + 0.4 * size, min(ys) - 0.25 * size)
    return figure


def _xy(start: Pair, end: Pair) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    return (start[0], end[0]), (start[1], end[1])


def _arrow(axes: Any, start: Pair, end: Pair, colour: str) -> None:
    style = {"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0, "linewidth": 1.3}
    axes.annotate("", xy=end, xytext=start, arrowprops=style)


def _frame(axes: Any, size: float) -> None:
    """Draw x to the right and y downward; marks have this size (m)."""
    for name, end, offset in (("$x$", (1.9, 0.0), (0.07, 0.0)), ("$y$", (0.0, 1.3), (0.0, 0.08))):
        _arrow(axes, (0.0, 0.0), (size * end[0], size * end[1]), _FAINT)
        axes.text(
            size * (end[0] + offset[0]), size * (end[1] + offset[1]), name, color=_INK,
            fontsize=14, ha="center", va="center",
        )  # fmt: skip


def _support(axes: Any, size: float) -> None:
    """Draw the hatched ground at A."""
    y = -0.07 * size
    axes.plot((-0.14 * size, 0.14 * size), (y, y), color=_INK, linewidth=1.3)
    for x in (-0.12, -0.06, 0.0, 0.06, 0.12):
        ends = (x * size, (x + 0.05) * size)
        axes.plot(ends, (y, y - 0.06 * size), color=_INK, linewidth=0.9)


def _angle(axes: Any, centre: Pair, angle: float, radius: float, size: float, name: str) -> None:
    """Draw an angle from the x-direction, with an arrowhead and a label."""
    x, y = centre
    r = radius * size
    steps = [angle * k / 40 for k in range(41)]
    arc = [(x + r * math.cos(s), y + r * math.sin(s)) for s in steps]
    if centre != (0.0, 0.0):
        axes.plot((x, x + 1.5 * r), (y, y), color=_FAINT, linewidth=1, linestyle=(0, (5, 4)))
    axes.plot(*zip(*arc[:-2], strict=True), color=_INK, linewidth=1.3, zorder=4)
    if abs(angle) < 0.05:
        # The arrow of so small an angle has no direction, and its name no room.
        return
    _arrow(axes, arc[-3], arc[-1], _INK)
    middle, far = angle / 2, r + 0.1 * size
    axes.text(
        x + far * math.cos(middle), y + far * math.sin(middle), name, color=_INK, fontsize=14,
        ha="center", va="center",
    )  # fmt: skip


def _weight(axes: Any, centre: Pair, size: float, name: str) -> None:
    """Draw a mass centre with its weight."""
    x, y = centre
    axes.plot(x, y, "o", markersize=9, color="white", markeredgecolor=_INK, zorder=5)
    axes.plot(x, y, "+", markersize=9, color=_INK, zorder=6)
    end = y + 0.34 * size
    _arrow(axes, (x, y), (x, end), _INK)
    number = name.strip("$")[-1]
    place = x - 0.05 * size, end
    axes.text(*place, f"$m_{number}g$", color=_INK, fontsize=13, ha="right", va="center")
    place = x + 0.1 * size, y - 0.1 * size
    axes.text(*place, name, color=_INK, fontsize=13, ha="center", va="center")


def main() -> None:
    """Write the drawing to the file named on the command line."""
    path = Path(sys.argv[1])
    with mpl.rc_context({"svg.hashsalt": "twolink", "mathtext.fontset": "cm"}):
        metadata = {"Date": None} if path.suffix == ".svg" else None
        schematic().savefig(path, metadata=metadata, dpi=150)


if __name__ == "__main__":
    main()
