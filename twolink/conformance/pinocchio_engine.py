"""Pinocchio under test: its own URDF reader, CRBA, RNEA and ABA."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable
from typing import Any

import numpy as np

from twolink.conformance.contract import Array, Engine, ModelRefusedError
from twolink.conformance.messages import Model, Understood
from twolink.errors import EngineError


class PinocchioEngine(Engine):
    """Pinocchio; each quantity by the algorithm that its documentation names for it."""

    name = "Pinocchio"
    version = importlib.metadata.version("pin")
    issues = "https://github.com/stack-of-tasks/pinocchio/issues"

    def __init__(self) -> None:
        """Import Pinocchio."""
        try:
            import pinocchio
        except ImportError as error:
            raise EngineError(
                "Pinocchio is not installed; install version 4 or later with pip install 'pin>=4'"
            ) from error
        self._pin: Any = pinocchio

    def load(self, model: Model) -> Understood:
        """Read the URDF by `buildModelFromXML`."""
        pin = self._pin
        try:
            self._model = pin.buildModelFromXML(model.urdf)
        except (ValueError, RuntimeError) as error:
            raise ModelRefusedError(str(error)) from error
        names = model.joints or ()
        if self._model.nv != 2 or not all(self._model.existJointName(name) for name in names):
            raise ModelRefusedError(f"{self._model.nv} degrees of freedom")
        self._joints = [self._model.getJointId(name) for name in names]
        self._order = [self._model.idx_vs[joint] for joint in self._joints]
        self._model.gravity.linear = np.array(model.gravity)
        self._data = self._model.createData()
        self._tip = self._model.getFrameId(model.tip)
        return self._understood()

    def mass_matrix(self, angles: Array) -> Array:
        """Return `crba`."""
        M = self._each(lambda q: self._pin.crba(self._model, self._data, q), angles)
        return M[:, self._order][:, :, self._order]

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """Return `nonLinearEffects` without `computeGeneralizedGravity`."""
        weightless = self._model.copy()
        weightless.gravity.linear = np.zeros(3)
        effects = self._pin.nonLinearEffects
        return self._ordered(lambda q, v: effects(weightless, self._data, q, v), angles, speeds)

    def gravity_terms(self, angles: Array) -> Array:
        """Return `computeGeneralizedGravity`."""
        gravity = self._pin.computeGeneralizedGravity
        return self._ordered(lambda q: gravity(self._model, self._data, q), angles)

    def inverse_dynamics(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return `rnea`."""
        rnea = self._pin.rnea
        call = lambda q, v, a: rnea(self._model, self._data, q, v, a)  # noqa: E731
        return self._ordered(call, angles, speeds, accelerations)

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return `aba`."""
        aba = self._pin.aba
        call = lambda q, v, tau: aba(self._model, self._data, q, v, tau)  # noqa: E731
        return self._ordered(call, angles, speeds, torques)

    def kinetic_energy(self, angles: Array, speeds: Array) -> Array:
        """Return `computeKineticEnergy`."""
        energy = self._pin.computeKineticEnergy
        return self._each(lambda q, v: energy(self._model, self._data, q, v), angles, speeds)

    def potential_energy(self, angles: Array) -> Array:
        """Return `computePotentialEnergy`."""
        energy = self._pin.computePotentialEnergy
        return self._each(lambda q: energy(self._model, self._data, q), angles)

    def position(self, angles: Array) -> Array:
        """Return the placement of D."""
        zeros = np.zeros_like(angles)
        return self._motion(angles, zeros, zeros)[:, 0]

    def velocity(self, angles: Array, speeds: Array) -> Array:
        """Return `getFrameVelocity`."""
        return self._motion(angles, speeds, np.zeros_like(angles))[:, 1]

    def acceleration(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return `getFrameClassicalAcceleration`."""
        return self._motion(angles, speeds, accelerations)[:, 2]

    def jacobian(self, angles: Array) -> Array:
        """Return the linear part of `computeFrameJacobian`."""
        pin, aligned = self._pin, self._pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        rows = self._each(
            lambda q: pin.computeFrameJacobian(self._model, self._data, q, self._tip, aligned)[:3],
            angles,
        )
        return rows[:, :, self._order]

    def _motion(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        pin, model, data, tip = self._pin, self._model, self._data, self._tip
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

        def motion(q: Array, v: Array, a: Array) -> list[Array]:
            pin.forwardKinematics(model, data, q, v, a)
            return [
                pin.updateFramePlacement(model, data, tip).translation.copy(),
                pin.getFrameVelocity(model, data, tip, aligned).linear,
                pin.getFrameClassicalAcceleration(model, data, tip, aligned).linear,
            ]

        return self._each(motion, angles, speeds, accelerations)

    def _understood(self) -> Understood:
        inertias = [self._model.inertias[joint] for joint in self._joints]
        axes = [self._axis(joint) for joint in self._joints]
        pairs = list(zip(inertias, axes, strict=True))
        damping, friction = ([x[i] for i in self._order] for x in self._resistance())
        return Understood(
            mass=_pair(inertia.mass for inertia in inertias),
            reach=_pair(np.linalg.norm(np.cross(axis, body.lever)) for body, axis in pairs),
            inertia=_pair(axis @ body.inertia @ axis for body, axis in pairs),
            damping=_pair(damping),
            friction=_pair(friction),
        )

    def _resistance(self) -> tuple[Any, Any]:
        return self._model.damping, self._model.friction

    def _axis(self, joint: int) -> Array:
        """Return the joint's axis in its own frame, from the motion of a unit speed."""
        v = np.zeros(2)
        v[self._model.idx_vs[joint]] = 1.0
        self._pin.forwardKinematics(self._model, self._data, self._pin.neutral(self._model), v)
        return np.array(self._data.v[joint].angular)

    def _ordered(self, function: Callable[..., Any], angles: Array, *rows: Array) -> Array:
        return self._each(function, angles, *rows)[:, self._order]

    def _each(self, function: Callable[..., Any], angles: Array, *rows: Array) -> Array:
        """Return a function's values at each state, with rows in Pinocchio's order of joints."""
        placed = [row[:, np.argsort(self._order)] for row in rows]
        states = zip(self._configurations(angles), *placed, strict=True)
        return np.array([function(*state) for state in states])

    def _configurations(self, angles: Array) -> Array:
        """Return configurations: an angle, or the cosine and sine of a continuous joint's."""
        found = np.empty((len(angles), self._model.nq))
        for joint, angle in zip(self._joints, angles.T, strict=True):
            start, width = self._model.idx_qs[joint], self._model.nqs[joint]
            numbers = [angle] if width == 1 else [np.cos(angle), np.sin(angle)]
            found[:, start : start + width] = np.stack(numbers, axis=1)
        return found


def _pair(numbers: Any) -> tuple[float, float]:
    first, second = (float(number) for number in numbers)
    return first, second
