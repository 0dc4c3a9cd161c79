import numpy as np
import pytest

from twolink.viz.framing import Box, Framing, box_of, grid_spacing


def test_the_box_holds_all_points_with_room():
    points = np.array([[0.0, 0.0], [1.5, 0.2], [-1.0, 1.9]])
    box = box_of(points, reach=2.0)
    assert (box.left, box.right) == pytest.approx((-1.14, 1.64))
    assert (box.top, box.bottom) == pytest.approx((-0.14, 2.04))


def test_a_small_motion_has_a_box_of_half_the_reach():
    box = box_of(np.array([[0.0, 0.0], [0.0, 0.01]]), reach=2.0)
    assert box.right - box.left == pytest.approx(1.0)
    assert box.bottom - box.top == pytest.approx(1.0)


@pytest.mark.parametrize(("size", "spacing"), [(4.3, 0.5), (1.0, 0.2), (9.0, 1.0), (0.05, 0.01)])
def test_grid_lines_stand_at_round_numbers(size, spacing):
    assert grid_spacing(Box(0, size, 0, size)) == pytest.approx(spacing)


@pytest.mark.parametrize("window", [(1280, 720), (640, 480), (320, 900), (3840, 2160)])
@pytest.mark.parametrize("rows", [0, 3])
def test_the_box_fits_between_the_strips(window, rows):
    box = Box(-2.1, 2.1, -0.5, 2.1)
    framing = Framing(box, *window, rows)
    corners = np.array([[box.left, box.top], [box.right, box.bottom]])
    (left, top), (right, bottom) = framing.pixel(corners)
    assert left >= 18 * framing.unit - 1e-9
    assert right <= window[0] - 18 * framing.unit + 1e-9
    assert top >= (46 + 20 * rows) * framing.unit - 1e-9
    assert bottom <= window[1] - 62 * framing.unit + 1e-9
    # As large as it fits: it touches the sides, or the strips.
    gaps = [left - 18 * framing.unit, top - (46 + 20 * rows) * framing.unit]
    assert min(gaps) == pytest.approx(0, abs=1e-9)


def test_y_points_down_and_lengths_are_kept():
    framing = Framing(Box(0, 2, 0, 2), 800, 600)
    a, b, c = framing.pixel(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    assert b - a == pytest.approx([framing.scale, 0])
    assert c - a == pytest.approx([0, framing.scale])
