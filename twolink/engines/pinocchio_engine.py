"""Pinocchio: CRBA, RNEA, ABA and their derivatives, on the URDF without changes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from twolink.engines.protocol import Array, Sizes
from twolink.errors import EngineError
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


class Pinocchio:
    """Pinocchio with a chain's URDF loaded; see `twolink.engines.Engine` for shapes and units.

    Joints are `revolute` (one configuration number) or `continuous` (cosine and sine). Raises
    `EngineError` when Pinocchio is missing or rejects the file.
    """

    roundings = _ROUNDINGS
    contact_roundings = _CONTACT_ROUNDINGS

    def __init__(self, urdf: PlanarUrdf) -> None:
        """Load the same text as the URDF reader."""
        try:
            import pinocchio
        except ImportError as error:
            raise EngineError(
                "Pinocchio is not installed; install version 4 or later with pip install 'pin>=4'"
            ) from error
        self._pin: Any = pinocchio
        self._urdf = urdf
        try:
            self._model = pinocchio.buildModelFromXML(urdf.xml)
        except (ValueError, RuntimeError) as error:
            raise EngineError(f"{urdf.path}: Pinocchio rejects the file: {error}") from error
        self._joints = [self._model.getJointId(name) for name in urdf.joint_names]
        self._frames = {
            "C1": self._add_frame("C1", 0, self._inertia(0).lever),
            "C2": self._add_frame("C2", 1, self._inertia(1).lever),
            "D": self._add_frame("D", 1, np.array(urdf.tip_position)),
        }
        self._model.gravity.linear = urdf.gravity * np.array(urdf.axes[1])
        self._data = self._model.createData()
        self._forces = pinocchio.StdVec_Force()
        self._forces.extend([pinocchio.Force.Zero()] * self._model.njoints)
        # x and y of the chain's frame as rows, for vectors in Pinocchio's world frame.
        self._plane = np.array(urdf.axes[:2])
        self._origin = np.array(urdf.origin)

    @property
    def name(self) -> str:
        """The engine's name and version."""
        return f"Pinocchio {self._pin.__version__}"

    @property
    def model(self) -> Any:
        """Pinocchio's own model, with frames for C1, C2 and D added."""
        return self._model

    @property
    def sizes(self) -> Sizes:
        """Spatial levers and inertias, including parts without effect in the plane."""
        first, second = self._inertia(0), self._inertia(1)
        return Sizes(
            radius=(_norm(first.lever), _norm(second.lever)),
            length=_norm(self._model.jointPlacements[self._joints[1]].translation),
            inertia=(_norm(first.inertia), _norm(second.inertia)),
            tip=_norm(self._urdf.tip_position),
            origin=_norm(self._origin),
        )

    def mass_matrix(self, angles: Array) -> Array:
        """Return `crba`."""
        crba, model, data = self._pin.crba, self._model, self._data
        return _each((2, 2), lambda q: crba(model, data, q), self._configurations(angles))

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """Return `nonLinearEffects` of the chain without gravity."""
        effects, data = self._pin.nonLinearEffects, self._data
        weightless = self._model.copy()
        weightless.gravity.linear = np.zeros(3)
        return _each(
            (2,),
            lambda q, v: effects(weightless, data, q, v),
            self._configurations(angles),
            _rows(speeds),
        )

    def coriolis_matrix(self, angles: Array, speeds: Array) -> Array:
        """Return `computeCoriolisMatrix`."""
        coriolis, model, data = self._pin.computeCoriolisMatrix, self._model, self._data
        return _each(
            (2, 2),
            lambda q, v: coriolis(model, data, q, v),
            self._configurations(angles),
            _rows(speeds),
        )

    def gravity_terms(self, angles: Array) -> Array:
        """Return `computeGeneralizedGravity`."""
        gravity, model, data = self._pin.computeGeneralizedGravity, self._model, self._data
        return _each((2,), lambda q: gravity(model, data, q), self._configurations(angles))

    def inverse_dynamics(
        self, angles: Array, speeds: Array, accelerations: Array, end_force: Array | None = None
    ) -> Array:
        """Return `rnea`, with the force on D, if any, as `fext`."""
        rnea, model, data = self._pin.rnea, self._model, self._data
        motion = (self._configurations(angles), _rows(speeds), _rows(accelerations))
        if end_force is None:
            return _each((2,), lambda q, v, a: rnea(model, data, q, v, a), *motion)

        def with_force(q: Array, v: Array, a: Array, force: Array) -> Array:
            return rnea(model, data, q, v, a, self._external_forces(q, force))

        return _each((2,), with_force, *motion, _rows(end_force))

    def forward_dynamics(
        self, angles: Array, speeds: Array, torques: Array, end_force: Array | None = None
    ) -> Array:
        """Return `aba`, with the force on D, if any, as `fext`."""
        aba, model, data = self._pin.aba, self._model, self._data
        state = (self._configurations(angles), _rows(speeds), _rows(torques))
        if end_force is None:
            return _each((2,), lambda q, v, tau: aba(model, data, q, v, tau), *state)

        def with_force(q: Array, v: Array, tau: Array, force: Array) -> Array:
            return aba(model, data, q, v, tau, self._external_forces(q, force))

        return _each((2,), with_force, *state, _rows(end_force))

    def impact(self, angles: Array, speeds: Array, directions: Array, restitution: Array) -> Array:
        """Return `impulseDynamics` with the mass matrix of `crba`."""
        pin, model, data = self._pin, self._model, self._data

        def struck(q: Array, v: Array, jacobian: Array, e: float) -> Array:
            pin.crba(model, data, q)
            after = pin.impulseDynamics(model, data, v, jacobian, e, 0.0)
            return np.concatenate([data.impulse_c, after])

        return _each(
            (len(directions) + 2,),
            struck,
            self._configurations(angles),
            _rows(speeds),
            self._jacobians_along(directions, angles),
            restitution,
        )

    def held(self, angles: Array, speeds: Array, torques: Array, directions: Array) -> Array:
        """Return `forwardDynamics` with Jacobian and drift, `crba` and `nonLinearEffects`.

        The newer `constraintDynamics` constrains whole points or frames, not single rows. One of
        a point's three rows is zero in the plane, which it could solve only by iteration.
        """
        pin, model, data = self._pin, self._model, self._data
        _, _, drift = self.point_motion("D", angles, speeds, np.zeros_like(speeds))

        def constrained(q: Array, v: Array, tau: Array, jacobian: Array, gamma: Array) -> Array:
            pin.crba(model, data, q)
            pin.nonLinearEffects(model, data, q, v)
            accelerations = pin.forwardDynamics(model, data, tau, jacobian, gamma, 0.0)
            return np.concatenate([data.lambda_c, accelerations])

        return _each(
            (len(directions) + 2,),
            constrained,
            self._configurations(angles),
            _rows(speeds),
            _rows(torques),
            self._jacobians_along(directions, angles),
            _rows(np.einsum("kpn,pn->kn", directions, drift)),
        )

    def inverse_dynamics_derivatives(
        self, angles: Array, speeds: Array, accelerations: Array
    ) -> Array:
        """Return `computeRNEADerivatives`: by angles and by speeds."""
        derivatives, model, data = self._pin.computeRNEADerivatives, self._model, self._data
        return _each(
            (2, 2, 2),
            lambda q, v, a: derivatives(model, data, q, v, a)[:2],
            self._configurations(angles),
            _rows(speeds),
            _rows(accelerations),
        )

    def forward_dynamics_derivatives(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return `computeABADerivatives`: by angles, by speeds and by torques."""
        derivatives, model, data = self._pin.computeABADerivatives, self._model, self._data
        return _each(
            (3, 2, 2),
            lambda q, v, tau: derivatives(model, data, q, v, tau),
            self._configurations(angles),
            _rows(speeds),
            _rows(torques),
        )

    def kinetic_energy(self, angles: Array, speeds: Array) -> Array:
        """Return `computeKineticEnergy`."""
        energy, model, data = self._pin.computeKineticEnergy, self._model, self._data
        return _each(
            (), lambda q, v: energy(model, data, q, v), self._configurations(angles), _rows(speeds)
        )

    def potential_energy(self, angles: Array) -> Array:
        """Return `computePotentialEnergy` minus its value with both mass centres at A."""
        energy, model, data = self._pin.computePotentialEnergy, self._model, self._data
        mass = self._inertia(0).mass + self._inertia(1).mass
        at_A = -mass * float(self._model.gravity.linear @ self._origin)
        return _each((), lambda q: energy(model, data, q), self._configurations(angles)) - at_A

    def point_motion(self, point: str, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return a frame's placement, velocity and classical acceleration."""
        pin, model, data, frame = self._pin, self._model, self._data, self._frames[point]
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

        def motion(q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
            pin.forwardKinematics(model, data, q, v, a)
            placement = pin.updateFramePlacement(model, data, frame)
            return (
                placement.translation - self._origin,
                pin.getFrameVelocity(model, data, frame, aligned).linear,
                pin.getFrameClassicalAcceleration(model, data, frame, aligned).linear,
            )

        rows = (self._configurations(angles), _rows(speeds), _rows(accelerations))
        return np.einsum("pw,mwn->mpn", self._plane, _each((3, 3), motion, *rows))

    def angular_motion(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return the angular parts of `getVelocity` and `getAcceleration`."""
        pin, model, data = self._pin, self._model, self._data
        world = pin.ReferenceFrame.WORLD
        z = np.array(self._urdf.axes[2])

        def motion(q: Array, v: Array, a: Array) -> list[list[float]]:
            pin.forwardKinematics(model, data, q, v, a)
            return [
                [get(model, data, joint, world).angular @ z for joint in self._joints]
                for get in (pin.getVelocity, pin.getAcceleration)
            ]

        rows = (self._configurations(angles), _rows(speeds), _rows(accelerations))
        return _each((2, 2), motion, *rows)

    def jacobian(self, point: str, angles: Array) -> Array:
        """Return the linear part of `computeFrameJacobian`."""
        pin, model, data, frame = self._pin, self._model, self._data, self._frames[point]
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        jacobians = _each(
            (3, 2),
            lambda q: pin.computeFrameJacobian(model, data, q, frame, aligned)[:3],
            self._configurations(angles),
        )
        return np.einsum("pw,wcn->pcn", self._plane, jacobians)

    def _jacobians_along(self, directions: Array, angles: Array) -> Array:
        """Return the rows of D's Jacobian along directions, state by state: shape (n, k, 2)."""
        rows = np.einsum("kpn,pcn->nkc", directions, self.jacobian("D", angles))
        return np.ascontiguousarray(rows)

    def _inertia(self, link: int) -> Any:
        return self._model.inertias[self._joints[link]]

    def _add_frame(self, name: str, link: int, position: Array) -> int:
        """Add a frame at a position (m) in the frame of a moving joint, and return its index."""
        pin = self._pin
        placement = pin.SE3(np.eye(3), position)
        frame = pin.Frame(
            f"twolink {name}", self._joints[link], 0, placement, pin.FrameType.OP_FRAME
        )
        return int(self._model.addFrame(frame))

    def _configurations(self, angles: Array) -> Array:
        """Return Pinocchio's configurations as rows: angles, or cosines and sines of them."""
        rows = np.empty((angles.shape[1], self._model.nq))
        for joint, angle in zip(self._joints, angles, strict=True):
            start, width = self._model.idx_qs[joint], self._model.nqs[joint]
            numbers = [angle] if width == 1 else [np.cos(angle), np.sin(angle)]
            rows[:, start : start + width] = np.stack(numbers, axis=1)
        return rows

    def _external_forces(self, configuration: Array, end_force: Array) -> Any:
        """Return `fext`: the force on D, moved to the frame of the second joint."""
        pin, joint = self._pin, self._joints[1]
        pin.forwardKinematics(self._model, self._data, configuration)
        turned = self._data.oMi[joint].rotation.T @ (self._plane.T @ end_force)
        at_D = pin.Force(turned, np.zeros(3))
        self._forces[joint] = self._model.frames[self._frames["D"]].placement.act(at_D)
        return self._forces


def _each(shape: tuple[int, ...], function: Callable[..., Any], *columns: Array) -> Array:
    """Return a function's values for each row, with the rows along the last axis."""
    values = np.empty((len(columns[0]), *shape))
    rows: Iterator[tuple[Array, ...]] = zip(*columns, strict=True)
    for index, row in enumerate(rows):
        values[index] = function(*row)
    return np.moveaxis(values, 0, -1)


def _rows(columns: Array) -> Array:
    """Return states as contiguous rows, the cheapest layout for Pinocchio's bindings."""
    return np.ascontiguousarray(columns.T)


def _norm(vector: Any) -> float:
    return float(np.linalg.norm(np.asarray(vector)))
