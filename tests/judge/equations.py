"""The chain's equations of motion, and the directions along which friction and contacts act.

All functions take floats, or arrays of n values, for angles q1, q2 (rad) and speeds u1, u2 (rad/s).
With e = (cos q, sin q) and e' = (−sin q, cos q), a point (a, b) of a link is a e + b e' from the
link's joint. Its component along a vector v is a c + b s with c = v · e and s = v · e', where
dc/dq = s and ds/dq = −c.
"""

import math
from dataclasses import dataclass

import numpy as np

from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface

LINK_OF_POINT = {"B": 1, "C1": 1, "C2": 2, "D": 2}


class Turn:
    """The angle of joint A (q1) or B (q2 − q1), times `sense`."""

    def __init__(self, joint, sense=1.0):
        self.weights = (sense, 0.0) if joint == "A" else (-sense, sense)

    def coordinate(self, q):
        """Return the angle times the sense (rad)."""
        return self.weights[0] * q[0] + self.weights[1] * q[1]

    def row(self, q):
        """Return the derivatives of the coordinate by q1 and q2."""
        return self.weights[0] + 0 * q[0], self.weights[1] + 0 * q[0]

    def drift(self, q, u):
        """Return the coordinate's second derivative where du = 0."""
        return 0 * q[0] * u[0]


class Along:
    """The position (m) of a point of the chain along a unit vector."""

    def __init__(self, link, a, b, L1, vector):
        self.link, self.a, self.b, self.L1, self.vector = link, a, b, L1, vector

    def _components(self, angle):
        x, y = self.vector
        # Arithmetic with a float of NumPy takes several times as long as with Python's own.
        library = math if isinstance(angle, float) else np
        cos, sin = library.cos(angle), library.sin(angle)
        return x * cos + y * sin, y * cos - x * sin

    def coordinate(self, q):
        """Return the position along the vector (m)."""
        c1, s1 = self._components(q[0])
        if self.link == 1:
            return self.a * c1 + self.b * s1
        c2, s2 = self._components(q[1])
        return self.L1 * c1 + self.a * c2 + self.b * s2

    def row(self, q):
        """Return the derivatives of the coordinate by q1 and q2 (m)."""
        c1, s1 = self._components(q[0])
        if self.link == 1:
            return self.a * s1 - self.b * c1, 0 * c1
        c2, s2 = self._components(q[1])
        return self.L1 * s1, self.a * s2 - self.b * c2

    def drift(self, q, u):
        """Return the coordinate's second derivative where du = 0 (m/s²)."""
        c1, s1 = self._components(q[0])
        if self.link == 1:
            return -(u[0] ** 2) * (self.a * c1 + self.b * s1)
        c2, s2 = self._components(q[1])
        return -(u[0] ** 2) * self.L1 * c1 - u[1] ** 2 * (self.a * c2 + self.b * s2)


@dataclass(frozen=True)
class Friction:
    """Dry friction along a direction: `kinetic` while it moves, up to `static` at rest (N, N m)."""

    name: str
    direction: Turn | Along
    kinetic: float
    static: float


@dataclass(frozen=True)
class Contact:
    """A bound on a direction's coordinate; `tangent` is None where there is no friction.

    `guided` points belong to link 1: they move on a circle, so that their sliding speed is a
    multiple of their normal speed.
    """

    name: str
    direction: Turn | Along
    bound: float
    restitution: float
    tangent: Along | None = None
    kinetic: float = 0.0
    static: float = 0.0
    law: str = "stronge"
    guided: bool = False

    def gap(self, q):
        """Return the distance from the bound (m or rad), negative inside."""
        return self.direction.coordinate(q) - self.bound


class System:
    """The numbers of a scene, its equation of motion M du = r, and its frictions and contacts."""

    def __init__(self, scene):
        chain = scene.chain
        if chain.rotors:
            raise ValueError("the judge knows no rotors")
        self.mass, self.inertia = chain.mass, chain.inertia
        self.L1 = chain.length[0]
        points = {"B": (chain.length[0], 0.0), "D": (chain.length[1], 0.0)}
        self.points = {**points, "C1": chain.centre[0], "C2": chain.centre[1]}
        # Both mass centres and D along x and along y.
        axes = ((1.0, 0.0), (0.0, 1.0))
        self.centres = [[self.along(name, axis) for axis in axes] for name in ("C1", "C2")]
        self.end = [self.along("D", axis) for axis in axes]
        self.effects = scene.effects
        self.gravity = self._gravity()
        self.torques, self.dampers, self.springs, self.end_forces = (
            [effect for effect in scene.effects if isinstance(effect, kind)]
            for kind in (JointTorque, JointDamping, JointSpring, EndForce)
        )
        self.elements = []
        for effect in scene.effects:
            self.elements += self._elements_of(effect)
        self.names = [element.name for element in self.elements]
        self.depends_on_time = any(any(effect.amplitude) for effect in self.torques)

    @property
    def load_size(self):
        """A size (N m) of the torques of gravity and motors, the scale of small torques."""
        reach = [self.L1 + math.hypot(*self.points[name]) for name in ("C1", "C2")]
        weight = math.hypot(*self.gravity)
        size = weight * (self.mass[0] * reach[0] + self.mass[1] * reach[1])
        for effect in self.torques:
            size += sum(map(abs, effect.torque)) + sum(map(abs, effect.amplitude))
        return size

    def along(self, name, vector):
        """Return the direction of a named point along a unit vector."""
        return Along(LINK_OF_POINT[name], *self.points[name], self.L1, vector)

    def _elements_of(self, effect):
        """Return the frictions and contacts of an effect."""
        if isinstance(effect, JointFriction):
            static = effect.kinetic if effect.static is None else effect.static
            limits = zip("AB", effect.kinetic, static, strict=True)
            return [Friction(name, Turn(name), k, s) for name, k, s in limits if s > 0]
        if isinstance(effect, EndForce) and effect.sliding is None:
            static = effect.friction if effect.static is None else effect.static
            size = abs(effect.normal)
            friction = Friction("D", self.end[0], effect.friction * size, static * size)
            return [friction] if static * size > 0 else []
        if isinstance(effect, JointStop):
            bounds = (("lower", effect.lower, 1.0), ("upper", effect.upper, -1.0))
            return [
                Contact(
                    f"{effect.joint} on its {which} stop",
                    Turn(effect.joint, sense),
                    sense * angle,
                    effect.restitution,
                )
                for which, angle, sense in bounds
                if angle is not None
            ]
        if isinstance(effect, Surface):
            return [self._contact(effect, point) for point in effect.on]
        known = (EndForce, Gravity, JointDamping, JointSpring, JointTorque)
        if not isinstance(effect, known):
            raise ValueError(f"the judge knows no {type(effect).__name__}")
        return []

    def _contact(self, surface, point):
        """Return the contact of a point with a surface."""
        size = math.hypot(*surface.normal)
        x, y = surface.normal[0] / size, surface.normal[1] / size
        static = surface.friction if surface.static is None else surface.static
        return Contact(
            f"{point} on {surface.name}",
            self.along(point, (x, y)),
            x * surface.point[0] + y * surface.point[1],
            surface.restitution,
            tangent=self.along(point, (-y, x)) if static > 0 else None,
            kinetic=surface.friction,
            static=static,
            law=surface.law,
            guided=LINK_OF_POINT[point] == 1,
        )

    def mass_matrix(self, q):
        """Return M11, M12, M22 (kg m²): Σ m Jᵀ J of the mass centres, and I on the diagonal."""
        M11, M12, M22 = self.inertia[0] + 0 * q[0], 0 * q[0], self.inertia[1] + 0 * q[0]
        for mass, centre in zip(self.mass, self.centres, strict=True):
            for direction in centre:
                x, y = direction.row(q)
                M11, M12, M22 = M11 + mass * x * x, M12 + mass * x * y, M22 + mass * y * y
        return M11, M12, M22

    def smooth_forces(self, t, q, u):
        """Return r = Q − C u (N m): all loads that are functions of the state, less m a at du = 0.

        Each load's generalized force is the load times its direction's row.
        """
        r1, r2 = 0 * q[0], 0 * q[0]
        for mass, centre in zip(self.mass, self.centres, strict=True):
            for g, direction in zip(self.gravity, centre, strict=True):
                x, y = direction.row(q)
                force = mass * (g - direction.drift(q, u))
                r1, r2 = r1 + x * force, r2 + y * force
        at_A, at_B = self._joint_torques(t, q, u)
        r1, r2 = r1 + at_A - at_B, r2 + at_B
        for effect in self.end_forces:
            along_x = -(effect.sliding or 0) * effect.friction * abs(effect.normal)
            for force, direction in zip((along_x, effect.normal), self.end, strict=True):
                x, y = direction.row(q)
                r1, r2 = r1 + x * force, r2 + y * force
        return r1, r2

    def _gravity(self):
        """Return the acceleration of gravity along x and y (m/s²)."""
        total = np.zeros(2)
        for effect in self.effects:
            if isinstance(effect, Gravity):
                total += effect.g * np.array(effect.direction) / math.hypot(*effect.direction)
        return float(total[0]), float(total[1])

    def _joint_torques(self, t, q, u):
        """Return the torques in the joints A and B (N m), of motors, dampers and springs."""
        torques = [0 * q[0], 0 * q[0]]
        angles, speeds = (q[0], q[1] - q[0]), (u[0], u[1] - u[0])
        for j in (0, 1):
            for motor in self.torques:
                phase = motor.frequency[j] * t + motor.phase[j]
                library = math if isinstance(phase, float) else np
                periodic = motor.amplitude[j] * library.sin(phase)
                torques[j] = torques[j] + motor.torque[j] + periodic
            for damper in self.dampers:
                torques[j] = torques[j] - damper.coefficient[j] * speeds[j]
            for spring in self.springs:
                torques[j] = torques[j] - spring.stiffness[j] * (angles[j] - spring.rest[j])
        return torques


def dot(row, vector):
    """Return row · vector of two components."""
    return row[0] * vector[0] + row[1] * vector[1]


def solve_mass(M, force):
    """Return M⁻¹ force."""
    M11, M12, M22 = M
    det = M11 * M22 - M12 * M12
    return (M22 * force[0] - M12 * force[1]) / det, (M11 * force[1] - M12 * force[0]) / det


def plus(first, factor, second):
    """Return first + factor · second of two components."""
    return first[0] + factor * second[0], first[1] + factor * second[1]
