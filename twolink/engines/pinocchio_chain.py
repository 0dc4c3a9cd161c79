"""Pinocchio with a chain's URDF, in the chain's frame: dynamics, derivatives and constraints."""

from __future__ import annotations

from typing import Any

import numpy as np

from twolink.engines.chain_engine import ChainEngine, Sizes, columns, in_plane
from twolink.engines.contract import Array
from twolink.engines.pinocchio_engine import PinocchioEngine
from twolink.urdf import PlanarUrdf

# The path through RNEA, joint by joint: sine or cosine into the placement (6), the velocity turned
# and shifted to the next joint (9), the acceleration likewise with its product of speeds (14), the
# momentum (8) and the force (10), and the force turned and shifted back (11). That is 58 a joint,
# and two joints; CRBA and ABA have shorter or like paths.
_ROUNDINGS = 2 * 58

# From there through a contact: a Jacobian's row along a direction (8), or the factors U D Uᵀ of M
# (5); then both into J M⁻¹ Jᵀ (6) and its Cholesky factor (5), the solution for the force by two
# triangles (7), and for the motion by U, D and Uᵀ with the free motion added (8).
_CONTACT_ROUNDINGS = _ROUNDINGS + 8 + 6 + 5 + 7 + 8

# Pinocchio's reader takes an axis that is this close (rad) to one of its frame's for this one.
_SNAPPED = 1e-12


class PinocchioChain(ChainEngine):
    """Pinocchio with a chain's URDF loaded; see `ChainEngine` for shapes and units.

    Points are named C1, C2 and D. Raises `EngineError` when Pinocchio is missing or rejects the
    file.
    """

    roundings, contact_roundings = _ROUNDINGS, _CONTACT_ROUNDINGS

    def __init__(self, urdf: PlanarUrdf) -> None:
        """Load the URDF, and add frames for the points."""
        self._pinocchio = engine = PinocchioEngine()
        super().__init__(urdf, engine)
        self._urdf = urdf
        self.model.gravity.linear = self._gravity_in_plane()
        self._frames = {
            "C1": engine.add_frame("twolink C1", 0, engine.inertia(0).lever),
            "C2": engine.add_frame("twolink C2", 1, engine.inertia(1).lever),
            "D": engine.add_frame("twolink D", 1, np.array(urdf.tip_position)),
        }
        engine.ready()

    @property
    def model(self) -> Any:
        """Pinocchio's own model, with frames for C1, C2 and D added."""
        return self._pinocchio.robot

    @property
    def sizes(self) -> Sizes:
        """Spatial levers and inertias, including parts without effect in the plane."""
        engine = self._pinocchio
        first, second = engine.inertia(0), engine.inertia(1)
        return Sizes(
            radius=(_norm(first.lever), _norm(second.lever)),
            length=_norm(self.model.jointPlacements[engine.joints[1]].translation),
            inertia=(_norm(first.inertia), _norm(second.inertia)),
            tip=_norm(self._urdf.tip_position),
            origin=_norm(self._origin),
        )

    def _gravity_in_plane(self) -> Array:
        """Return gravity in the plane normal to Pinocchio's own first axis, in the world (m/s²).

        Tolerances are relative to gravity in the plane, and this difference has the round-off of
        the whole vector and of the axis. So within it the reader's vector stands for Pinocchio's.
        """
        read = self._urdf.gravity * np.array(self._urdf.axes[1])
        whole, axis = np.array(self._urdf.world_gravity), self._pinocchio.axis_in_world(0)
        found = whole - axis * (axis @ whole)
        return found if _norm(found - read) > _SNAPPED * _norm(whole) else read

    def coriolis_matrix(self, angles: Array, speeds: Array) -> Array:
        """Return C (kg m²/s), shape (2, 2, n), by `computeCoriolisMatrix`."""
        return columns(self._pinocchio.coriolis_matrix(angles.T, speeds.T))

    def inverse_dynamics(
        self, angles: Array, speeds: Array, accelerations: Array, end_force: Array | None = None
    ) -> Array:
        """Return `rnea`, with the force on D, if any, as `fext`."""
        forces = self._external_forces(angles, end_force)
        found = self._pinocchio.inverse_dynamics(angles.T, speeds.T, accelerations.T, *forces)
        return columns(found)

    def forward_dynamics(
        self, angles: Array, speeds: Array, torques: Array, end_force: Array | None = None
    ) -> Array:
        """Return `aba`, with the force on D, if any, as `fext`."""
        forces = self._external_forces(angles, end_force)
        return columns(self._pinocchio.forward_dynamics(angles.T, speeds.T, torques.T, *forces))

    def impact(self, angles: Array, speeds: Array, directions: Array, restitution: Array) -> Array:
        """Return `impulseDynamics` with the mass matrix of `crba`."""
        pin = self._pinocchio.pin

        def struck(robot: Any, data: Any, q: Array, v: Array, jacobian: Array, e: float) -> Array:
            pin.crba(robot, data, q)
            after = pin.impulseDynamics(robot, data, v, jacobian, e, 0.0)
            return np.concatenate([data.impulse_c, after])

        rows = (angles.T, speeds.T, self._jacobians_along(directions, angles), restitution)
        return columns(self._pinocchio.each((len(directions) + 2,), struck, *rows))

    def held(self, angles: Array, speeds: Array, torques: Array, directions: Array) -> Array:
        """Return `forwardDynamics` with Jacobian and drift, `crba` and `nonLinearEffects`.

        The newer `constraintDynamics` constrains whole points or frames, not single rows. One of
        a point's three rows is zero in the plane, which it could solve only by iteration.
        """
        pin = self._pinocchio.pin
        _, _, drift = self.point_motion("D", angles, speeds, np.zeros_like(speeds))

        def constrained(
            robot: Any, data: Any, q: Array, v: Array, tau: Array, jacobian: Array, gamma: Array
        ) -> Array:
            pin.crba(robot, data, q)
            pin.nonLinearEffects(robot, data, q, v)
            accelerations = pin.forwardDynamics(robot, data, tau, jacobian, gamma, 0.0)
            return np.concatenate([data.lambda_c, accelerations])

        along = self._jacobians_along(directions, angles)
        rows = (angles.T, speeds.T, torques.T, along, np.einsum("kpn,pn->nk", directions, drift))
        return columns(self._pinocchio.each((len(directions) + 2,), constrained, *rows))

    def inverse_dynamics_derivatives(
        self, angles: Array, speeds: Array, accelerations: Array
    ) -> Array:
        """Return `computeRNEADerivatives`: by angles and by speeds."""
        derivatives = self._pinocchio.pin.computeRNEADerivatives
        rows = (angles.T, speeds.T, accelerations.T)
        return columns(self._pinocchio.each((2, 2, 2), lambda *x: derivatives(*x)[:2], *rows))

    def forward_dynamics_derivatives(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return `computeABADerivatives`: by angles, by speeds and by torques."""
        derivatives = self._pinocchio.pin.computeABADerivatives
        return columns(self._pinocchio.each((3, 2, 2), derivatives, angles.T, speeds.T, torques.T))

    def _zero(self) -> float:
        mass = self._pinocchio.inertia(0).mass + self._pinocchio.inertia(1).mass
        return -mass * float(self.model.gravity.linear @ self._origin)

    def point_motion(self, point: str, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return a frame's placement, velocity and classical acceleration."""
        rows = (angles.T, speeds.T, accelerations.T)
        found = self._pinocchio.motion(self._frames[point], *rows)
        found[:, 0] -= self._origin
        return np.einsum("pw,nmw->mpn", self._plane, found)

    def angular_motion(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return the angular parts of `getVelocity` and `getAcceleration`."""
        pin, joints = self._pinocchio.pin, self._pinocchio.joints
        world = pin.ReferenceFrame.WORLD
        z = np.array(self._urdf.axes[2])

        def motion(robot: Any, data: Any, q: Array, v: Array, a: Array) -> list[list[float]]:
            pin.forwardKinematics(robot, data, q, v, a)
            return [
                [get(robot, data, joint, world).angular @ z for joint in joints]
                for get in (pin.getVelocity, pin.getAcceleration)
            ]

        rows = (angles.T, speeds.T, accelerations.T)
        return columns(self._pinocchio.each((2, 2), motion, *rows))

    def jacobian(self, point: str, angles: Array) -> Array:
        """Return the linear part of `computeFrameJacobian`."""
        found = self._pinocchio.frame_jacobian(self._frames[point], angles.T)
        return columns(in_plane(found, self._plane))

    def _jacobians_along(self, directions: Array, angles: Array) -> Array:
        """Return the rows of D's Jacobian along directions, state by state: shape (n, k, 2)."""
        return np.einsum("kpn,pcn->nkc", directions, self.jacobian("D", angles))

    def _external_forces(self, angles: Array, end_force: Array | None) -> tuple[list[Any], ...]:
        """Return `fext` of each state: the force on D, moved to the frame of the second joint."""
        if end_force is None:
            return ()
        pin, robot, data = self._pinocchio.pin, self.model, self._pinocchio.data
        joint = self._pinocchio.joints[1]
        placement = robot.frames[self._frames["D"]].placement
        found = []
        for q, force in zip(self._pinocchio.configurations(angles.T), end_force.T, strict=True):
            pin.forwardKinematics(robot, data, q)
            turned = data.oMi[joint].rotation.T @ (self._plane.T @ force)
            forces = pin.StdVec_Force()
            forces.extend([pin.Force.Zero()] * robot.njoints)
            forces[joint] = placement.act(pin.Force(turned, np.zeros(3)))
            found.append(forces)
        return (found,)


def _norm(vector: Any) -> float:
    return float(np.linalg.norm(np.asarray(vector)))
