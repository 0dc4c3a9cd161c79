"""Drawings of surfaces and joint stops."""

from __future__ import annotations

import numpy as np

from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.text import printable
from twolink.viz.commands import ROOT, flat_mesh
from twolink.viz.framing import Box
from twolink.viz.labels import Label, Mark, line_mark
from twolink.viz.run import Run
from twolink.viz.shapes import Array, Shape, hatched_edge, joined, stroke
from twolink.viz.themes import Theme

_ORDER = 10

# Parts of a stop's drawing, relative to its size: its ends along its line, half of its bar, and the
# width of the lines.
_STOP = (1.2, 3.6, 0.7, 0.16)


def surfaces(run: Run, box: Box, size: float, theme: Theme) -> list[bytes]:
    """Return the commands that draw a run's surfaces and the stops of A; hatches of a size (m).

    The edges extend far beyond the box.
    """
    shapes = [_edge(effect, box, size) for effect in _half_planes(run)]
    shapes += [_stop(angle, size) for angle in _stop_angles(run, "A")]
    if not shapes:
        return []
    return [flat_mesh(f"{ROOT}/surfaces", joined(shapes), theme.surface, order=_ORDER)]


def surface_names(run: Run, box: Box) -> list[Label]:
    """Return the labels of the surfaces, each inside near the left end of its edge."""
    labels = []
    for effect in _half_planes(run):
        point, along, inward = _frame(effect)
        corners = np.array([[x, y] for x in (box.left, box.right) for y in (box.top, box.bottom)])
        steps = (corners - point) @ along
        ends = point + np.outer([steps.min(), steps.max()], along)
        place = ends[np.argmin(ends[:, 0] + 1e-6 * ends[:, 1])]
        place = np.clip(place, (box.left, box.top), (box.right, box.bottom))
        name = f"{effect.name} (for {', '.join(effect.on)})"
        labels.append([printable(name), *place.tolist(), *inward.tolist(), "surface"])
    return labels


def surface_marks(run: Run, box: Box, size: float) -> list[Mark]:
    """Return the marks of the surfaces' edges and of the stops of A; hatches of a size (m)."""
    marks = []
    for effect in _half_planes(run):
        point, along, inward = _frame(effect)
        # The hatches, which a label may cover, are inside.
        middle, half = point + 0.08 * size * inward, 4 * box.size * along
        marks.append(line_mark(middle - half, middle + half, 0.16 * size))
    stops = (_stop_lines(angle, size) for angle in _stop_angles(run, "A"))
    return [*marks, *(line_mark(*line, _STOP[3] * size) for lines in stops for line in lines)]


def elbow_marks(run: Run, size: float, elbow: Array, q1: float) -> list[Mark]:
    """Return the marks of the stops of B, at the elbow's place (m) on link 1 at an angle (rad)."""
    stops = (_stop_lines(q1 + angle, size) for angle in _stop_angles(run, "B"))
    return [
        line_mark(elbow + start, elbow + end, _STOP[3] * size)
        for lines in stops
        for start, end in lines
    ]


def stops_of_elbow(run: Run, size: float, theme: Theme, path: str) -> list[bytes]:
    """Return the commands that draw the stops of B, at a path in the frame of link 1."""
    shapes = [_stop(angle, size) for angle in _stop_angles(run, "B")]
    if not shapes:
        return []
    stops = joined(shapes)
    moved = Shape(stops.corners + np.array([float(run.chain.length[0]), 0.0]), stops.faces)
    return [flat_mesh(path, moved, theme.surface, order=_ORDER + 1)]


def _half_planes(run: Run) -> list[Surface | CompliantSurface]:
    effects = run.trajectory.scene.effects
    return [effect for effect in effects if isinstance(effect, Surface | CompliantSurface)]


def _stop_angles(run: Run, joint: str) -> list[float]:
    """Return the angles (rad) of a joint's stops."""
    return [
        angle
        for effect in run.trajectory.scene.effects
        if isinstance(effect, JointStop) and effect.joint == joint
        for angle in (effect.lower, effect.upper)
        if angle is not None
    ]


def _frame(effect: Surface | CompliantSurface) -> tuple[Array, Array, Array]:
    """Return a point of a surface's edge, and unit vectors along it and into the surface."""
    outward = np.array(effect.normal) / np.hypot(*effect.normal)
    return np.array(effect.point), np.array([-outward[1], outward[0]]), -outward


def _edge(effect: Surface | CompliantSurface, box: Box, size: float) -> Shape:
    """Return the edge of a half-plane, hatched, across the box and beyond."""
    point, along, inward = _frame(effect)
    middle = np.array([(box.left + box.right) / 2, (box.top + box.bottom) / 2])
    # Hatches are at integer multiples of their spacing from the effect's point.
    nearest = round(float((middle - point) @ along) / size) * size
    return hatched_edge(point + nearest * along, along, inward, 4 * box.size, size)


def _stop(angle: float, size: float) -> Shape:
    """Return a stop about the origin at an angle (rad)."""
    return joined([stroke(*line, _STOP[3] * size) for line in _stop_lines(angle, size)])


def _stop_lines(angle: float, size: float) -> list[tuple[Array, Array]]:
    """Return the ends of the lines of a stop about the origin at an angle (rad)."""
    way = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-way[1], way[0]])
    start, end, bar, _ = _STOP
    tip, half = end * size * way, bar * size * across
    return [(start * size * way, tip), (tip - half, tip + half)]
