"""Wrong engines: each is the right one with the mistake of its name, and no other."""

import numpy as np

from tests.conformance.arm import EYE, Arm, steiner

WRONG = {}

# The groups in which a mistake shows, beside the usual ones of the evaluation suite.
USUAL = ("general", "damped", "rubbing", "no-gravity", "armature")
FILES = {}

# θ = T q: joint angles of absolute ones.
T = np.array([[1.0, 0.0], [-1.0, 1.0]])


def wrong(name, *files):
    def taken(kind):
        kind.name = name
        WRONG[name] = kind
        FILES[name] = files
        return kind

    return taken


# Gravity and effects


@wrong("gravity-sign")
class GravitySign(Arm):
    def gravity(self, vector):
        return -vector


@wrong("gravity-missing")
class NoGravity(Arm):
    def gravity(self, vector):
        return 0 * vector


@wrong("gravity-default")
class StandardGravity(Arm):
    def gravity(self, vector):
        down = np.array([0, 0, -1.0]) if self.from_urdf else np.array([0, 1.0, 0])
        return 9.80665 * down


@wrong("gravity-units")
class GravityInCentimetres(Arm):
    def gravity(self, vector):
        return 100 * vector


@wrong("armature-ignored")
class NoArmature(Arm):
    reads = ("parameters",)

    def matrix(self, q):
        return super().matrix(q) - np.diag(self.armature)


@wrong("damping-dropped")
class NoDamping(Arm):
    def resistance(self, v):
        return self.friction * np.sign(v)


@wrong("damping-sign")
class DrivingDamping(Arm):
    def resistance(self, v):
        return super().resistance(v) - 2 * self.damping * v


@wrong("friction-dropped")
class NoFriction(Arm):
    def resistance(self, v):
        return self.damping * v


@wrong("friction-sign")
class DrivingFriction(Arm):
    def resistance(self, v):
        return super().resistance(v) - 2 * self.friction * np.sign(v)


@wrong("damping-exchanged")
class ExchangedDamping(Arm):
    def resistance(self, v):
        return self.damping[::-1] * v + self.friction * np.sign(v)


@wrong("friction-exchanged")
class ExchangedFriction(Arm):
    def resistance(self, v):
        return self.damping * v + self.friction[::-1] * np.sign(v)


@wrong("absolute-damper")
class AbsoluteDamper(Arm):
    reads = ("parameters",)

    def resistance(self, v):
        return super().resistance(v) + np.array([0.0, self.damping[1] * v[0]])


# Files


@wrong("links-exchanged")
class ExchangedLinks(Arm):
    def load(self, model):
        super().load(model)
        self.m, self.c, self.I = self.m[::-1], self.c[::-1], self.I[::-1]
        return self.understood()


@wrong("mass-dropped")
class NoSecondMass(Arm):
    def load(self, model):
        super().load(model)
        self.m = [self.m[0], 0.0]
        return self.understood()


@wrong("fixed-link-dropped", "lumped-offset", "lumped-before-joint", "two-half-bars")
class Dropped(Arm):
    def body(self, link, R, p, own):
        return super().body(link, R, p, own) if own else None


@wrong("fixed-link-unplaced", "lumped-offset", "lumped-several")
class Unplaced(Arm):
    def fixed(self, mass, centre, tensor, inside):
        return mass, inside, tensor


@wrong("lumped-without-steiner", "two-half-bars", "lumped-offset", "lumped-several")
class NoSteiner(Arm):
    def lump(self, bodies):
        mass, centre, _ = super().lump(bodies)
        return mass, centre, sum(tensor for _, _, tensor in bodies)


@wrong("lumped-at-old-centre", "two-half-bars", "lumped-offset", "lumped-several")
class OldCentre(Arm):
    def lump(self, bodies):
        mass, centre, _ = super().lump(bodies)
        old = bodies[0][1]
        return mass, centre, sum(t + steiner(m, c - old) for m, c, t in bodies)


@wrong("fixed-rotation-ignored", "lumped-rod-along-axis", "lumped-rotated")
class Unturned(Arm):
    def in_moving(self, tensor, R, own):
        return tensor


@wrong("fixed-rotation-twice", "lumped-rod-rotated")
class TurnedTwice(Arm):
    def in_moving(self, tensor, R, own):
        return R @ R @ tensor @ R.T @ R.T


@wrong("inertial-rpy-ignored", "products-of-inertia", "inertial-rpy")
class NoInertialRpy(Arm):
    def in_link(self, tensor, turned):
        return tensor


@wrong("products-of-inertia", "products-of-inertia")
class NoProducts(Arm):
    def tensor(self, inertia, link, mass):
        return np.diag(np.diag(super().tensor(inertia, link, mass)))


@wrong("weighty-frames", "plain", "general", "frames-of-zero-mass")
class WeightyFrames(Arm):
    def frame(self, p):
        return 1.0, p, EYE


@wrong("box-inertia", "decorated", "plain")
class BoxInertia(Arm):
    def tensor(self, inertia, link, mass):
        box = link.find("collision/geometry/box")
        if box is None:
            return super().tensor(inertia, link, mass)
        x, y, z = (float(word) ** 2 for word in box.attrib["size"].split())
        return mass / 12 * np.diag([y + z, z + x, x + y])


@wrong("axis-sign", "negative-axes", "negative-axis-first", "negative-axis-second")
class AxisSign(Arm):
    def direction(self, axis):
        return axis if axis.sum() > 0 else -axis


@wrong("joint-rotation-ignored", "oblique-axes", "joint-between-frames")
class NoJointRotation(Arm):
    def joint_rotation(self, R):
        return EYE


@wrong("base-ignored", "base-placed")
class NoBase(Arm):
    def joint_place(self, index, p):
        return p if index else 0 * p


@wrong("inertia-about-joint")
class SteinerTwice(Arm):
    def own(self, mass, centre, tensor):
        return mass, centre, tensor + steiner(mass, centre)


@wrong("inertia-not-moved")
class NotMoved(Arm):
    def own(self, mass, centre, tensor):
        return mass, centre, tensor - steiner(mass, centre)


@wrong("inertia-missing")
class PointMasses(Arm):
    def own(self, mass, centre, tensor):
        return mass, centre, 0 * tensor

    def fixed(self, mass, centre, tensor, inside):
        return mass, centre, 0 * tensor

    def coupled(self, q):
        # Of point masses M may be singular where the arm is stretched.
        return self.matrix(q) + 1e-300 * EYE[:2, :2]


@wrong("end-at-centre")
class EndAtCentre(Arm):
    def end(self):
        return self.c[1]


@wrong("length-of-other")
class LengthOfOther(Arm):
    reads = ("parameters",)

    def read_parameters(self, p):
        super().read_parameters(p)
        self.p[1] = self.tip


@wrong("centre-on-other-side")
class OtherSide(Arm):
    reads = ("parameters",)

    def own(self, mass, centre, tensor):
        return mass, centre * np.array([1.0, -1.0, 1.0]), tensor


# Equations


@wrong("first-speed-for-second")
class FirstSpeed(Arm):
    """T2 has ω1 where it must have ω2, as a textbook prints it."""

    reads = ("parameters",)

    def energy(self, q, v):
        inertia = self.I[1][2, 2]
        return super().energy(q, v) + inertia * (v[0] ** 2 - (v[0] + v[1]) ** 2) / 2


@wrong("velocity-terms-missing")
class NoVelocityTerms(Arm):
    def quadratic(self, q, v):
        return np.zeros(2)


@wrong("velocity-terms-sign")
class VelocityTermsSign(Arm):
    def quadratic(self, q, v):
        return -super().quadratic(q, v)


@wrong("coriolis-term")
class SingleCoriolis(Arm):
    def quadratic(self, q, v):
        both = super().quadratic(q, v)
        squares = sum(super(SingleCoriolis, self).quadratic(q, v * e) for e in np.eye(2))
        return squares + (both - squares) / 2


@wrong("decoupled")
class Decoupled(Arm):
    def matrix(self, q):
        return np.diag(np.diag(super().matrix(q)))

    def energy(self, q, v):
        return v @ super().matrix(q) @ v / 2


@wrong("acceleration-without-bias")
class NoBias(Arm):
    def swing(self, q, v):
        return np.zeros(3)


# Conventions


@wrong("absolute-angles")
class AbsoluteAngles(Arm):
    """Everything is in absolute angles: the states, and the answers."""

    reads = ("parameters",)

    def mass_matrix(self, angles):
        return T.T @ super().mass_matrix(angles @ T.T) @ T

    def velocity_terms(self, angles, speeds):
        return super().velocity_terms(angles @ T.T, speeds @ T.T) @ T

    def gravity_terms(self, angles):
        return super().gravity_terms(angles @ T.T) @ T

    def inverse_dynamics(self, angles, speeds, accelerations):
        rows = (each @ T.T for each in (angles, speeds, accelerations))
        return super().inverse_dynamics(*rows) @ T

    def forward_dynamics(self, angles, speeds, torques):
        S = np.linalg.inv(T)
        # The generalized forces Q of absolute angles are T⁻ᵀ... of joint torques: τ = Sᵀ Q.
        found = super().forward_dynamics(angles @ T.T, speeds @ T.T, torques @ S)
        return found @ S.T

    def kinetic_energy(self, angles, speeds):
        return super().kinetic_energy(angles @ T.T, speeds @ T.T)

    def potential_energy(self, angles):
        return super().potential_energy(angles @ T.T)

    def position(self, angles):
        return super().position(angles @ T.T)

    def velocity(self, angles, speeds):
        return super().velocity(angles @ T.T, speeds @ T.T)

    def acceleration(self, angles, speeds, accelerations):
        return super().acceleration(*(each @ T.T for each in (angles, speeds, accelerations)))

    def jacobian(self, angles):
        return super().jacobian(angles @ T.T) @ T


@wrong("absolute-answers")
class AbsoluteAnswers(Arm):
    def mass_matrix(self, angles):
        return T.T @ super().mass_matrix(angles) @ T

    def gravity_terms(self, angles):
        return super().gravity_terms(angles) @ T

    def velocity_terms(self, angles, speeds):
        return super().velocity_terms(angles, speeds) @ T


@wrong("absolute-speeds")
class AbsoluteSpeeds(Arm):
    def velocity_terms(self, angles, speeds):
        return super().velocity_terms(angles, speeds @ T.T)

    def kinetic_energy(self, angles, speeds):
        return super().kinetic_energy(angles, speeds @ T.T)

    def velocity(self, angles, speeds):
        return super().velocity(angles, speeds @ T.T)


@wrong("degrees-in")
class DegreesIn(Arm):
    def poses(self, q):
        return super().poses(np.radians(q))


@wrong("degrees-out")
class DegreesOut(Arm):
    def forward(self, q, v, tau):
        return np.degrees(super().forward(q, v, tau))


@wrong("joints-exchanged")
class JointsExchanged(Arm):
    """The elbow is the first joint of states and answers."""

    def mass_matrix(self, angles):
        return super().mass_matrix(angles[:, ::-1])[:, ::-1, ::-1]

    def velocity_terms(self, angles, speeds):
        return super().velocity_terms(angles[:, ::-1], speeds[:, ::-1])[:, ::-1]

    def gravity_terms(self, angles):
        return super().gravity_terms(angles[:, ::-1])[:, ::-1]

    def inverse_dynamics(self, *rows):
        return super().inverse_dynamics(*(each[:, ::-1] for each in rows))[:, ::-1]

    def forward_dynamics(self, *rows):
        return super().forward_dynamics(*(each[:, ::-1] for each in rows))[:, ::-1]

    def position(self, angles):
        return super().position(angles[:, ::-1])

    def jacobian(self, angles):
        return super().jacobian(angles[:, ::-1])[:, :, ::-1]


@wrong("gravity-in-velocity-terms")
class BiasForce(Arm):
    def velocity_terms(self, angles, speeds):
        return super().velocity_terms(angles, speeds) + self.gravity_terms(angles)


# Layout, factors and numbers


@wrong("factor-half")
class Half(Arm):
    def kinetic_energy(self, angles, speeds):
        return super().kinetic_energy(angles, speeds) / 2


@wrong("factor-two")
class NoHalf(Arm):
    def energy(self, q, v):
        return v @ self.matrix(q) @ v


@wrong("upper-triangle")
class Upper(Arm):
    def mass_matrix(self, angles):
        return np.triu(super().mass_matrix(angles))


@wrong("lower-triangle")
class Lower(Arm):
    def mass_matrix(self, angles):
        return np.tril(super().mass_matrix(angles))


@wrong("inverted-mass-matrix")
class Inverted(Arm):
    def mass_matrix(self, angles):
        return np.linalg.inv(super().mass_matrix(angles))


@wrong("transposed-jacobian")
class Transposed(Arm):
    reads = ("parameters",)

    def jacobian(self, angles):
        return super().jacobian(angles).transpose(0, 2, 1)


@wrong("negated")
class Negated(Arm):
    def velocity_terms(self, angles, speeds):
        return -super().velocity_terms(angles, speeds)


@wrong("y-upward")
class Upward(Arm):
    reads = ("parameters",)

    def vectors(self, values):
        values = super().vectors(values).copy()
        values[:, 1] *= -1
        return values


@wrong("binary32")
class Single(Arm):
    """Numbers of binary32 from a model of binary32."""

    def rows(self, function, *inputs):
        rounded = [np.float32(rows).astype(float) for rows in inputs]
        return np.float32(super().rows(function, *rounded)).astype(float)
