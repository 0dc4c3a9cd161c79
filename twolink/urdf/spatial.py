"""Vectors, rotations and poses in space, as far as a URDF needs them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Pose:
    """Where a frame stands in another: its axes as columns, and its origin (m)."""

    rotation: Array
    translation: Array

    def __matmul__(self, inner: Pose) -> Pose:
        """Return the pose of a frame that is given in this one."""
        return Pose(self.rotation @ inner.rotation, self.at(inner.translation))

    def at(self, point: Array) -> Array:
        """Return the point given in this frame, in the outer one (m)."""
        return np.asarray(self.rotation @ point + self.translation)


IDENTITY = Pose(np.eye(3), np.zeros(3))


def rotation_of(rpy: Array) -> Array:
    """Return the rotation of URDF's roll, pitch and yaw (rad) about fixed axes x, y, z."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


def norm(vector: Array) -> float:
    """Return a vector's length; exact when it lies along an axis."""
    return math.hypot(*vector)


def across(vector: Array, axis: Array) -> Array:
    """Return the part of a vector that is perpendicular to a unit axis."""
    return np.asarray(vector - (vector @ axis) * axis)


def as_tuple(vector: Array) -> Vector3:
    """Return a vector as three plain floats, without negative zeros."""
    x, y, z = (float(entry) + 0.0 for entry in vector)
    return x, y, z
