"""A right engine, written for the tests: Newton and Euler's recursion on lumped links, in NumPy.

It shares no code with the kit's truth, which sums over bodies, nor with the library's formulations.
Wrong engines override one of its steps.
"""

from __future__ import annotations

import sys
from xml.etree import ElementTree

import numpy as np

from twolink.conformance.contract import Engine, ModelRefusedError
from twolink.engines.messages import Understood

EYE = np.eye(3)


def rpy(words):
    roll, pitch, yaw = words
    return turn((0, 0, 1), yaw) @ turn((0, 1, 0), pitch) @ turn((1, 0, 0), roll)


def turn(axis, angle):
    """Return exp(angle [axis]×) by Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return EYE + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def steiner(mass, c):
    return mass * (c @ c * EYE - np.outer(c, c))


def cross(a, b):
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def numbers(text):
    return np.array([float(word) for word in text.split()])


class Arm(Engine):
    name = "arm"
    version = "1"
    reads = ("urdf", "parameters")
    effects = ("joint_damping", "joint_friction", "armature")

    # Reading

    def load(self, model):
        self.from_urdf = model.urdf is not None
        self.armature = np.zeros(2)
        if self.from_urdf:
            self.read_urdf(model)
        else:
            self.read_parameters(model.parameters)
        self.g = self.gravity(self.g)
        return self.understood()

    def understood(self):
        return Understood(
            mass=tuple(float(m) for m in self.m),
            damping=tuple(float(d) for d in self.damping),
            friction=tuple(float(f) for f in self.friction),
        )

    def gravity(self, vector):
        return vector

    def read_parameters(self, p):
        if not all(mass > 0 for mass in p.mass):
            raise ModelRefusedError("masses must be positive")
        self.R, self.p = [EYE, EYE], [np.zeros(3), np.array([p.length[0], 0, 0])]
        self.axis = [np.array([0.0, 0, 1])] * 2
        lumps = []
        for mass, (a, b), inertia in zip(p.mass, p.centre, p.inertia, strict=True):
            tensor = np.zeros((3, 3))
            tensor[2, 2] = inertia
            lumps.append(self.own(mass, np.array([a, b, 0.0]), tensor))
        self.m, self.c, self.I = map(list, zip(*lumps, strict=True))
        self.tip = np.array([p.length[1], 0.0, 0.0])
        self.g = np.array([0.0, p.gravity, 0.0])
        self.damping, self.friction = np.array(p.damping), np.array(p.friction)
        self.armature = np.array(p.armature)

    def read_urdf(self, model):
        try:
            robot = ElementTree.fromstring(model.urdf)
            for element in robot.iter():
                element.tag = element.tag.split("}")[-1]
            self.tree(robot)
            self.walk()
        except (ElementTree.ParseError, KeyError, ValueError, AttributeError) as error:
            raise ModelRefusedError(f"{type(error).__name__}: {error}") from error
        self.g = np.array(model.gravity)

    def tree(self, robot):
        self.links = {link.attrib["name"]: link for link in robot.findall("link")}
        self.below = {name: [] for name in self.links}
        children = set()
        for joint in robot.findall("joint"):
            child = joint.find("child").attrib["link"]
            if child in children or child not in self.links:
                raise ValueError(f"{child} must be a link with one parent")
            children.add(child)
            self.below[joint.find("parent").attrib["link"]].append((joint, child))
        (self.root,) = set(self.links) - children

    def walk(self):
        """Collect the joints that move, and the bodies behind each."""
        moving, bodies, self.tip = [], [[]], None
        ahead = self.rigid(self.root, EYE, np.zeros(3), True, [])
        while ahead:
            if len(ahead) > 1:
                raise ValueError("joints must move one behind the other")
            ((joint, child, R, p),) = ahead
            moving.append((joint, R, p))
            bodies.append([])
            ahead = self.rigid(child, EYE, np.zeros(3), True, bodies[-1])
        if len(moving) != 2 or self.tip is None:
            raise ValueError(f"two joints must move; got {len(moving)}")
        self.take(moving, bodies[1:])

    def rigid(self, name, R, p, own, bodies):
        """Collect the bodies fixed to a link, and return the moving joints behind them."""
        if name == "D":
            self.tip = p
        body = self.body(self.links[name], R, p, own)
        bodies += [] if body is None else [body]
        ahead = []
        for joint, child in self.below[name]:
            xyz, turned = self.origin(joint)
            there = R @ turned, p + R @ xyz
            if joint.attrib["type"] == "fixed":
                ahead += self.rigid(child, *there, False, bodies)
            else:
                ahead.append((joint, child, *there))
        return ahead

    def take(self, moving, bodies):
        self.R, self.p, self.axis, resistance = [], [], [], []
        for index, (joint, R, p) in enumerate(moving):
            if joint.attrib["type"] not in ("revolute", "continuous"):
                raise ValueError(f"joints must turn; got {joint.attrib['type']}")
            self.R.append(self.joint_rotation(R))
            self.p.append(self.joint_place(index, p))
            element = joint.find("axis")
            axis = numbers("1 0 0" if element is None else element.attrib["xyz"])
            if not np.linalg.norm(axis) > 0:
                raise ValueError("axis must not be zero")
            self.axis.append(self.direction(axis / np.linalg.norm(axis)))
            dynamics = joint.find("dynamics")
            found = {} if dynamics is None else dynamics.attrib
            resistance.append([float(found.get(key, 0)) for key in ("damping", "friction")])
        self.damping, self.friction = np.array(resistance).T
        lumps = [self.lump(each) for each in bodies]
        self.m, self.c, self.I = map(list, zip(*lumps, strict=True))

    def joint_rotation(self, R):
        return R

    def joint_place(self, index, p):
        return p

    def direction(self, axis):
        return axis

    def origin(self, element):
        origin = element.find("origin")
        found = {} if origin is None else origin.attrib
        return numbers(found.get("xyz", "0 0 0")), rpy(numbers(found.get("rpy", "0 0 0")))

    def body(self, link, R, p, own):
        """Return mass, centre and inertia about it, in the frame of the moving link."""
        inertial = link.find("inertial")
        if inertial is None:
            return self.frame(p)
        mass = float(inertial.find("mass").attrib["value"])
        if not 0 <= mass < np.inf:
            raise ValueError("mass must be zero or more")
        xyz, turned = self.origin(inertial)
        tensor = self.tensor(inertial.find("inertia").attrib, link, mass)
        if not (np.diag(tensor) >= 0).all():
            raise ValueError("moments must be zero or more")
        tensor = self.in_link(tensor, turned)
        centre = p + R @ xyz
        tensor = self.in_moving(tensor, R, own)
        return self.own(mass, centre, tensor) if own else self.fixed(mass, centre, tensor, R @ xyz)

    def frame(self, p):
        return None

    def tensor(self, inertia, link, mass):
        xx, xy, xz, yy, yz, zz = (
            float(inertia[key]) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        )
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def in_link(self, tensor, turned):
        return turned @ tensor @ turned.T

    def in_moving(self, tensor, R, own):
        return R @ tensor @ R.T

    def own(self, mass, centre, tensor):
        return mass, centre, tensor

    def fixed(self, mass, centre, tensor, inside):
        return mass, centre, tensor

    def lump(self, bodies):
        mass = sum(m for m, _, _ in bodies)
        centre = sum(m * c for m, c, _ in bodies) / mass
        return mass, centre, sum(tensor + steiner(m, c - centre) for m, c, tensor in bodies)

    # Equations

    def poses(self, q):
        R, p, found = EYE, np.zeros(3), []
        for k in (0, 1):
            p = p + R @ self.p[k]
            R = R @ self.R[k] @ turn(self.axis[k], q[k])
            found.append((R, p, R @ self.axis[k]))
        return found

    def rnea(self, q, v, a, g):
        """Return joint torques by Newton and Euler's recursion."""
        w, alpha, A, last, forces = np.zeros(3), np.zeros(3), -g, np.zeros(3), []
        poses = self.poses(q)
        for k, (R, p, z) in enumerate(poses):
            d = p - last
            A = A + cross(alpha, d) + cross(w, cross(w, d))
            alpha = alpha + z * a[k] + cross(w, z * v[k])
            w, last = w + z * v[k], p
            c, tensor = R @ self.c[k], R @ self.I[k] @ R.T
            force = self.m[k] * (A + cross(alpha, c) + cross(w, cross(w, c)))
            forces.append((p + c, force, tensor @ alpha + cross(w, tensor @ w)))
        torques = []
        for k, (_, p, z) in enumerate(poses):
            moment = sum(n + cross(at - p, f) for at, f, n in forces[k:])
            torques.append(z @ moment)
        return np.array(torques)

    def matrix(self, q):
        still = np.zeros(2)
        columns = [self.rnea(q, still, unit, np.zeros(3)) for unit in np.eye(2)]
        return np.array(columns).T + np.diag(self.armature)

    def quadratic(self, q, v):
        return self.rnea(q, v, np.zeros(2), np.zeros(3))

    def weight(self, q):
        return self.rnea(q, np.zeros(2), np.zeros(2), self.g)

    def resistance(self, v):
        return self.damping * v + self.friction * np.sign(v)

    def coupled(self, q):
        return self.matrix(q)

    def inverse(self, q, v, a):
        return self.coupled(q) @ a + self.quadratic(q, v) + self.weight(q) + self.resistance(v)

    def forward(self, q, v, tau):
        rest = tau - self.quadratic(q, v) - self.weight(q) - self.resistance(v)
        return np.linalg.solve(self.coupled(q), rest)

    def energy(self, q, v):
        return v @ self.matrix(q) @ v / 2

    def height(self, q):
        return -sum(
            m * self.g @ (p + R @ c)
            for m, c, (R, p, _) in zip(self.m, self.c, self.poses(q), strict=True)
        )

    def end(self):
        return self.tip

    def place(self, q):
        R, p, _ = self.poses(q)[1]
        return p + R @ self.end()

    def slope(self, q):
        at = self.place(q)
        return np.array([cross(z, at - p) for _, p, z in self.poses(q)]).T

    def swing(self, q, v):
        """Return the acceleration of D at zero joint accelerations."""
        (_, p1, z1), (_, p2, z2) = self.poses(q)
        w1, w2 = z1 * v[0], z1 * v[0] + z2 * v[1]
        arm = self.place(q) - p2
        return (
            cross(w1, cross(w1, p2 - p1))
            + cross(cross(w1, z2 * v[1]), arm)
            + cross(w2, cross(w2, arm))
        )

    # Answers

    def rows(self, function, *inputs):
        return np.array([function(*state) for state in zip(*inputs, strict=True)])

    def vectors(self, values):
        """Return three components for a model from URDF, and two for one from parameters."""
        return values if self.from_urdf else values[:, :2]

    def mass_matrix(self, angles):
        return self.rows(self.matrix, angles)

    def velocity_terms(self, angles, speeds):
        return self.rows(self.quadratic, angles, speeds)

    def gravity_terms(self, angles):
        return self.rows(self.weight, angles)

    def inverse_dynamics(self, angles, speeds, accelerations):
        return self.rows(self.inverse, angles, speeds, accelerations)

    def forward_dynamics(self, angles, speeds, torques):
        return self.rows(self.forward, angles, speeds, torques)

    def kinetic_energy(self, angles, speeds):
        return self.rows(self.energy, angles, speeds)

    def potential_energy(self, angles):
        return self.rows(self.height, angles)

    def position(self, angles):
        return self.vectors(self.rows(self.place, angles))

    def velocity(self, angles, speeds):
        return self.vectors(self.rows(lambda q, v: self.slope(q) @ v, angles, speeds))

    def acceleration(self, angles, speeds, accelerations):
        return self.vectors(
            self.rows(
                lambda q, v, a: self.slope(q) @ a + self.swing(q, v),
                angles,
                speeds,
                accelerations,
            )
        )

    def jacobian(self, angles):
        return self.vectors(self.rows(self.slope, angles))


class Muttering(Arm):
    """It prints a warning when it loads a model."""

    def load(self, model):
        sys.stderr.write("[warning] \x1b[31mno licence\n")
        return super().load(model)
