"""The compared quantities: each with this library's formula and the engine's call."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np

from twolink.compilation import Compiled
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.engines.quantities import QUANTITIES
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
    call: Callable[[Any, States], Array]
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


def _inverse_derivatives(engine: PinocchioChain, states: States) -> Array:
    return engine.inverse_dynamics_derivatives(states.angles, states.speeds, states.accelerations)


def _forward_derivatives(engine: PinocchioChain, states: States) -> Array:
    return engine.forward_dynamics_derivatives(states.angles, states.speeds, states.torques)


def _of(name: str, algorithm: str) -> Quantity:
    """Return a quantity of the contract of engines, by the formula of the same name."""
    asked = QUANTITIES[name]
    return Quantity(
        name.replace("_", " "),
        asked.unit,
        algorithm,
        asked.inputs,
        attrgetter(name),
        lambda engine, s: engine.evaluate(name, **{x: getattr(s, x) for x in asked.inputs}),
    )


def _jacobian_of(point: str) -> Quantity:
    return replace(
        _of("jacobian", "computeFrameJacobian"),
        name=f"Jacobian of {point}",
        text=lambda texts: texts.jacobian(point),
        call=lambda engine, s: engine.jacobian(point, s.angles),
        from_world=True,
    )


def _derivative(of: str, name: str, unit: str, algorithm: str, part: int, by: str) -> Quantity:
    """Return a derivative of inverse or forward dynamics by one of its inputs."""
    call = _inverse_derivatives if of == "inverse_dynamics" else _forward_derivatives
    return replace(
        _of(of, algorithm), name=name, unit=unit, call=call, part=part, by=by, from_world=True
    )


_RNEA, _ABA = "computeRNEADerivatives", "computeABADerivatives"

DYNAMICS: tuple[Quantity, ...] = (
    _of("mass_matrix", "crba"),
    _of("velocity_terms", "nonLinearEffects"),
    Quantity(
        "Coriolis matrix",
        "N m s",
        "computeCoriolisMatrix",
        ("angles", "speeds"),
        lambda texts: texts.coriolis_matrix,
        lambda engine, s: engine.coriolis_matrix(s.angles, s.speeds),
        from_world=True,
    ),
    _of("gravity_terms", "computeGeneralizedGravity"),
    _of("inverse_dynamics", "rnea"),
    Quantity(
        "inverse dynamics, force on D",
        "N m",
        "rnea, fext",
        (*QUANTITIES["inverse_dynamics"].inputs, "end_force"),
        lambda texts: texts.inverse_dynamics_with_end_force,
        lambda engine, s: engine.inverse_dynamics(s.angles, s.speeds, s.accelerations, s.end_force),
    ),
    _of("forward_dynamics", "aba"),
    _derivative("inverse_dynamics", "∂τ/∂θ", "N m", _RNEA, 0, "angles"),
    _derivative("inverse_dynamics", "∂τ/∂θ̇", "N m s", _RNEA, 1, "speeds"),
    _derivative("forward_dynamics", "∂θ̈/∂θ", "1/s²", _ABA, 0, "angles"),
    _derivative("forward_dynamics", "∂θ̈/∂θ̇", "1/s", _ABA, 1, "speeds"),
    _derivative("forward_dynamics", "∂θ̈/∂τ", "1/(kg m²)", _ABA, 2, "torques"),
    _of("kinetic_energy", "computeKineticEnergy"),
    *(_jacobian_of(point) for point in ("C1", "C2", "D")),
)


# The parts of a point's motion, in the order of the engine's answer, and Pinocchio's algorithms.
_PARTS = (
    ("position", "updateFramePlacement"),
    ("velocity", "getFrameVelocity"),
    ("acceleration", "getFrameClassicalAcceleration"),
)


def _motion_of(point: str) -> Iterator[Quantity]:
    def call(engine: PinocchioChain, states: States) -> Array:
        return engine.point_motion(point, states.angles, states.speeds, states.accelerations)

    for part, (name, algorithm) in enumerate(_PARTS):
        yield replace(
            _of(name, algorithm),
            name=f"{name} of {point}",
            text=_at(name, point),
            call=call,
            part=part,
        )


def _at(name: str, point: str) -> Callable[[Any], Callable[..., Any]]:
    return lambda texts: getattr(texts, name)(point)


def _angular_motion(engine: PinocchioChain, states: States) -> Array:
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
    _of("potential_energy", "computePotentialEnergy"),
)


def _asked(name: str) -> Quantity:
    """Return a quantity of the contract of engines, at D, of an engine that may use any frame."""
    found = replace(_of(name, ""), from_world=True)
    if not QUANTITIES[name].vector:
        return found
    return replace(
        found,
        name=f"{'Jacobian' if name == 'jacobian' else name} of D",
        text=_at(name, "D"),
    )


_OF_MOTION = ("position", "velocity", "acceleration", "potential_energy")

ASKED: dict[str, tuple[tuple[Quantity, ...], tuple[Quantity, ...]]] = {
    name: ((), (_asked(name),)) if name in _OF_MOTION else ((_asked(name),), ())
    for name in QUANTITIES
}
"""Each quantity of the contract of engines, as a part of `DYNAMICS` or of `MOTION`."""
