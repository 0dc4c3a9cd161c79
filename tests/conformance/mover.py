"""Engines that simulate by fixed steps, right and wrong, for chains from parameters."""

import warnings

import numpy as np

from tests.conformance.arm import Arm
from twolink.conformance.contract import CannotError, Engine
from twolink.coordinates import JointConvention
from twolink.engines.messages import Method, Moved
from twolink.engines.scenes import scene_of
from twolink.simulation import simulate


class Mover(Arm):
    """Euler's method and the classical one of order 4, on closed forms."""

    name = "mover"
    reads = ("parameters",)
    methods = (
        Method(name="euler", order=1.0, parameter="step"),
        Method(name="rk4", order=4.0, parameter="step"),
    )
    g_factor = 1.0

    def load(self, model):
        found = super().load(model)
        p = self.chain = model.parameters
        (m1, m2), (L1, _), (I1, I2) = p.mass, p.length, p.inertia
        (a1, b1), (a2, b2) = p.centre
        self.about2 = I2 + m2 * (a2**2 + b2**2)
        self.about1 = I1 + m1 * (a1**2 + b1**2) + m2 * L1**2
        self.weight1 = complex(m1 * a1 + m2 * L1, m1 * b1)
        self.weight2 = m2 * complex(a2, b2)
        self.down = p.gravity * self.g_factor
        return found

    def rates(self, t, x):
        """Return x' of x = (θ1, θ2, θ̇1, θ̇2), with mass centres as complex numbers."""
        angle1, angle2, w1, w2 = x
        turned = self.chain.length[0] * self.weight2 * np.exp(1j * angle2)
        M12, h = self.about2 + turned.real, turned.imag
        M11, M22 = self.about1 + M12 + turned.real, self.about2
        pull2 = self.down * (self.weight2 * np.exp(1j * (angle1 + angle2))).real
        pull1 = self.down * (self.weight1 * np.exp(1j * angle1)).real + pull2
        d1, d2 = self.damping
        r1 = pull1 + h * (2 * w1 + w2) * w2 - d1 * w1
        r2 = pull2 - h * w1 * w1 - d2 * w2
        det = M11 * M22 - M12 * M12
        return np.array([w1, w2, (M22 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det])

    def step(self, method, t, x, h):
        f = self.rates
        if method == "euler":
            return x + h * f(t, x)
        k1 = f(t, x)
        k2 = f(t + h / 2, x + h / 2 * k1)
        k3 = f(t + h / 2, x + h / 2 * k2)
        return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + f(t + h, x + h * k3))

    def move(self, request):
        x = np.array([*request.angles, *request.speeds])
        found = [x]
        for before, after in zip(request.times, request.times[1:], strict=False):
            count = round((after - before) / request.parameter)
            for k in range(count):
                x = self.step(
                    request.method, before + k * request.parameter, x, (after - before) / count
                )
            found.append(x)
        rows = np.array(found).tolist()
        return Moved(
            seq=request.seq,
            angles=tuple((a, b) for a, b, _, _ in rows),
            speeds=tuple((c, d) for _, _, c, d in rows),
        )


class StepTooMany(Mover):
    """It takes one more step than asked for, of the same size."""

    def move(self, request):
        found, size = super().move(request), request.parameter
        rows = [(*a, *u) for a, u in zip(found.angles, found.speeds, strict=True)]
        later = [self.step(request.method, 0.0, np.array(row), size).tolist() for row in rows[1:]]
        rows = [rows[0], *later]
        return found.model_copy(
            update={
                "angles": tuple((a, b) for a, b, _, _ in rows),
                "speeds": tuple((c, d) for _, _, c, d in rows),
            }
        )


class OtherGravity(Mover):
    """Gravity of 9.80665 instead of 9.81."""

    g_factor = 9.80665 / 9.81


class Undamped(Mover):
    def rates(self, t, x):
        kept, self.damping = self.damping, np.zeros(2)
        try:
            return super().rates(t, x)
        finally:
            self.damping = kept


class Noisy(Mover):
    """Each motion has noise of its own."""

    count = 0

    def move(self, request):
        type(self).count += 1
        found = super().move(request)
        noise = 0.01 * (-1) ** self.count
        angles = tuple((a + noise, b) for a, b in found.angles)
        return found.model_copy(update={"angles": angles})


class Exploding(Mover):
    def rates(self, t, x):
        return super().rates(t, x) * np.nan


class Short(Mover):
    def move(self, request):
        found = super().move(request)
        return found.model_copy(update={"angles": found.angles[:1]})


class Ours(Engine):
    """The simulation of this library, by the accuracy asked for."""

    name = "ours"
    reads = ("parameters",)
    effects = ("joint_damping", "joint_friction", "joint_spring", "joint_stop", "surface")
    methods = (Method(name="taylor", parameter="tolerance"),)

    def load(self, model):
        self.given = self.changed(model.parameters)

    def changed(self, given):
        return given

    def move(self, request):
        scene = scene_of(self.given, request.angles, request.speeds, request.times[-1])
        q, u = simulate(scene, accuracy=max(request.parameter, 1e-10)).at(request.times)
        joints = JointConvention()
        angles, speeds = joints.joint_angles(q), joints.joint_speeds(u)
        return Moved(
            seq=request.seq,
            angles=tuple(zip(*(row.tolist() for row in angles), strict=True)),
            speeds=tuple(zip(*(row.tolist() for row in speeds), strict=True)),
        )


class OtherRestitution(Ours):
    """Impacts rebound with 0.9 of their restitution."""

    def changed(self, given):
        def weaker(elements):
            return tuple(
                each.model_copy(update={"restitution": 0.9 * each.restitution})
                for each in elements or ()
            )

        stops, surfaces = weaker(given.stops), weaker(given.surfaces)
        return given.model_copy(update={"stops": stops, "surfaces": surfaces})


class NoStaticFriction(Ours):
    """A sticking joint lets go at its kinetic torque."""

    def changed(self, given):
        return given.model_copy(update={"static_friction": None})


class Unsprung(Ours):
    def changed(self, given):
        return given.model_copy(update={"stiffness": None})


class Warning(OtherRestitution):
    """It says that it has another law."""

    def move(self, request):
        return super().move(request).model_copy(update={"warnings": ("another law",)})


class WarningOnModel(OtherRestitution):
    """It says that it has another law when it reads the model."""

    def load(self, model):
        warnings.warn("another law", stacklevel=1)
        super().load(model)


class Stiff(Mover):
    """Unstable at steps above 4 ms."""

    def step(self, method, t, x, h):
        return super().step(method, t, x, h) * (1.0 if h < 4e-3 else np.nan)


class Stuck(Mover):
    def move(self, request):
        raise RuntimeError("stuck")


class Unable(Mover):
    def move(self, request):
        raise CannotError("only on weekdays")
