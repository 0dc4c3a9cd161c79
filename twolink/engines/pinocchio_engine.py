"""Pinocchio: its own URDF reader, CRBA, RNEA, ABA, their derivatives, and constraints."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from twolink.engines.contract import Array, Engine
from twolink.engines.faults import ModelRefusedError
from twolink.engines.messages import Model, Understood


class PinocchioEngine(Engine):
    """Pinocchio; each quantity by the algorithm that its documentation names for it.

    Joints are `revolute` (one configuration number) or `continuous` (cosine and sine).
    """

    name = "Pinocchio"
    packages = (("pin", "pinocchio"),)
    issues = "https://github.com/stack-of-tasks/pinocchio/issues"

    def load(self, model: Model) -> Understood:
        """Read the URDF by `buildModelFromXML`. Raises `EngineError` when Pinocchio is missing."""
        self.check_installed()
        import pinocchio

        self.pin: Any = pinocchio
        try:
            self.robot = pinocchio.buildModelFromXML(model.urdf)
        except (ValueError, RuntimeError) as error:
            raise ModelRefusedError(str(error)) from error
        names = model.joints or ("", "")
        # The joint before all others is the world; one of the file may have its name, "universe".
        found = {name: index for index, name in enumerate(self.robot.names) if index}
        if self.robot.nv != 2 or not set(names) <= set(found):
            raise ModelRefusedError(f"{self.robot.nv} degrees of freedom")
        self.joints = [found[name] for name in names]
        if self.robot.parents[self.joints[1]] != self.joints[0]:
            raise ModelRefusedError(f"{names[1]} does not follow {names[0]}")
        self.robot.gravity.linear = np.array(model.gravity)
        self.tip = 0 if model.tip is None else self.frame_of(model.tip)
        self.ready()
        return self._understood()

    def ready(self) -> None:
        """Make room for results; needed again after frames were added."""
        self.data = self.robot.createData()

    def frame_of(self, link: str) -> int:
        """Return the index of a link's frame; a joint, and the world, may have the same name."""
        return int(self.robot.getFrameId(link, self.pin.FrameType.BODY))

    def add_frame(self, name: str, link: int, position: Array) -> int:
        """Add a frame at a position (m) in the frame of a moving joint, and return its index."""
        pin = self.pin
        placement = pin.SE3(np.eye(3), position)
        kind = pin.FrameType.OP_FRAME
        return int(self.robot.addFrame(pin.Frame(name, self.joints[link], 0, placement, kind)))

    def inertia(self, link: int) -> Any:
        """Return Pinocchio's inertia of link 0 or 1, with everything that is fixed to it."""
        return self.robot.inertias[self.joints[link]]

    def axis(self, link: int) -> Array:
        """Return a joint's axis in its own frame, from the motion of a unit speed."""
        v = np.zeros(2)
        v[link] = 1.0
        self.pin.forwardKinematics(self.robot, self.data, self.pin.neutral(self.robot), v)
        return np.array(self.data.v[self.joints[link]].angular)

    def axis_in_world(self, link: int) -> Array:
        """Return a joint's axis in the frame of the root link, both joint angles zero."""
        own = self.axis(link)
        return np.array(self.data.oMi[self.joints[link]].rotation @ own)

    def mass_matrix(self, angles: Array) -> Array:
        """Return `crba`."""
        return self.each((2, 2), self.pin.crba, angles)

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """Return `nonLinearEffects` of the chain without gravity."""
        weightless = self.robot.copy()
        weightless.gravity.linear = np.zeros(3)
        return self.each((2,), self.pin.nonLinearEffects, angles, speeds, robot=weightless)

    def coriolis_matrix(self, angles: Array, speeds: Array) -> Array:
        """Return `computeCoriolisMatrix`."""
        return self.each((2, 2), self.pin.computeCoriolisMatrix, angles, speeds)

    def gravity_terms(self, angles: Array) -> Array:
        """Return `computeGeneralizedGravity`."""
        return self.each((2,), self.pin.computeGeneralizedGravity, angles)

    def inverse_dynamics(
        self, angles: Array, speeds: Array, accelerations: Array, *forces: Any
    ) -> Array:
        """Return `rnea`, with `fext` of each state if given."""
        return self.each((2,), self.pin.rnea, angles, speeds, accelerations, *forces)

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array, *forces: Any) -> Array:
        """Return `aba`, with `fext` of each state if given."""
        return self.each((2,), self.pin.aba, angles, speeds, torques, *forces)

    def kinetic_energy(self, angles: Array, speeds: Array) -> Array:
        """Return `computeKineticEnergy`."""
        return self.each((), self.pin.computeKineticEnergy, angles, speeds)

    def potential_energy(self, angles: Array) -> Array:
        """Return `computePotentialEnergy`."""
        return self.each((), self.pin.computePotentialEnergy, angles)

    def position(self, angles: Array) -> Array:
        """Return the placement of D."""
        zeros = np.zeros_like(angles)
        return self.motion(self.tip, angles, zeros, zeros)[:, 0]

    def velocity(self, angles: Array, speeds: Array) -> Array:
        """Return `getFrameVelocity` of D."""
        return self.motion(self.tip, angles, speeds, np.zeros_like(angles))[:, 1]

    def acceleration(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return `getFrameClassicalAcceleration` of D."""
        return self.motion(self.tip, angles, speeds, accelerations)[:, 2]

    def jacobian(self, angles: Array) -> Array:
        """Return the linear part of `computeFrameJacobian` of D."""
        return self.frame_jacobian(self.tip, angles)

    def frame_jacobian(self, frame: int, angles: Array) -> Array:
        """Return the linear part of `computeFrameJacobian`."""
        compute, aligned = self.pin.computeFrameJacobian, self._aligned
        return self.each(
            (3, 2), lambda robot, data, q: compute(robot, data, q, frame, aligned)[:3], angles
        )

    def motion(self, frame: int, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return a frame's position, velocity and classical acceleration, shape (n, 3, 3)."""
        pin, aligned = self.pin, self._aligned

        def found(robot: Any, data: Any, q: Array, v: Array, a: Array) -> tuple[Array, ...]:
            pin.forwardKinematics(robot, data, q, v, a)
            placement = pin.updateFramePlacement(robot, data, frame)
            return (
                placement.translation,
                pin.getFrameVelocity(robot, data, frame, aligned).linear,
                pin.getFrameClassicalAcceleration(robot, data, frame, aligned).linear,
            )

        return self.each((3, 3), found, angles, speeds, accelerations)

    def configurations(self, angles: Array) -> Array:
        """Return Pinocchio's configurations as rows: angles, or cosines and sines of them."""
        rows = np.empty((len(angles), self.robot.nq))
        for joint, angle in zip(self.joints, angles.T, strict=True):
            start, width = self.robot.idx_qs[joint], self.robot.nqs[joint]
            numbers = [angle] if width == 1 else [np.cos(angle), np.sin(angle)]
            rows[:, start : start + width] = np.stack(numbers, axis=1)
        return rows

    def each(
        self,
        shape: tuple[int, ...],
        function: Callable[..., Any],
        angles: Array,
        *rows: Any,
        robot: Any = None,
    ) -> Array:
        """Return a function's values at each state, shape (n, …)."""
        robot, data = self.robot if robot is None else robot, self.data
        values = np.empty((len(angles), *shape))
        # Contiguous rows are the cheapest layout for Pinocchio's bindings.
        given = [np.ascontiguousarray(row) if isinstance(row, np.ndarray) else row for row in rows]
        for index, state in enumerate(zip(self.configurations(angles), *given, strict=True)):
            values[index] = function(robot, data, *state)
        return values

    @property
    def _aligned(self) -> Any:
        return self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def _understood(self) -> Understood:
        bodies = [(self.inertia(link), self.axis(link)) for link in (0, 1)]
        # A file may have inertias whose sums overflow; they differ from any expected number.
        with np.errstate(over="ignore", invalid="ignore"):
            return Understood(
                mass=_pair(body.mass for body, _ in bodies),
                reach=_pair(np.linalg.norm(np.cross(axis, body.lever)) for body, axis in bodies),
                inertia=_pair(axis @ body.inertia @ axis for body, axis in bodies),
                damping=_pair(self.robot.damping),
                friction=_pair(self.robot.friction),
            )


def _pair(numbers: Any) -> tuple[float, float]:
    first, second = (float(number) for number in numbers)
    return first, second
