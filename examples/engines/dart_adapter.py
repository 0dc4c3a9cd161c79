"""DART, by `dartpy`: URDF, CRBA, RNEA, ABA, and `World.step`.

Traps: `DartLoader` gives the root link a free joint (8 degrees of freedom instead of 2) unless the
default root joint is set to FIXED. Forward dynamics treats joint damping implicitly: its inertia is
M + dt D, so that accelerations depend on the time step, which is 1e-18 s here. Coulomb friction in
joints acts in `World.step` alone, as a constraint.
"""

from __future__ import annotations

from typing import Any

import dartpy
import numpy as np
from adapter import Array, Engine, Model, RefusedError, each, serve, springs_of, stepped

_INSTANT = 1e-18


class Dart(Engine):
    """DART."""

    name, package = "DART", "dartpy"
    effects = ("joint_damping", "joint_spring")
    methods = ({"name": "World.step", "order": 1.0, "parameter": "step"},)
    issues = "https://github.com/dartsim/dart/issues"

    def load(self, model: Model) -> dict[str, Any]:
        """Read the URDF by `parseSkeletonString`."""
        options = dartpy.utils.DartLoaderOptions()
        options.mDefaultRootJointType = dartpy.utils.DartLoaderRootJointType.FIXED
        options.mDefaultInertia = dartpy.dynamics.Inertia(0.0, np.zeros(3), np.zeros((3, 3)))
        loader = dartpy.utils.DartLoader()
        loader.setOptions(options)
        self.robot = loader.parseSkeletonString(model.urdf, dartpy.common.Uri(""))
        if self.robot is None:
            raise RefusedError("parseSkeletonString returns nothing")
        joints = [self.robot.getJoint(name) for name in model.joints]
        if self.robot.getNumDofs() != 2 or None in joints:
            raise RefusedError(f"{self.robot.getNumDofs()} degrees of freedom")
        self.order = [joint.getIndexInSkeleton(0) for joint in joints]
        for name, stiffness, rest in springs_of(model):
            self.robot.getJoint(name).setSpringStiffness(0, stiffness)
            self.robot.getJoint(name).setRestPosition(0, rest)
        self.robot.setGravity(model.gravity)
        self.robot.setTimeStep(_INSTANT)
        self.gravity, self.tip = model.gravity, self.robot.getBodyNode(model.tip)
        dofs = [self.robot.getDof(index) for index in self.order]
        limits = [dof.getPositionLimits() for dof in dofs]
        return {
            "damping": [dof.getDampingCoefficient() for dof in dofs],
            "friction": [joint.getCoulombFriction(0) for joint in joints],
            "limits": [list(pair) if np.isfinite(pair).all() else None for pair in limits],
        }

    def _at(self, q: Array, *rates: Array) -> dartpy.dynamics.Skeleton:
        for name, row in zip(
            ("Positions", "Velocities", "Accelerations"), (q, *rates), strict=False
        ):
            getattr(self.robot, f"set{name}")(row[np.argsort(self.order)])
        return self.robot

    def mass_matrix(self, angles: Array) -> Array:
        """`getMassMatrix`."""
        M = each(lambda q: self._at(q).getMassMatrix(), angles)
        return M[:, self.order][:, :, self.order]

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """`getCoriolisForces`."""
        return each(lambda *s: self._at(*s).getCoriolisForces(), angles, speeds)[:, self.order]

    def gravity_terms(self, angles: Array) -> Array:
        """`getGravityForces`."""
        return each(lambda q: self._at(q).getGravityForces(), angles)[:, self.order]

    def inverse_dynamics(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """`computeInverseDynamics`."""

        def torques(*state: Array) -> Array:
            self._at(*state).computeInverseDynamics()
            return self.robot.getForces()[self.order]

        return each(torques, angles, speeds, accelerations)

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """`computeForwardDynamics`."""

        def accelerations(q: Array, v: Array, torque: Array) -> Array:
            self._at(q, v).setForces(torque[np.argsort(self.order)])
            self.robot.computeForwardDynamics()
            return self.robot.getAccelerations()[self.order]

        return each(accelerations, angles, speeds, torques)

    def kinetic_energy(self, angles: Array, speeds: Array) -> Array:
        """`computeKineticEnergy`."""
        return each(lambda *s: self._at(*s).computeKineticEnergy(), angles, speeds)

    def potential_energy(self, angles: Array) -> Array:
        """`computePotentialEnergy`."""
        return each(lambda q: self._at(q).computePotentialEnergy(), angles)

    def position(self, angles: Array) -> Array:
        """The tip's transform."""
        return each(lambda q: self._at(q) and self.tip.getWorldTransform().translation(), angles)

    def velocity(self, angles: Array, speeds: Array) -> Array:
        """`getLinearVelocity`."""
        return each(lambda *s: self._at(*s) and self.tip.getLinearVelocity(), angles, speeds)

    def acceleration(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """`getLinearAcceleration`."""
        rows = angles, speeds, accelerations
        return each(lambda *s: self._at(*s) and self.tip.getLinearAcceleration(), *rows)

    def jacobian(self, angles: Array) -> Array:
        """`getLinearJacobian`."""
        rows = each(lambda q: self._at(q).getLinearJacobian(self.tip), angles)
        return rows[:, :, self.order]

    def move(
        self, angles: Array, speeds: Array, method: str, parameter: float, times: list[float]
    ) -> tuple[Array, Array]:
        """`World.step`."""
        world = dartpy.simulation.World()
        world.setGravity(self.gravity)
        world.addSkeleton(self._at(angles, speeds))
        self.robot.resetGeneralizedForces()
        found = [(angles, speeds)]
        for step, count in stepped(times, parameter):
            world.setTimeStep(step)
            for _ in range(count):
                world.step()
            found.append(
                (self.robot.getPositions()[self.order], self.robot.getVelocities()[self.order])
            )
        world.removeSkeleton(self.robot)
        self.robot.setGravity(self.gravity)
        self.robot.setTimeStep(_INSTANT)
        return tuple(np.array(rows) for rows in zip(*found, strict=True))


if __name__ == "__main__":
    serve(Dart)
