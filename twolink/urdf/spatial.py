"""Vectors, rotations and poses in space, as tuples of floats.

Every operation is exact where it can be: a rotation by zero angles is the identity, and a unit
vector along an axis of the frame has components 0 and ±1. So a vector along an axis
is read without rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

Vector3 = tuple[float, float, float]
Matrix3 = tuple[Vector3, Vector3, Vector3]
"""The rows of a matrix. A rotation turns components in an inner frame into the outer frame's."""

STANDARD_GRAVITY = 9.81
"""The size of gravity (m/s²) in a URDF's world, along −z, unless another one is given."""

ZERO: Vector3 = (0.0, 0.0, 0.0)
IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def add(a: Vector3, b: Vector3) -> Vector3:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a: Vector3, b: Vector3) -> Vector3:
    """Return a − b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scale(factor: float, a: Vector3) -> Vector3:
    """Return a vector times a number."""
    return factor * a[0], factor * a[1], factor * a[2]


def dot(a: Vector3, b: Vector3) -> float:
    """Return a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector3, b: Vector3) -> Vector3:
    """Return a × b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def norm(a: Vector3) -> float:
    """Return the length of a vector, without overflow on the way."""
    return math.hypot(*a)


def unit(a: Vector3) -> Vector3:
    """Return the direction of a vector other than zero, however large or small it is."""
    largest = max(abs(component) for component in a)
    scaled = (a[0] / largest, a[1] / largest, a[2] / largest)
    length = norm(scaled)
    # Adding 0.0 turns −0.0 into 0.0 and changes nothing else.
    return scaled[0] / length + 0.0, scaled[1] / length + 0.0, scaled[2] / length + 0.0


def reject(a: Vector3, axis: Vector3) -> Vector3:
    """Return the part of a vector that is normal to a unit vector."""
    # Twice: a small remainder is largely round-off along the axis.
    once = subtract(a, scale(dot(a, axis), axis))
    return subtract(once, scale(dot(once, axis), axis))


def turn(rotation: Matrix3, a: Vector3) -> Vector3:
    """Return a matrix times a vector: for a rotation, its components in the outer frame."""
    # Written out: calls of `dot` would take most of the time.
    (a1, a2, a3), (b1, b2, b3), (c1, c2, c3) = rotation
    x, y, z = a
    return a1 * x + a2 * y + a3 * z, b1 * x + b2 * y + b3 * z, c1 * x + c2 * y + c3 * z


def transpose(rotation: Matrix3) -> Matrix3:
    """Return the inverse rotation."""
    x, y, z = rotation
    return (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])


def rotation_from_rpy(rpy: Vector3) -> Matrix3:
    """Return the rotation by roll, pitch and yaw (rad) about the fixed axes x, y, z in turn."""
    (sr, sp, sy), (cr, cp, cy) = map(math.sin, rpy), map(math.cos, rpy)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


@dataclass(frozen=True)
class Pose:
    """Where a frame stands in another frame: its origin (m) and its orientation."""

    position: Vector3 = ZERO
    rotation: Matrix3 = IDENTITY

    def point(self, a: Vector3) -> Vector3:
        """Return a point of the inner frame in the outer frame (m)."""
        return add(self.position, turn(self.rotation, a))

    def __matmul__(self, inner: Pose) -> Pose:
        """Return the pose, in this pose's outer frame, of a frame posed in its inner one."""
        x, y, z = (turn(self.rotation, axis) for axis in transpose(inner.rotation))
        return Pose(self.point(inner.position), transpose((x, y, z)))
