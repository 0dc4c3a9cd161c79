"""The quantities that an engine answers: inputs, shape, unit and meaning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.engines.faults import EngineFault, FaultKind

_ANGLES, _MOTION = ("angles",), ("angles", "speeds")
_INVERSE, _FORWARD = (*_MOTION, "accelerations"), (*_MOTION, "torques")


@dataclass(frozen=True)
class Quantity:
    """A quantity of the protocol; its name is that of a method of `Engine`.

    `inputs` are the fields of the states it needs; `shape` is that of its value in one state. A
    `vector` has components along x and y of the chain's frame first, or, for a model from URDF,
    along x, y and z of the root link's frame. A potential is known `up_to_constant`: its difference
    to the first state counts.
    """

    name: str
    inputs: tuple[str, ...]
    shape: tuple[int, ...]
    unit: str
    meaning: str
    vector: bool = False
    up_to_constant: bool = False

    def shape_of_answer(self, states: int, *, from_urdf: bool) -> tuple[int, ...]:
        """Return the shape of an engine's answer."""
        inside = (3, *self.shape[1:]) if self.vector and from_urdf else self.shape
        return (states, *inside)

    def array(self, values: list[Any], states: int, *, from_urdf: bool) -> NDArray[np.float64]:
        """Return an answer's nested lists. Raises `EngineFault` unless they have the shape."""
        shape = self.shape_of_answer(states, from_urdf=from_urdf)
        wanted = " × ".join(map(str, shape))
        found = _shape(values)
        if found is None:
            said = f"values of {self.name} must be numbers in rows of one length"
            raise EngineFault(FaultKind.WRONG_LENGTH, f"{said}; got others")
        if found != shape:
            got = " × ".join(map(str, found)) or "a number"
            said = f"values of {self.name} must be {wanted} numbers; got {got}"
            raise EngineFault(FaultKind.WRONG_LENGTH, said)
        return np.array(values, dtype=float)


_ALL = (
    Quantity("mass_matrix", _ANGLES, (2, 2), "kg m²", "M over the joint angles"),
    Quantity(
        "velocity_terms",
        _MOTION,
        (2,),
        "N m",
        "Coriolis and centrifugal torques C θ̇, without gravity",
    ),
    Quantity(
        "gravity_terms",
        _ANGLES,
        (2,),
        "N m",
        "∂V/∂θ: the joint torques that hold the chain at rest",
    ),
    Quantity(
        "inverse_dynamics", _INVERSE, (2,), "N m", "the joint torques of a motion under gravity"
    ),
    Quantity(
        "forward_dynamics",
        _FORWARD,
        (2,),
        "rad/s²",
        "the joint accelerations under gravity and joint torques",
    ),
    Quantity("kinetic_energy", _MOTION, (), "J", "T"),
    Quantity(
        "potential_energy",
        _ANGLES,
        (),
        "J",
        "V of gravity, up to a constant",
        up_to_constant=True,
    ),
    Quantity("position", _ANGLES, (2,), "m", "D, from the origin of the model", vector=True),
    Quantity("velocity", _MOTION, (2,), "m/s", "the velocity of D", vector=True),
    Quantity("acceleration", _INVERSE, (2,), "m/s²", "the acceleration of D", vector=True),
    Quantity(
        "jacobian",
        _ANGLES,
        (2, 2),
        "m",
        "∂D/∂θ: rows are components, columns joint angles",
        vector=True,
    ),
)

QUANTITIES: dict[str, Quantity] = {quantity.name: quantity for quantity in _ALL}

_WORDS = ("nan", "inf", "-inf")


def _shape(value: Any) -> tuple[int, ...] | None:
    """Return the shape of nested lists of numbers, or None for anything else."""
    if not isinstance(value, list):
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return () if number or (isinstance(value, str) and value in _WORDS) else None
    inside = {_shape(entry) for entry in value}
    if len(inside) > 1 or None in inside:
        return None
    (rest,) = inside or {()}
    assert rest is not None
    return (len(value), *rest)
