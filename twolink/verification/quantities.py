"""What is compared: each quantity as this library writes it, and as an engine answers it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from twolink import kane, kinematics, lagrange
from twolink.arithmetic import Matrix, Pair, Scalar
from twolink.chain import Chain, Point
from twolink.compilation import Compiled
from twolink.coordinates import JointConvention
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.engines.protocol import Engine
from twolink.loads import Force, Loads
from twolink.verification.states import Array, States

# Imaginary, and so small that its square is nothing beside 1: the complex step's only error is
# that of rounding.
_STEP = 1e-100


@dataclass(frozen=True)
class Formulation:
    """A text of the equations of motion, and its way to a point's Jacobian."""

    name: str
    equations: ModuleType
    jacobian: Callable[[Chain, Pair, Point], tuple[Pair, Pair]]


FORMULATIONS: Mapping[str, Formulation] = {
    "kane": Formulation("Kane", kane, kane.partial_velocities),
    "lagrange": Formulation("Lagrange", lagrange, lagrange.position_gradients),
}


@dataclass(frozen=True)
class Machine:
    """The chain as a URDF poses it: its parameters, its joint angles, and gravity (m/s²)."""

    chain: Chain
    joints: JointConvention
    gravity: float

    @property
    def points(self) -> dict[str, Point]:
        """The points whose motion is compared, by name."""
        return {"C1": self.chain.C1, "C2": self.chain.C2, "D": self.chain.D}


class JointSpace:
    """A formulation's quantities over a URDF's joint angles θ, where engines give theirs.

    Each method is a text for numbers of any kind; shapes and units are those of `Engine`.
    """

    def __init__(self, formulation: Formulation, machine: Machine) -> None:
        """Pose the equations of a formulation for a machine."""
        self._equations = formulation.equations
        self._jacobian = formulation.jacobian
        self._chain = machine.chain
        self._joints = machine.joints
        self._points = machine.points
        self._gravity = Gravity(machine.gravity)

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
        """Return the text of a point's Jacobian: rows x and y, columns θ1 and θ2."""

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
    """The motion of the chain's points over joint angles, by the source's section 6.1."""

    def __init__(self, machine: Machine, equations: ModuleType = kinematics) -> None:
        """Pose the kinematics for a machine."""
        self._machine = machine
        self._equations = equations

    def position(self, point: str) -> Callable[[Pair], Pair]:
        """Return the text of a point's position."""
        machine = self._machine

        def text(angles: Pair) -> Pair:
            q = machine.joints.absolute_angles(angles)
            r: Pair = self._equations.position(machine.chain, q, machine.points[point])
            return r

        return text

    def velocity(self, point: str) -> Callable[[Pair, Pair], Pair]:
        """Return the text of a point's velocity."""
        machine = self._machine

        def text(angles: Pair, speeds: Pair) -> Pair:
            q, u = machine.joints.absolute_angles(angles), machine.joints.absolute_speeds(speeds)
            v: Pair = self._equations.velocity(machine.chain, q, u, machine.points[point])
            return v

        return text

    def acceleration(self, point: str) -> Callable[[Pair, Pair, Pair], Pair]:
        """Return the text of a point's acceleration."""
        machine = self._machine

        def text(angles: Pair, speeds: Pair, accelerations: Pair) -> Pair:
            q, u = machine.joints.absolute_angles(angles), machine.joints.absolute_speeds(speeds)
            du = machine.joints.absolute_speeds(accelerations)
            a: Pair = self._equations.acceleration(machine.chain, q, u, du, machine.points[point])
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


@dataclass(frozen=True)
class Quantity:
    """A quantity to compare.

    `name` is its name in `tolerance`; `algorithm` what Pinocchio calls it; `inputs` the fields of
    `States` it depends on. `text` picks the formula from a `JointSpace` (or `PointMotion`),
    `by` the input it is differentiated by. `call` asks the engine; `part` is the wanted part of
    an answer that holds several; `from_world` tells that the engine computes it there.
    """

    name: str
    unit: str
    algorithm: str
    inputs: tuple[str, ...]
    text: Callable[[Any], Callable[..., Any]]
    call: Callable[[Engine, States], Array]
    part: int | None = None
    by: str | None = None
    from_world: bool = False


class Formula:
    """A quantity's formula, compiled, with the operations on its longest path."""

    def __init__(self, quantity: Quantity, texts: JointSpace | PointMotion) -> None:
        """Compile the formula of a quantity."""
        self._compiled = Compiled(quantity.text(texts))
        self._inputs = quantity.inputs
        self._by = quantity.by
        # A product of complex numbers is two products and a sum.
        self.roundings = self._compiled.depth * (1 if quantity.by is None else 2)

    def values(self, states: States) -> Array:
        """Return the quantity in many states."""
        inputs = {name: getattr(states, name) for name in self._inputs}
        if self._by is None:
            return self._compiled.batch(*inputs.values())
        columns = []
        for coordinate in (0, 1):
            stepped = inputs[self._by].astype(complex)
            stepped[coordinate] += 1j * _STEP
            complex_inputs = {name: value.astype(complex) for name, value in inputs.items()}
            values = self._compiled.batch(*{**complex_inputs, self._by: stepped}.values())
            columns.append(values.imag / _STEP)
        return np.stack(columns, axis=1)


def _inverse_derivatives(engine: Engine, states: States) -> Array:
    return engine.inverse_dynamics_derivatives(states.angles, states.speeds, states.accelerations)


def _forward_derivatives(engine: Engine, states: States) -> Array:
    return engine.forward_dynamics_derivatives(states.angles, states.speeds, states.torques)


def _jacobian_of(point: str) -> Quantity:
    return Quantity(
        f"Jacobian of {point}",
        "m",
        "computeFrameJacobian",
        ("angles",),
        lambda texts: texts.jacobian(point),
        lambda engine, s: engine.jacobian(point, s.angles),
        from_world=True,
    )


_INVERSE = ("angles", "speeds", "accelerations")
_FORWARD = ("angles", "speeds", "torques")

DYNAMICS: tuple[Quantity, ...] = (
    Quantity(
        "mass matrix",
        "kg m²",
        "crba",
        ("angles",),
        lambda texts: texts.mass_matrix,
        lambda engine, s: engine.mass_matrix(s.angles),
    ),
    Quantity(
        "velocity terms",
        "N m",
        "nonLinearEffects",
        ("angles", "speeds"),
        lambda texts: texts.velocity_terms,
        lambda engine, s: engine.velocity_terms(s.angles, s.speeds),
    ),
    Quantity(
        "Coriolis matrix",
        "N m s",
        "computeCoriolisMatrix",
        ("angles", "speeds"),
        lambda texts: texts.coriolis_matrix,
        lambda engine, s: engine.coriolis_matrix(s.angles, s.speeds),
        from_world=True,
    ),
    Quantity(
        "gravity terms",
        "N m",
        "computeGeneralizedGravity",
        ("angles",),
        lambda texts: texts.gravity_terms,
        lambda engine, s: engine.gravity_terms(s.angles),
    ),
    Quantity(
        "inverse dynamics",
        "N m",
        "rnea",
        _INVERSE,
        lambda texts: texts.inverse_dynamics,
        lambda engine, s: engine.inverse_dynamics(s.angles, s.speeds, s.accelerations),
    ),
    Quantity(
        "inverse dynamics, force on D",
        "N m",
        "rnea, fext",
        (*_INVERSE, "end_force"),
        lambda texts: texts.inverse_dynamics_with_end_force,
        lambda engine, s: engine.inverse_dynamics(s.angles, s.speeds, s.accelerations, s.end_force),
    ),
    Quantity(
        "forward dynamics",
        "rad/s²",
        "aba",
        _FORWARD,
        lambda texts: texts.forward_dynamics,
        lambda engine, s: engine.forward_dynamics(s.angles, s.speeds, s.torques),
    ),
    Quantity(
        "∂τ/∂θ",
        "N m",
        "computeRNEADerivatives",
        _INVERSE,
        lambda texts: texts.inverse_dynamics,
        _inverse_derivatives,
        part=0,
        by="angles",
        from_world=True,
    ),
    Quantity(
        "∂τ/∂θ̇",
        "N m s",
        "computeRNEADerivatives",
        _INVERSE,
        lambda texts: texts.inverse_dynamics,
        _inverse_derivatives,
        part=1,
        by="speeds",
        from_world=True,
    ),
    Quantity(
        "∂θ̈/∂θ",
        "1/s²",
        "computeABADerivatives",
        _FORWARD,
        lambda texts: texts.forward_dynamics,
        _forward_derivatives,
        part=0,
        by="angles",
        from_world=True,
    ),
    Quantity(
        "∂θ̈/∂θ̇",
        "1/s",
        "computeABADerivatives",
        _FORWARD,
        lambda texts: texts.forward_dynamics,
        _forward_derivatives,
        part=1,
        by="speeds",
        from_world=True,
    ),
    Quantity(
        "∂θ̈/∂τ",
        "1/(kg m²)",
        "computeABADerivatives",
        _FORWARD,
        lambda texts: texts.forward_dynamics,
        _forward_derivatives,
        part=2,
        by="torques",
        from_world=True,
    ),
    Quantity(
        "kinetic energy",
        "J",
        "computeKineticEnergy",
        ("angles", "speeds"),
        lambda texts: texts.kinetic_energy,
        lambda engine, s: engine.kinetic_energy(s.angles, s.speeds),
    ),
    *(_jacobian_of(point) for point in ("C1", "C2", "D")),
)


def _motion_of(point: str) -> tuple[Quantity, ...]:
    def call(engine: Engine, states: States) -> Array:
        return engine.point_motion(point, states.angles, states.speeds, states.accelerations)

    return (
        Quantity(
            f"position of {point}",
            "m",
            "updateFramePlacement",
            ("angles",),
            lambda texts: texts.position(point),
            call,
            part=0,
        ),
        Quantity(
            f"velocity of {point}",
            "m/s",
            "getFrameVelocity",
            ("angles", "speeds"),
            lambda texts: texts.velocity(point),
            call,
            part=1,
        ),
        Quantity(
            f"acceleration of {point}",
            "m/s²",
            "getFrameClassicalAcceleration",
            _INVERSE,
            lambda texts: texts.acceleration(point),
            call,
            part=2,
        ),
    )


def _angular_motion(engine: Engine, states: States) -> Array:
    return engine.angular_motion(states.angles, states.speeds, states.accelerations)


MOTION: tuple[Quantity, ...] = (
    *(quantity for point in ("C1", "C2", "D") for quantity in _motion_of(point)),
    Quantity(
        "angular velocities",
        "rad/s",
        "getVelocity",
        ("speeds",),
        lambda texts: texts.angular_velocities,
        _angular_motion,
        part=0,
    ),
    Quantity(
        "angular accelerations",
        "rad/s²",
        "getAcceleration",
        ("accelerations",),
        lambda texts: texts.angular_accelerations,
        _angular_motion,
        part=1,
    ),
    Quantity(
        "potential energy",
        "J",
        "computePotentialEnergy",
        ("angles",),
        lambda texts: texts.potential_energy,
        lambda engine, s: engine.potential_energy(s.angles),
    ),
)
