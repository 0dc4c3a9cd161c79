import math

import numpy as np
import pytest

from twolink.viz.shapes import arrow, bar, disc, hatched_edge, joined, ribbon, ring, stroke


def area(shape):
    a, b, c = (shape.corners[shape.faces[:, k]] for k in range(3))
    u, v = b - a, c - a
    return float(np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum() / 2)


def test_shapes_have_their_areas():
    # A polygon of 40 corners has 0.41 % less than its circle.
    assert area(disc((3, -2), 0.5)) == pytest.approx(math.pi * 0.25, rel=5e-3)
    assert area(ring((1, 1), 0.3, 0.5)) == pytest.approx(math.pi * 0.16, rel=5e-3)
    assert area(stroke((0, 0), (3, 4), 0.1)) == pytest.approx(0.5)
    assert area(bar(2.0, 0.2)) == pytest.approx(0.4 + math.pi * 0.01, rel=5e-3)


def test_a_bar_reaches_half_its_width_beyond_its_joints():
    corners = bar(2.0, 0.2).corners
    assert corners.min(axis=0) == pytest.approx([-0.1, -0.1])
    assert corners.max(axis=0) == pytest.approx([2.1, 0.1])


@pytest.mark.parametrize("length", [1e-9, 0.01, 1.0])
def test_an_arrow_ends_at_its_head(length):
    found = arrow((0, 0), (length, 0), 0.1)
    assert found.corners[:, 0].max() == pytest.approx(length, rel=1e-9)
    assert np.isfinite(found.corners).all()


def test_an_arrow_of_zero_length_has_no_faces():
    assert len(arrow((1, 2), (1, 2), 0.1).faces) == 0


def test_a_ribbon_has_its_width_across_the_line():
    line = np.column_stack([np.linspace(0, 1, 11), np.zeros(11)])
    widths = np.linspace(0.2, 0, 11)
    shape = ribbon(line, widths)
    upper, lower = shape.corners[:11], shape.corners[11:]
    assert np.abs(upper - lower)[:, 1] == pytest.approx(widths)
    assert area(shape) == pytest.approx(0.1)


def test_a_ribbon_of_a_point_at_rest_is_finite():
    assert np.isfinite(ribbon(np.zeros((5, 2)), np.ones(5)).corners).all()


def test_hatches_lie_inside_the_half_plane():
    point, along, inward = np.array([1.0, 2.0]), np.array([1.0, 0.0]), np.array([0.0, 1.0])
    shape = hatched_edge(point, along, inward, half=3.0, size=0.2)
    depth = (shape.corners - point) @ inward
    # A hatch begins within the edge's own width, and its corners stand half a line aside.
    assert depth.min() >= 0
    assert depth.max() < 0.2
    assert np.abs((shape.corners - point) @ along).max() < 3.3


def test_joined_shapes_keep_their_triangles():
    one, other = disc((0, 0), 1.0), stroke((0, 0), (1, 0), 0.5)
    both = joined([one, other])
    assert area(both) == pytest.approx(area(one) + area(other))
    assert both.faces.max() == len(both.corners) - 1
