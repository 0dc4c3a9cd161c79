"""Siconos, by Debian's `python3-siconos`: bodies with six coordinates, `PivotJointR`, Moreau-Jean.

Traps: there is no URDF reader and no call for M, so that motions alone are compared. Positions and
speeds of the bodies must agree with the joints at the start, so that objects are made anew for each
motion. Dampers and springs are no elements of Siconos: the adapter applies their torques at the
begin of each step, as a caller does. Joints are constraints on speeds, and positions drift off them
with the step. Restitution is Newton's, and friction has one coefficient for sticking and sliding.
BLAS is slower with threads.
"""

from __future__ import annotations

import math
import os
import subprocess
import warnings
from fractions import Fraction

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
import siconos.kernel as sk
import siconos.numerics as sn
from adapter import Array, CannotError, Engine, Model, parameters_of, serve
from siconos.mechanics.joints import JointStopR, PivotJointR

_AXIS = np.array([0.0, 1.0, 0.0])


def _package_version() -> str:
    query = ("dpkg-query", "--show", "--showformat=${Version}", "python3-siconos")
    return subprocess.run(query, check=True, capture_output=True, text=True).stdout


class Siconos(Engine):
    """Siconos."""

    # Siconos' own `siconos.version` says 4.5.0 in the package of 4.4.0.
    name, version = "Siconos", _package_version()
    reads = ("parameters",)
    effects = ("joint_damping", "joint_spring", "joint_stop", "surface")
    methods = ({"name": "MoreauJean", "order": 1.0, "parameter": "step"},)
    issues = "https://github.com/siconos/siconos/issues"

    def load(self, model: Model) -> None:
        """Keep the parameters."""
        self.given = parameters_of(model)

    def move(
        self, angles: Array, speeds: Array, method: str, parameter: float, times: list[float]
    ) -> tuple[Array, Array]:
        """`TimeStepping.computeOneStep`."""
        surfaces = self.given.get("surfaces") or ()
        if any(surface.get("static") not in (None, surface["friction"]) for surface in surfaces):
            raise CannotError("friction has one coefficient, for sticking and for sliding")
        if any(surface.get("friction") for surface in surfaces):
            warnings.warn("restitution with friction is Newton's", stacklevel=1)
        step, counts = _even(times, parameter)
        self._build(angles, speeds)
        problem = sk.GenericMechanical()
        problem.numericsSolverOptions().dparam[sn.SICONOS_DPARAM_TOL] = 1e-10
        simulation = sk.TimeStepping(
            self.system,
            sk.TimeDiscretisation(times[0], step),
            sk.MoreauJeanOSI(0.5),
            problem,
        )
        simulation.setNewtonTolerance(1e-10)
        state, found = (angles, speeds), [(angles, speeds)]
        for count in counts:
            for _ in range(count):
                self._apply(*state)
                simulation.computeOneStep()
                simulation.nextStep()
                state = self._state(state[0])
            found.append(state)
        return tuple(np.array(rows) for rows in zip(*found, strict=True))

    def _build(self, angles: Array, speeds: Array) -> None:
        """Make bodies on joints, with stops and contacts, at the start of a motion."""
        given, heading, turning = self.given, np.cumsum(angles), np.cumsum(speeds)
        self.system = sk.NonSmoothDynamicalSystem(0.0, 1e9)
        self.bodies, self.kept, root, moving = [], [], np.zeros(3), np.zeros(3)
        for number, half in enumerate(heading / 2):
            mass, spin = given["mass"][number], turning[number] * _AXIS
            arm = _turned(heading[number], given["centre"][number])
            body = sk.NewtonEulerDS(
                [*(root + arm), np.cos(half), 0.0, np.sin(half), 0.0],
                [*(moving + np.cross(spin, arm)), *spin],
                mass,
                given["inertia"][number] * np.eye(3),
            )
            body.setFExtPtr(np.array([0.0, 0.0, -mass * given["gravity"]]))
            self.system.insertDynamicalSystem(body)
            self.bodies.append(body)
            joint = PivotJointR(root, _AXIS, True, *self.bodies)
            self._link(joint, sk.EqualityConditionNSL(5), *self.bodies)
            for stop in given.get("stops") or ():
                for bound, upper in ((stop.get("lower"), False), (stop.get("upper"), True)):
                    if stop["joint"] == number + 1 and bound is not None:
                        # The angle is that of the second body, which is the ground at the shoulder.
                        sign = 1 if number else -1
                        place, above = sign * (bound - angles[number]), upper == (sign > 0)
                        law = sk.NewtonImpactNSL(stop["restitution"])
                        self._link(JointStopR(joint, place, above, 0), law, *self.bodies)
            end = _turned(heading[number], (given["length"][number], 0.0))
            root, moving = root + end, moving + np.cross(spin, end)
        for surface in given.get("surfaces") or ():
            for point in surface["on"]:
                self._touch(surface, 0 if point == "B" else 1)

    def _touch(self, surface: dict, number: int) -> None:
        """Add the contact of the end of a link with a half-plane."""
        mu, e = surface["friction"], surface["restitution"]
        law = sk.NewtonImpactFrictionNSL(e, 0.0, mu, 3) if mu else sk.NewtonImpactNSL(e)
        kind = sk.NewtonEuler3DR if mu else sk.NewtonEuler1DR
        a, b = self.given["centre"][number]
        arm = (self.given["length"][number] - a, -b)
        self._link(_contact(kind, arm, surface), law, self.bodies[number])

    def _link(self, relation: sk.NewtonEulerR, law: sk.NonSmoothLaw, *bodies: sk.NewtonEulerDS):
        self.kept.append((relation, law, sk.Interaction(law, relation)))
        self.system.link(self.kept[-1][-1], *bodies)

    def _apply(self, angles: Array, speeds: Array) -> None:
        """Apply the torques of dampers and springs."""
        stiffness, rest = (np.array(self.given.get(k) or (0, 0)) for k in ("stiffness", "rest"))
        torque = -np.array(self.given["damping"]) * speeds - stiffness * (angles - rest)
        self.moments = [(torque[0] - torque[1]) * _AXIS, torque[1] * _AXIS]
        for body, moment in zip(self.bodies, self.moments, strict=True):
            body.setMExtPtr(moment)

    def _state(self, before: Array) -> tuple[Array, Array]:
        """Return joint angles, continued from those of the step before, and speeds."""
        places = [body.q() for body in self.bodies]
        heading = np.array([2 * np.arctan2(q[5], q[3]) for q in places])
        angles = np.diff(heading, prepend=0.0)
        angles += 2 * np.pi * np.round((before - angles) / (2 * np.pi))
        return angles, np.diff([body.twist()[4] for body in self.bodies], prepend=0.0)


def _even(times: list[float], step: float) -> tuple[float, list[int]]:
    """Return a step of at most `step` (s) that divides all intervals, and the steps of each."""
    instants = [Fraction(time).limit_denominator(10**6) for time in times]
    gaps = np.diff(instants)
    unit = Fraction(
        math.gcd(*(gap.numerator for gap in gaps)), math.lcm(*(gap.denominator for gap in gaps))
    )
    unit /= math.ceil(unit / Fraction(step))
    return float(unit), [int(gap / unit) for gap in gaps]


def _turned(angle: float, place: tuple[float, float]) -> Array:
    """Return a place along and across a link in space, where z points up."""
    (a, b), c, s = place, np.cos(angle), np.sin(angle)
    return np.array([a * c - b * s, 0.0, -a * s - b * c])


def _contact(kind: type, arm: tuple[float, float], surface: dict) -> sk.NewtonEulerR:
    """Return the relation of a half-plane and a point of a body, given from its mass centre."""
    normal, point = (np.array([v[0], 0.0, -v[1]]) for v in (surface["normal"], surface["point"]))

    class Contact(kind):
        def computeh(self, time: float, q: Array, y: Array) -> None:
            at = q[:3] + _turned(2 * np.arctan2(q[5], q[3]), arm)
            y[0] = gap = normal @ (at - point)
            # In place: Siconos holds no reference to an array that it is given (`setpc1`).
            self.pc1()[:] = at
            self.pc2()[:] = at - gap * normal
            self.nc()[:] = normal

    return Contact()


if __name__ == "__main__":
    serve(Siconos)
