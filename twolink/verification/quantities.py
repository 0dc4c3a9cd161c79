"""The compared quantities: each with this library's formula and the engine's call."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.compilation import Compiled
from twolink.engines.chain_engine import ChainEngine
from twolink.verification.states import Array, States

# Complex step, so small that its square vanishes beside 1: its only error is rounding.
_STEP = 1e-100


@dataclass(frozen=True)
class Quantity:
    """A quantity to compare.

    `name` is its name in `tolerance`; `algorithm` is Pinocchio's name for it; `inputs` are the
    fields of `States` it depends on. `text` selects the formula from a `JointSpace` (or
    `PointMotion`, …), `by` the input of the derivative. `call` evaluates it with the engine; `part`
    selects one of several results; `from_world` states that the engine computes it in the world
    frame. If forces and motion are solved for together (`constrained`), the quantity is the
    half-open range `rows` of the solution.
    """

    name: str
    unit: str
    algorithm: str
    inputs: tuple[str, ...]
    text: Callable[[Any], Callable[..., Any]]
    call: Callable[[ChainEngine, States], Array]
    part: int | None = None
    by: str | None = None
    from_world: bool = False
    constrained: bool = False
    rows: tuple[int, int] | None = None

    def of(self, solution: Array) -> Array:
        """Return the rows of a solution that belong to this quantity."""
        return solution if self.rows is None else solution[slice(*self.rows)]


class Formula:
    """A quantity's compiled formula and the number of operations on its longest path."""

    def __init__(self, quantity: Quantity, texts: object) -> None:
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


def _inverse_derivatives(engine: ChainEngine, states: States) -> Array:
    return engine.inverse_dynamics_derivatives(states.angles, states.speeds, states.accelerations)


def _forward_derivatives(engine: ChainEngine, states: States) -> Array:
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
    def call(engine: ChainEngine, states: States) -> Array:
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


def _angular_motion(engine: ChainEngine, states: States) -> Array:
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
