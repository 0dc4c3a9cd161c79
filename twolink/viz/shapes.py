"""Flat shapes as triangles in the plane of motion: x to the right, y downward, m."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Place = Sequence[float] | Array
Faces = NDArray[np.uint32]

_ROUND = 40


class Shape(NamedTuple):
    """Corners (m), shape (n, 2), and the triangles between them by number, shape (k, 3)."""

    corners: Array
    faces: Faces


EMPTY = Shape(np.empty((0, 2)), np.empty((0, 3), dtype=np.uint32))


def joined(shapes: Sequence[Shape]) -> Shape:
    """Return shapes merged into one, later ones above earlier ones."""
    if not shapes:
        return EMPTY
    starts = np.cumsum([0, *(len(shape.corners) for shape in shapes[:-1])])
    faces = [shape.faces + np.uint32(start) for shape, start in zip(shapes, starts, strict=True)]
    return Shape(np.concatenate([shape.corners for shape in shapes]), np.concatenate(faces))


def convex(corners: Array) -> Shape:
    """Return the convex shape with these corners (m), in order."""
    count = len(corners)
    fan = [(0, k, k + 1) for k in range(1, count - 1)]
    return Shape(np.asarray(corners, dtype=float), np.array(fan, dtype=np.uint32).reshape(-1, 3))


def disc(centre: Place, radius: float) -> Shape:
    """Return a disc (m)."""
    turns = np.linspace(0, 2 * math.pi, _ROUND, endpoint=False)
    return convex(np.array(centre) + radius * np.column_stack([np.cos(turns), np.sin(turns)]))


def ring(centre: Place, inner: float, outer: float) -> Shape:
    """Return the ring between two concentric circles (m)."""
    turns = np.linspace(0, 2 * math.pi, _ROUND, endpoint=False)
    unit = np.column_stack([np.cos(turns), np.sin(turns)])
    corners = np.array(centre) + np.concatenate([outer * unit, inner * unit])
    return Shape(corners, _strip_faces(_ROUND, closed=True))


def stroke(start: Place, end: Place, width: float) -> Shape:
    """Return a straight line of a width (m), with flat ends."""
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    across = _across(b - a) * width / 2
    return convex(np.array([a + across, b + across, b - across, a - across]))


def bar(length: float, width: float) -> Shape:
    """Return a bar from the origin along x, with round ends about its joints (m)."""
    turns = np.linspace(-math.pi / 2, math.pi / 2, _ROUND // 2 + 1)
    round_end = width / 2 * np.column_stack([np.cos(turns), np.sin(turns)])
    return convex(np.concatenate([round_end + np.array([length, 0.0]), -round_end]))


def arrow(tail: Place, head: Place, width: float) -> Shape:
    """Return an arrow with a shaft of a width (m); a short arrow has only a head."""
    a, b = np.asarray(tail, dtype=float), np.asarray(head, dtype=float)
    size = float(np.hypot(*(b - a)))
    if size == 0:
        return EMPTY
    along, across = (b - a) / size, _across(b - a)
    length = min(size, 3.2 * width)
    neck, half = b - along * length, length * 1.5 / 3.2
    tip = convex(np.array([b, neck + across * half, neck - across * half]))
    return joined([stroke(a, neck + along * 0.1 * length, min(width, half)), tip])


def ribbon(line: Array, widths: Array) -> Shape:
    """Return a band along a line of points (m), shape (n, 2), with a width at each of them."""
    forward = np.gradient(line, axis=0)
    size = np.hypot(forward[:, 0], forward[:, 1])
    # Points at rest have no direction; any is valid.
    still = size == 0
    forward[still], size[still] = (1.0, 0.0), 1.0
    across = np.column_stack([-forward[:, 1], forward[:, 0]]) / size[:, None]
    offset = across * widths[:, None] / 2
    return Shape(np.concatenate([line + offset, line - offset]), _strip_faces(len(line)))


def hatched_edge(point: Array, along: Array, inward: Array, half: float, size: float) -> Shape:
    """Return the edge of a half-plane through a point, hatched on its inner side (m).

    `along` and `inward` are unit vectors; the edge extends by `half` to both sides, hatches are
    about `size` long, at positions that do not depend on the point on the edge.
    """
    edge = convex(
        np.array(
            [
                point - half * along,
                point + half * along,
                point + half * along + 0.16 * size * inward,
                point - half * along + 0.16 * size * inward,
            ]
        )
    )
    slant = 0.75 * size * (inward - along)
    places = np.arange(-math.floor(half / size), math.floor(half / size) + 1) * size
    start = 0.1 * size * inward
    hatches = [
        stroke(point + place * along + start, point + place * along + slant, 0.09 * size)
        for place in places
    ]
    return joined([edge, *hatches])


def _across(direction: Array) -> Array:
    """Return the unit vector rotated by +90°."""
    size = float(np.hypot(*direction)) or 1.0
    return np.array([-direction[1], direction[0]]) / size


def _strip_faces(count: int, *, closed: bool = False) -> Faces:
    """Return the triangles between two lines of `count` corners, one after the other."""
    here = np.arange(count if closed else count - 1)
    there = (here + 1) % count
    first = np.column_stack([here, there, here + count])
    second = np.column_stack([there, there + count, here + count])
    return np.concatenate([first, second]).astype(np.uint32)
