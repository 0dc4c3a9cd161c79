"""The end D of link 2: a frame of the file, or a place beyond the mass centre."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from twolink.errors import UrdfError
from twolink.text import quoted
from twolink.urdf.lumping import RigidBody
from twolink.urdf.reading import listed
from twolink.urdf.spatial import ZERO, Vector3, norm, scale

ROUNDING = 1e-12
"""Ratios of lengths up to this are zero, as are angles (rad) that count by their square: float64
leaves as much after some thousand rotations."""

Point2 = tuple[float, float]
Projection = Callable[[Vector3], Point2]
"""A map from a vector in the frame of a link to its components in the plane."""


@dataclass(frozen=True)
class Tip:
    """The frame taken as D, its position in the frame of link 2, and notes on the choice."""

    name: str | None
    position: Vector3
    notes: tuple[str, ...] = ()


def find_tip(body: RigidBody, wanted: str | None, centre: Vector3, project: Projection) -> Tip:
    """Return the frame taken as D: the wanted one, or that named D, or the best guess."""
    frames, link = body.frames, body.joint.child
    if wanted is not None:
        if wanted not in frames:
            raise UrdfError(
                f"tip must be a frame fixed to link {quoted(link)}, one of {listed(frames)}; got"
                f" {quoted(wanted)}"
            )
        return Tip(wanted, frames[wanted].position)
    fixed = {name: pose.position for name, pose in frames.items() if name != link}
    if "D" in fixed:
        return Tip("D", fixed["D"])
    farthest = max(fixed, key=lambda name: distance(fixed[name], project), default=None)
    if farthest is not None and distance(fixed[farthest], project) > 0:
        note = f"D is taken at frame {quoted(farthest)}, the farthest one fixed to link 2."
        return Tip(farthest, fixed[farthest], (note,))
    if distance(centre, project) > 0:
        note = (
            f"No frame is fixed to link {quoted(link)}; D is taken at twice the distance of its"
            " mass centre, as in a uniform bar."
        )
        return Tip(None, scale(2.0, centre), (note,))
    return Tip(None, ZERO, (f"No frame marks the end of link {quoted(link)}; D is taken at B.",))


def direction_of_link2(
    body: RigidBody, tip: Vector3, project: Projection
) -> tuple[Point2, tuple[str, ...]]:
    """Return the unit vector from B to D, or along the link's own frame if D is at B."""
    if distance(tip, project) > 0:
        return direction(project(tip)), ()
    x, y = project((1.0, 0.0, 0.0)), project((0.0, 1.0, 0.0))
    # One of the two has at least half of its length squared in the plane.
    name, axis = ("x", x) if math.hypot(*x) > 0.5 else ("y", y)
    link = quoted(body.joint.child)
    return direction(axis), (
        f"D is at B, so the {name}-axis of link {link} is taken as the direction of link 2.",
    )


def distance(point: Vector3, project: Projection) -> float:
    """Return how far a point is from its joint's axis (m), and zero for a distance of rounding."""
    distance = math.hypot(*project(point))
    return distance if distance > ROUNDING * norm(point) else 0.0


def direction(point: Point2) -> Point2:
    """Return the unit vector towards a point of the plane other than the origin."""
    distance = math.hypot(*point)
    return point[0] / distance, point[1] / distance
