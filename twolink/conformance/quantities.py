"""The certified quantities: the truth of each in a state, and the name of its bound."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from twolink.arithmetic import Pair
from twolink.conformance.spatial import Arithmetic, SpatialModel, SpatialState
from twolink.engines import quantities

Values = Callable[[SpatialState, Pair], Any]


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


@dataclass(frozen=True, kw_only=True)
class Quantity(quantities.Quantity):
    """A quantity whose value is known.

    `bound` is its name in `twolink.verification.tolerance`; `value` computes it from a state and
    from accelerations or torques.
    """

    bound: str
    value: Values

    def of(self, placed: SpatialState, state: Mapping[str, Pair]) -> Any:
        """Return the value in a state, as nested lists."""
        given = next((name for name in ("accelerations", "torques") if name in self.inputs), None)
        return _listed(self.value(placed, state[given or "angles"]))

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


# The name of the bound, and the truth, which may not need accelerations or torques.
_TRUTHS: dict[str, tuple[str, Values]] = {
    "mass_matrix": ("mass matrix", lambda state, _: state.mass_matrix()),
    "velocity_terms": ("velocity terms", lambda state, _: state.velocity_terms()),
    "gravity_terms": ("gravity terms", lambda state, _: state.gravity_terms()),
    "inverse_dynamics": ("inverse dynamics", lambda state, given: state.inverse_dynamics(given)),
    "forward_dynamics": ("forward dynamics", lambda state, given: state.forward_dynamics(given)),
    "kinetic_energy": ("kinetic energy", lambda state, _: state.kinetic_energy()),
    "potential_energy": ("potential energy", lambda state, _: state.potential_energy()),
    "position": ("position of D", lambda state, _: state.position()),
    "velocity": ("velocity of D", lambda state, _: state.velocity()),
    "acceleration": ("acceleration of D", lambda state, given: state.acceleration(given)),
    "jacobian": ("Jacobian of D", lambda state, _: state.jacobian()),
}


def _listed(value: Any) -> Any:
    return [_listed(entry) for entry in value] if isinstance(value, tuple) else value


QUANTITIES: dict[str, Quantity] = {
    name: Quantity(**vars(quantities.QUANTITIES[name]), bound=bound, value=value)
    for name, (bound, value) in _TRUTHS.items()
}
