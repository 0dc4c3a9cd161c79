"""Rigid-body dynamics of two joints in space, as sums over bodies, for numbers of any type.

A link of the chain is a set of bodies that move together. Each body contributes on its own to the
mass matrix and to the forces; nothing is lumped and no plane is assumed, so that the parallel-axis
theorem, the planar reduction and the formulations of this library play no part in the result.

    M_ij = Σ m J_i · J_j + ω_i · I ω_j                 J_i = z_i × (r − p_i), ω_i = z_i
    c_i  = Σ m J_i · a + ω_i · (I α + ω × I ω)         a, α: with zero joint accelerations
    g_i  = −Σ m g · J_i

(R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 6, for the Jacobian form of M.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property

from twolink.arithmetic import Matrix, Pair, Scalar
from twolink.hardcases import exact
from twolink.urdf.spatial import (
    Matrix3,
    Pose,
    Vector3,
    add,
    cross,
    dot,
    scale,
    subtract,
    transpose,
    turn,
)

HOME = Pose((0, 0, 0), ((1, 0, 0), (0, 1, 0), (0, 0, 1)))
"""No displacement, in integers, which every number type takes."""


@dataclass(frozen=True)
class Arithmetic:
    """A number type: its constructor from float64, cosine and sine of an angle, square root."""

    number: Callable[[float], Scalar]
    cosine_and_sine: Callable[[Scalar], tuple[Scalar, Scalar]]
    sqrt: Callable[[Scalar], Scalar]


FLOATS = Arithmetic(float, lambda x: (math.cos(x), math.sin(x)), math.sqrt)
"""float64."""

DECIMALS = Arithmetic(Decimal, exact.cosine_and_sine, Decimal.sqrt)
"""A hundred digits, inside of `twolink.hardcases.exact.digits`."""


@dataclass(frozen=True)
class Body:
    """A rigid body that moves with link 1 or 2.

    `placement` is the frame of the body's URDF link in the frame of the moving link, and `inertial`
    the inertial frame in that; `tensor` is the inertia about the mass centre along the inertial
    frame's axes (kg m²). `own` states that the URDF link is the moving one, `declared` that it has
    an inertial; `box` has the lengths (m) of its collision geometry if that is a box. `path` is the
    length (m) of the way from the joint to the mass centre through all frames.
    """

    link: int
    mass: Scalar
    inertial: Pose
    tensor: Matrix3
    placement: Pose = HOME
    own: bool = True
    declared: bool = True
    box: Vector3 | None = None
    path: float = 0.0

    @cached_property
    def centre(self) -> Vector3:
        """The mass centre in the frame of the moving link (m)."""
        return self.placement.point(self.inertial.position)

    @cached_property
    def inertia(self) -> Matrix3:
        """The inertia about the mass centre along the axes of the moving link (kg m²)."""
        return turned_tensor((self.placement @ self.inertial).rotation, self.tensor)


@dataclass(frozen=True)
class Joint:
    """A joint: its frame at angle zero in that of its parent, and its axis in its own frame.

    The axis is a unit vector. `path` is the length (m) of the way to it through all frames.
    """

    placement: Pose
    axis: Vector3
    path: float = 0.0


@dataclass(frozen=True)
class SpatialModel:
    """Two joints in a row, the bodies on both links, the end D in link 2, and gravity (m/s²).

    Vectors are in the frame of the root. `plane` has x and y of the chain's frame and `origin` its
    origin A: positions are given in it. `damping` (N m s/rad), `friction` (N m) and `armature`
    (kg m²) belong to the joints.
    """

    joints: tuple[Joint, Joint]
    bodies: tuple[Body, ...]
    tip: Vector3
    gravity: Vector3
    plane: tuple[Vector3, Vector3]
    origin: Vector3
    damping: Pair = (0, 0)
    friction: Pair = (0, 0)
    armature: Pair = (0, 0)
    tip_path: float = 0.0


class SpatialState:
    """A model in a state: joint angles (rad) and speeds (rad/s); results in joint coordinates."""

    def __init__(
        self, model: SpatialModel, arithmetic: Arithmetic, angles: Pair, speeds: Pair = (0, 0)
    ) -> None:
        """Place both links."""
        self.model = model
        self.speeds = speeds
        self._arithmetic = arithmetic
        world = HOME
        links = []
        for joint, angle in zip(model.joints, angles, strict=True):
            spun = Pose((0, 0, 0), rotation_about(joint.axis, *arithmetic.cosine_and_sine(angle)))
            world = world @ joint.placement @ spun
            links.append(world)
        self.links: tuple[Pose, Pose] = (links[0], links[1])

    @cached_property
    def axes(self) -> tuple[Vector3, Vector3]:
        """The axes of both joints."""
        first, second = (
            turn(link.rotation, joint.axis)
            for link, joint in zip(self.links, self.model.joints, strict=True)
        )
        return first, second

    def columns(self, link: int, point: Vector3) -> tuple[Vector3, Vector3]:
        """Return ∂v/∂θ̇1 and ∂v/∂θ̇2 of a point of a link (m)."""
        first = cross(self.axes[0], subtract(point, self.links[0].position))
        if link == 1:
            return first, (0, 0, 0)
        return first, cross(self.axes[1], subtract(point, self.links[1].position))

    def turning(self, link: int) -> tuple[Vector3, Vector3]:
        """Return ∂ω/∂θ̇1 and ∂ω/∂θ̇2 of a link."""
        return self.axes if link == 2 else (self.axes[0], (0, 0, 0))

    def angular_velocity(self, link: int) -> Vector3:
        """Return ω of a link (rad/s)."""
        first = scale(self.speeds[0], self.axes[0])
        return first if link == 1 else add(first, scale(self.speeds[1], self.axes[1]))

    def bias(self, link: int, point: Vector3) -> Vector3:
        """Return the acceleration of a point of a link at zero joint accelerations (m/s²)."""
        omega1, elbow = self.angular_velocity(1), self.links[1].position
        root = self.links[0].position
        if link == 1:
            return cross(omega1, cross(omega1, subtract(point, root)))
        omega, arm = self.angular_velocity(2), subtract(point, elbow)
        at_elbow = cross(omega1, cross(omega1, subtract(elbow, root)))
        swung = cross(omega, cross(omega, arm))
        return add(at_elbow, add(cross(self.angular_bias(2), arm), swung))

    def angular_bias(self, link: int) -> Vector3:
        """Return the angular acceleration of a link at zero joint accelerations (rad/s²)."""
        first, second = (
            scale(speed, axis) for speed, axis in zip(self.speeds, self.axes, strict=True)
        )
        return cross(first, second) if link == 2 else (0, 0, 0)

    @cached_property
    def centres(self) -> tuple[Vector3, ...]:
        """The mass centre of each body along the root's axes (m)."""
        return tuple(self.links[body.link - 1].point(body.centre) for body in self.model.bodies)

    @cached_property
    def inertias(self) -> tuple[Matrix3, ...]:
        """The inertia of each body along the root's axes (kg m²)."""
        return tuple(
            turned_tensor(self.links[body.link - 1].rotation, body.inertia)
            for body in self.model.bodies
        )

    def _placed(self) -> Iterator[tuple[Body, Vector3, Matrix3]]:
        """Yield each body with its mass centre and its inertia."""
        return zip(self.model.bodies, self.centres, self.inertias, strict=True)

    def mass_matrix(self) -> Matrix:
        """Return M (kg m²)."""
        found: list[list[Scalar]] = [[0, 0], [0, 0]]
        for body, point, inertia in self._placed():
            columns, turns = self.columns(body.link, point), self.turning(body.link)
            for i in (0, 1):
                for j in (0, 1):
                    found[i][j] += body.mass * dot(columns[i], columns[j])
                    found[i][j] += dot(turns[i], turn(inertia, turns[j]))
        (M11, M12), (M21, M22) = found
        a1, a2 = self.model.armature
        return (M11 + a1, M12), (M21, M22 + a2)

    def velocity_terms(self) -> Pair:
        """Return C θ̇ (N m)."""
        found: list[Scalar] = [0, 0]
        for body, point, inertia in self._placed():
            columns, turns = self.columns(body.link, point), self.turning(body.link)
            omega = self.angular_velocity(body.link)
            force = scale(body.mass, self.bias(body.link, point))
            moment = add(
                turn(inertia, self.angular_bias(body.link)), cross(omega, turn(inertia, omega))
            )
            for i in (0, 1):
                found[i] += dot(columns[i], force) + dot(turns[i], moment)
        return found[0], found[1]

    def gravity_terms(self) -> Pair:
        """Return ∂V/∂θ (N m)."""
        found: list[Scalar] = [0, 0]
        for body, centre in zip(self.model.bodies, self.centres, strict=True):
            columns = self.columns(body.link, centre)
            for i in (0, 1):
                found[i] -= body.mass * dot(self.model.gravity, columns[i])
        return found[0], found[1]

    def resistance(self) -> Pair:
        """Return the joint torques that hold against damping and dry friction (N m)."""
        first, second = (
            damping * speed + friction * ((speed > 0) - (speed < 0))
            for damping, friction, speed in zip(
                self.model.damping, self.model.friction, self.speeds, strict=True
            )
        )
        return first, second

    def inverse_dynamics(self, accelerations: Pair) -> Pair:
        """Return the joint torques (N m) of joint accelerations (rad/s²)."""
        M, terms = self.mass_matrix(), self._terms()
        first, second = (
            row[0] * accelerations[0] + row[1] * accelerations[1] + term
            for row, term in zip(M, terms, strict=True)
        )
        return first, second

    def forward_dynamics(self, torques: Pair) -> Pair:
        """Return the joint accelerations (rad/s²) of joint torques (N m)."""
        (M11, M12), (M21, M22) = self.mass_matrix()
        r1, r2 = (torque - term for torque, term in zip(torques, self._terms(), strict=True))
        det = M11 * M22 - M12 * M21
        return (M22 * r1 - M12 * r2) / det, (M11 * r2 - M21 * r1) / det

    def kinetic_energy(self) -> Scalar:
        """Return T (J)."""
        energy: Scalar = 0
        for body, point, inertia in self._placed():
            velocity = _combined(self.speeds, self.columns(body.link, point))
            omega = self.angular_velocity(body.link)
            energy += body.mass * dot(velocity, velocity) + dot(omega, turn(inertia, omega))
        rotors = zip(self.model.armature, self.speeds, strict=True)
        energy += sum(armature * speed * speed for armature, speed in rotors)
        return energy / 2

    def potential_energy(self) -> Scalar:
        """Return V (J), zero with all mass centres at the root's origin."""
        return -sum(
            body.mass * dot(self.model.gravity, centre)
            for body, centre in zip(self.model.bodies, self.centres, strict=True)
        )

    @property
    def tip(self) -> Vector3:
        """D in the root's frame (m)."""
        return self.links[1].point(self.model.tip)

    def position(self) -> Pair:
        """Return D in the chain's frame (m)."""
        return self.in_plane(subtract(self.tip, self.model.origin))

    def velocity(self) -> Pair:
        """Return the velocity of D (m/s)."""
        return self.in_plane(_combined(self.speeds, self.columns(2, self.tip)))

    def acceleration(self, accelerations: Pair) -> Pair:
        """Return the acceleration of D (m/s²) at joint accelerations (rad/s²)."""
        driven = _combined(accelerations, self.columns(2, self.tip))
        return self.in_plane(add(driven, self.bias(2, self.tip)))

    def jacobian(self) -> Matrix:
        """Return ∂(x, y)/∂θ of D (m): rows x and y."""
        (x1, y1), (x2, y2) = (self.in_plane(column) for column in self.columns(2, self.tip))
        return (x1, x2), (y1, y2)

    def in_plane(self, vector: Vector3) -> Pair:
        """Return the components of a vector along x and y of the chain's frame."""
        x, y = self.model.plane
        return dot(x, vector), dot(y, vector)

    def _terms(self) -> tuple[Scalar, Scalar]:
        """Return all torques but M θ̈ (N m)."""
        parts = self.velocity_terms(), self.gravity_terms(), self.resistance()
        first, second = (sum(entries) for entries in zip(*parts, strict=True))
        return first, second


def rotation_about(axis: Vector3, c: Scalar, s: Scalar) -> Matrix3:
    """Return the rotation about a unit vector by an angle of given cosine and sine (Rodrigues)."""
    x, y, z = axis
    k = 1 - c
    return (
        (c + x * x * k, x * y * k - z * s, x * z * k + y * s),
        (y * x * k + z * s, c + y * y * k, y * z * k - x * s),
        (z * x * k - y * s, z * y * k + x * s, c + z * z * k),
    )


def turned_tensor(rotation: Matrix3, tensor: Matrix3) -> Matrix3:
    """Return R I Rᵀ: a tensor along the axes of the outer frame."""
    x, y, z = (turn(tensor, row) for row in rotation)
    # The tensor is symmetric, so its product with a row of R is a column of I Rᵀ.
    a, b, c = (turn(rotation, column) for column in (x, y, z))
    return transpose((a, b, c))


def _combined(factors: Pair, columns: tuple[Vector3, Vector3]) -> Vector3:
    return add(scale(factors[0], columns[0]), scale(factors[1], columns[1]))
