"""The grid of a film."""

import numpy as np
import pytest

from twolink.viz.commands import decoded
from twolink.viz.framing import Box, grid_spacing
from twolink.viz.grid import grid
from twolink.viz.themes import DARK


def test_lines_are_multiples_of_the_spacing_and_reach_beyond_the_box():
    box = Box(-1.0, 2.0, -0.5, 1.5)
    lines, axes = map(decoded, grid(box, DARK))
    spacing = grid_spacing(box)
    for command, colour in ((lines, DARK.grid), (axes, DARK.axis)):
        drawn = command["object"]
        assert drawn["materials"][0]["color"] == int(colour[1:], 16)
        points = drawn["geometries"][0]["data"]["attributes"]["position"]["array"].reshape(-1, 3)
        x, y = points[:, 0], -points[:, 2]
        for coordinate in (x, y):
            assert coordinate / spacing == pytest.approx(np.round(coordinate / spacing), abs=1e-5)
        assert x.min() < box.left - box.size
        assert x.max() > box.right + box.size
        assert y.min() < box.top - box.size
        assert y.max() > box.bottom + box.size


def test_only_the_axes_go_through_the_origin():
    for command, axes in zip(
        map(decoded, grid(Box(-1, 1, -1, 1), DARK)), (False, True), strict=True
    ):
        points = command["object"]["geometries"][0]["data"]["attributes"]["position"]["array"]
        ends = points.reshape(-1, 2, 3)[:, :, [0, 2]]
        through = [
            any((ends[k, 0, i] == 0) and (ends[k, 1, i] == 0) for i in (0, 1))
            for k in range(len(ends))
        ]
        assert through == [axes] * len(ends)
