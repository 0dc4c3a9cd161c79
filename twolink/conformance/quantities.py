"""The quantities an engine may be asked for: inputs, shape, unit, and the truth of a state."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from twolink.arithmetic import Pair
from twolink.conformance.spatial import Arithmetic, SpatialModel, SpatialState

_ANGLES, _MOTION = ("angles",), ("angles", "speeds")


def in_numbers(
    states: Mapping[str, Any], arithmetic: Arithmetic
) -> Iterator[dict[str, tuple[Any, Any]]]:
    """Return states one by one, with pairs of numbers of a type."""
    number = arithmetic.number
    for index in range(len(states["angles"])):
        yield {
            name: (number(float(rows[index][0])), number(float(rows[index][1])))
            for name, rows in states.items()
        }


@dataclass(frozen=True)
class Quantity:
    """A quantity of the protocol.

    `inputs` are the fields of the states it needs; `shape` is that of its value in one state. A
    `vector` has components along x and y of the chain's frame first, or, for a model from URDF,
    along x, y and z of the root link's frame. `bound` is its name in
    `twolink.verification.tolerance`. A potential is known `up_to_constant`: its difference to the
    first state counts. `value` computes it from a state and from accelerations or torques.
    """

    name: str
    inputs: tuple[str, ...]
    shape: tuple[int, ...]
    unit: str
    meaning: str
    bound: str
    value: Callable[[SpatialState, Pair], Any]
    vector: bool = False
    up_to_constant: bool = False

    def of(self, placed: SpatialState, state: Mapping[str, Pair]) -> Any:
        """Return the value in a state, as nested lists."""
        given = self.inputs[-1] if len(self.inputs) > len(_MOTION) else "angles"
        return _listed(self.value(placed, state[given]))

    def values(
        self,
        model: SpatialModel,
        states: Mapping[str, Any],
        arithmetic: Arithmetic,
        system: type[SpatialState] = SpatialState,
    ) -> list[Any]:
        """Return the values in many states, as nested lists."""
        return [
            self.of(system(model, arithmetic, state["angles"], state.get("speeds", (0, 0))), state)
            for state in in_numbers(states, arithmetic)
        ]

    def shape_of_answer(self, states: int, *, from_urdf: bool) -> tuple[int, ...]:
        """Return the shape of an engine's answer."""
        inside = (3, *self.shape[1:]) if self.vector and from_urdf else self.shape
        return (states, *inside)


_ALL = (
    Quantity(
        "mass_matrix",
        _ANGLES,
        (2, 2),
        "kg m²",
        "M over the joint angles",
        "mass matrix",
        lambda state, _: state.mass_matrix(),
    ),
    Quantity(
        "velocity_terms",
        _MOTION,
        (2,),
        "N m",
        "Coriolis and centrifugal torques C θ̇, without gravity",
        "velocity terms",
        lambda state, _: state.velocity_terms(),
    ),
    Quantity(
        "gravity_terms",
        _ANGLES,
        (2,),
        "N m",
        "∂V/∂θ: the joint torques that hold the chain at rest",
        "gravity terms",
        lambda state, _: state.gravity_terms(),
    ),
    Quantity(
        "inverse_dynamics",
        (*_MOTION, "accelerations"),
        (2,),
        "N m",
        "the joint torques of a motion under gravity",
        "inverse dynamics",
        lambda state, given: state.inverse_dynamics(given),
    ),
    Quantity(
        "forward_dynamics",
        (*_MOTION, "torques"),
        (2,),
        "rad/s²",
        "the joint accelerations under gravity and joint torques",
        "forward dynamics",
        lambda state, given: state.forward_dynamics(given),
    ),
    Quantity(
        "kinetic_energy",
        _MOTION,
        (),
        "J",
        "T",
        "kinetic energy",
        lambda state, _: state.kinetic_energy(),
    ),
    Quantity(
        "potential_energy",
        _ANGLES,
        (),
        "J",
        "V of gravity, up to a constant",
        "potential energy",
        lambda state, _: state.potential_energy(),
        up_to_constant=True,
    ),
    Quantity(
        "position",
        _ANGLES,
        (2,),
        "m",
        "D, from the origin of the model",
        "position of D",
        lambda state, _: state.position(),
        vector=True,
    ),
    Quantity(
        "velocity",
        _MOTION,
        (2,),
        "m/s",
        "the velocity of D",
        "velocity of D",
        lambda state, _: state.velocity(),
        vector=True,
    ),
    Quantity(
        "acceleration",
        (*_MOTION, "accelerations"),
        (2,),
        "m/s²",
        "the acceleration of D",
        "acceleration of D",
        lambda state, given: state.acceleration(given),
        vector=True,
    ),
    Quantity(
        "jacobian",
        _ANGLES,
        (2, 2),
        "m",
        "∂D/∂θ: rows are components, columns joint angles",
        "Jacobian of D",
        lambda state, _: state.jacobian(),
        vector=True,
    ),
)


def _listed(value: Any) -> Any:
    return [_listed(entry) for entry in value] if isinstance(value, tuple) else value


QUANTITIES: dict[str, Quantity] = {quantity.name: quantity for quantity in _ALL}
