"""The grid of a film, in the plane of motion."""

from __future__ import annotations

import numpy as np

from twolink.viz.commands import ROOT, line_segments
from twolink.viz.framing import Box, grid_spacing
from twolink.viz.themes import Theme

_ORDER = -2


def grid(box: Box, theme: Theme) -> list[bytes]:
    """Return the commands that draw a grid far beyond a box, with highlighted axes."""
    spacing, far = grid_spacing(box), 3 * box.size
    x0, x1 = np.floor((box.left - far) / spacing), np.ceil((box.right + far) / spacing)
    y0, y1 = np.floor((box.top - far) / spacing), np.ceil((box.bottom + far) / spacing)
    ends = [[(x, y0), (x, y1)] for x in np.arange(x0, x1 + 1) if x]
    ends += [[(x0, y), (x1, y)] for y in np.arange(y0, y1 + 1) if y]
    axes = [[(0, y0), (0, y1)], [(x0, 0), (x1, 0)]]
    return [
        line_segments(
            f"{ROOT}/{name}", spacing * np.array(lines).reshape(-1, 2), colour, order=order
        )
        for name, lines, colour, order in (
            ("grid", ends, theme.grid, _ORDER),
            ("axes", axes, theme.axis, _ORDER + 1),
        )
    ]
