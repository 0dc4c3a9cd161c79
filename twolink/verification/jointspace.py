"""The formulations in a URDF's joint angles, the coordinates in which engines answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

from twolink import kinematics
from twolink.arithmetic import Matrix, Pair, Scalar
from twolink.chain import Chain, Point
from twolink.coordinates import JointConvention
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.formulations import Formulation
from twolink.loads import Force, Loads


@dataclass(frozen=True)
class PlanarModel:
    """The planar model in a URDF: chain parameters, joint angles and gravity (m/s²)."""

    chain: Chain
    joints: JointConvention
    gravity: float

    @property
    def points(self) -> dict[str, Point]:
        """The points whose motion is compared, by name."""
        return {"C1": self.chain.C1, "C2": self.chain.C2, "D": self.chain.D}


class JointSpace:
    """A formulation's quantities in a URDF's joint angles θ.

    Each method accepts any scalar type; shapes and units are those of `ChainEngine`.
    """

    def __init__(self, formulation: Formulation, model: PlanarModel) -> None:
        """Set up the equations of a formulation for a planar model."""
        self._equations = formulation.equations
        self._jacobian = formulation.jacobian
        self._chain = model.chain
        self._joints = model.joints
        self._points = model.points
        self._gravity = Gravity(model.gravity)

    def mass_matrix(self, angles: Pair) -> Matrix:
        """Return Sᵀ M S."""
        q = self._joints.absolute_angles(angles)
        return self._joints.joint_matrix(self._equations.mass_matrix(self._chain, q))

    def velocity_terms(self, angles: Pair, speeds: Pair) -> Pair:
        """Return Sᵀ C u."""
        q, u = self._state(angles, speeds)
        return self._joints.joint_forces(self._equations.velocity_terms(self._chain, q, u))

    def coriolis_matrix(self, angles: Pair, speeds: Pair) -> Matrix:
        """Return Sᵀ C S."""
        q, u = self._state(angles, speeds)
        return self._joints.joint_matrix(self._equations.coriolis_matrix(self._chain, q, u))

    def gravity_terms(self, angles: Pair) -> Pair:
        """Return −Sᵀ Q of gravity."""
        q, u = self._state(angles, (0, 0))
        loads = self._gravity.loads(self._chain, q, u)
        Q1, Q2 = self._equations.generalized_active_force(self._chain, q, loads)
        return self._joints.joint_forces((-Q1, -Q2))

    def inverse_dynamics(self, angles: Pair, speeds: Pair, accelerations: Pair) -> Pair:
        """Return the joint torques under gravity."""
        return self._inverse_dynamics(angles, speeds, accelerations, ())

    def inverse_dynamics_with_end_force(
        self, angles: Pair, speeds: Pair, accelerations: Pair, end_force: Pair
    ) -> Pair:
        """Return the joint torques under gravity and a force on D."""
        force = Force(self._chain.D, end_force)
        return self._inverse_dynamics(angles, speeds, accelerations, (force,))

    def forward_dynamics(self, angles: Pair, speeds: Pair, torques: Pair) -> Pair:
        """Return the joint accelerations under gravity and joint torques."""
        q, u = self._state(angles, speeds)
        Q1, Q2 = self._joints.generalized_forces(torques)
        motors = JointTorque((Q1 + Q2, Q2)).loads(self._chain, q, u)
        loads = (*self._gravity.loads(self._chain, q, u), *motors)
        du = self._equations.forward_dynamics(self._chain, q, u, loads)
        return self._joints.joint_speeds(du)

    def kinetic_energy(self, angles: Pair, speeds: Pair) -> Scalar:
        """Return T."""
        return self._equations.kinetic_energy(self._chain, *self._state(angles, speeds))

    def jacobian(self, point: str) -> Callable[[Pair], Matrix]:
        """Return the function of a point's Jacobian: rows x and y, columns θ1 and θ2."""

        def text(angles: Pair) -> Matrix:
            q = self._joints.absolute_angles(angles)
            (x1, y1), (x2, y2) = self._jacobian(self._chain, q, self._points[point])
            row_x, row_y = self._joints.joint_columns(((x1, x2), (y1, y2)))
            return row_x, row_y

        return text

    def _state(self, angles: Pair, speeds: Pair) -> tuple[Pair, Pair]:
        return self._joints.absolute_angles(angles), self._joints.absolute_speeds(speeds)

    def _inverse_dynamics(
        self, angles: Pair, speeds: Pair, accelerations: Pair, loads: Loads
    ) -> Pair:
        q, u = self._state(angles, speeds)
        du = self._joints.absolute_speeds(accelerations)
        every = (*self._gravity.loads(self._chain, q, u), *loads)
        return self._joints.joint_forces(
            self._equations.inverse_dynamics(self._chain, q, u, du, every)
        )


class PointMotion:
    """The motion of the chain's points in joint angles, by the kinematics of section 6.1."""

    def __init__(self, model: PlanarModel, equations: ModuleType = kinematics) -> None:
        """Set up the kinematics for a planar model."""
        self._machine = model
        self._equations = equations

    def position(self, point: str) -> Callable[[Pair], Pair]:
        """Return the function of a point's position."""
        model = self._machine

        def text(angles: Pair) -> Pair:
            q = model.joints.absolute_angles(angles)
            r: Pair = self._equations.position(model.chain, q, model.points[point])
            return r

        return text

    def velocity(self, point: str) -> Callable[[Pair, Pair], Pair]:
        """Return the function of a point's velocity."""
        model = self._machine

        def text(angles: Pair, speeds: Pair) -> Pair:
            q, u = model.joints.absolute_angles(angles), model.joints.absolute_speeds(speeds)
            v: Pair = self._equations.velocity(model.chain, q, u, model.points[point])
            return v

        return text

    def acceleration(self, point: str) -> Callable[[Pair, Pair, Pair], Pair]:
        """Return the function of a point's acceleration."""
        model = self._machine

        def text(angles: Pair, speeds: Pair, accelerations: Pair) -> Pair:
            q, u = model.joints.absolute_angles(angles), model.joints.absolute_speeds(speeds)
            du = model.joints.absolute_speeds(accelerations)
            a: Pair = self._equations.acceleration(model.chain, q, u, du, model.points[point])
            return a

        return text

    def angular_velocities(self, speeds: Pair) -> Pair:
        """Return ω1 and ω2."""
        omega: Pair = self._equations.angular_velocities(
            self._machine.joints.absolute_speeds(speeds)
        )
        return omega

    def angular_accelerations(self, accelerations: Pair) -> Pair:
        """Return α1 and α2."""
        du = self._machine.joints.absolute_speeds(accelerations)
        alpha: Pair = self._equations.angular_accelerations(du)
        return alpha

    def potential_energy(self, angles: Pair) -> Scalar:
        """Return V of gravity."""
        q = self._machine.joints.absolute_angles(angles)
        return Gravity(self._machine.gravity).potential_energy(self._machine.chain, q)
