"""The hybrid system: a chain, its effects and their elements, in numbers of one precision."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from twolink.arithmetic import Pair, exactly
from twolink.chain import Chain
from twolink.contact.coordinates import ConstraintCoordinate, PointCoordinate
from twolink.contact.elements import ContactElement
from twolink.contact.force_laws import PlasticState
from twolink.contact.states import ContactState
from twolink.effects import Effect, ParametricEffect, contact_elements
from twolink.errors import SimulationError
from twolink.formulations import EquationsOfMotion
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.simulation.hybrid.dynamics import held_coordinates
from twolink.simulation.hybrid.mode import Mode
from twolink.simulation.hybrid.pose import Pose, PoseFormulas
from twolink.simulation.hybrid.scales import Scales
from twolink.simulation.hybrid.tally import Tally
from twolink.simulation.hybrid.tolerances import NO_LEVER
from twolink.values import Content, Own


@dataclass(frozen=True, eq=False)
class HybridSystem:
    """The constants of a motion between two discontinuities of the effects.

    `chain` has numbers of the type `number`, of the named `precision` whose relative spacing is
    `rounding`; `scene_chain` is the same in float64. `longest_step` is in s. `compiled` has the
    modes that were entered, for `compile`, `near_to_zero` the distances from zero at which their
    event functions leave a doubt, for `certificate`, and `event_functions` those that were
    evaluated, for `steepness`. `expanded` counts the modes that were expanded in power series, for
    `effort`.
    """

    scene_chain: Chain
    chain: Chain
    formulation: EquationsOfMotion
    effects: tuple[Effect, ...]
    elements: tuple[ContactElement, ...]
    precision: PrecisionName
    order: int | None
    number: Any
    rounding: float
    longest_step: float
    own: Own = field(default_factory=Own, repr=False)
    compiled: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)
    near_to_zero: dict[Any, tuple[float, ...]] = field(default_factory=dict, init=False, repr=False)
    event_functions: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)
    expanded: Tally = field(default_factory=Tally, init=False, repr=False)
    _last_pose: list[Pose] = field(default_factory=list, init=False, repr=False)
    _held: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)
    _frictions: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)
    _options: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)
    _modes: dict[Any, Mode] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def content(self) -> Content:
        """The effects as a key of compiled modes, without the numbers that are parameters."""
        varying: tuple[Any, ...] = self.effects
        blank = tuple(
            e.with_numbers((0.0,) * len(e.numbers)) if isinstance(e, ParametricEffect) else e
            for e in varying
        )
        return Content(blank, self.own)

    def pose(self, q: Pair) -> Pose:
        """Return the chain in a pose q (rad).

        The last pose is kept with its rows and its inertia: the steps of a jump share it.
        """
        last = self._last_pose
        if not last or last[0].q is not q:
            last[:] = (Pose(self.chain, self.formulation, q, self._formulas),)
        return last[0]

    @cached_property
    def _formulas(self) -> PoseFormulas:
        return PoseFormulas(self.chain, self.formulation, compiled=self.number is float)

    def mode(
        self, states: tuple[ContactState, ...], dents: tuple[PlasticState | None, ...] = ()
    ) -> Mode:
        """Return the mode in which the elements have these states and dents."""
        if dents:
            return Mode(self.names, states, dents)
        found = self._modes.get(states)
        if found is None:
            found = self._modes[states] = Mode(self.names, states)
        return found

    def held(self, states: tuple[ContactState, ...]) -> tuple[ConstraintCoordinate, ...]:
        """Return the coordinates whose speed the elements hold at zero in their states."""
        found: tuple[ConstraintCoordinate, ...] | None = self._held.get(states)
        if found is None:
            found = self._held[states] = tuple(held_coordinates(self.elements, states))
        return found

    def frictions(self, states: tuple[ContactState, ...]) -> tuple[Any, ...]:
        """Return the known friction of each element that slips or is pressed in these states.

        It is the limit (N m) or the coefficient that acts, negative for a backward direction.
        """
        found: tuple[Any, ...] | None = self._frictions.get(states)
        if found is None:
            found = self._frictions[states] = tuple(
                exactly(state.direction * limits[state.pressed], self.number)
                for limits, state in zip(self._limits, states, strict=True)
                if state.direction
            )
        return found

    @cached_property
    def _limits(self) -> tuple[Pair, ...]:
        """The kinetic and the static limit of each element under a unit normal force."""
        return tuple(element.limits(1) for element in self.elements)

    def options(
        self, touching: frozenset[int], sliding: tuple[int, ...]
    ) -> tuple[tuple[ContactState, ...], ...]:
        """Return the possible states of each element, by the contacts and the slides of a state."""
        key = touching, sliding
        found: tuple[tuple[ContactState, ...], ...] | None = self._options.get(key)
        if found is None:
            found = self._options[key] = tuple(
                element.options(index in touching, sliding[index])
                for index, element in enumerate(self.elements)
            )
        return found

    @cached_property
    def effect_numbers(self) -> tuple[Any, ...]:
        """The numbers of effects that differ from piece to piece, as parameters of integrators."""
        varying = (e for e in self.effects if isinstance(e, ParametricEffect))
        return tuple(exactly(n, self.number) for effect in varying for n in effect.numbers)

    @cached_property
    def cap(self) -> Any:
        """The longest step (s), in the system's numbers."""
        return self.number(self.longest_step)

    @cached_property
    def in_double(self) -> HybridSystem:
        """The system in float64, for values of which a few digits are enough."""
        if self.number is float:
            return self
        found = replace(
            self, chain=self.scene_chain, precision="double", order=None, number=float,
            elements=contact_elements(self.effects, self.scene_chain),
            rounding=PRECISIONS["double"].rounding,
        )  # fmt: skip
        return found.moved_to([float(place) for place in self.places])

    @cached_property
    def scales(self) -> Scales:
        """The sizes of places, speeds and forces, and of their round-off."""
        own = PRECISIONS[self.precision]
        return Scales(self.scene_chain, self.elements, own, self.order, self.longest_step)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the elements."""
        return tuple(element.name for element in self.elements)

    @cached_property
    def tangents(self) -> tuple[ConstraintCoordinate | None, ...]:
        """The coordinate along which each element slides, None where it has no friction."""
        return tuple(element.tangent for element in self.elements)

    def check(self) -> None:
        """Raise `SimulationError` for contacts and frictions of which no motion is known."""
        self._check_frictions()
        self._check_points()

    def _check_frictions(self) -> None:
        """Raise `SimulationError` if two frictions act along one coordinate."""
        rubbing = [e.tangent for e in self.elements if e.normal is None]
        for element in self.elements:
            if element.normal is None and rubbing.count(element.tangent) > 1:
                raise SimulationError(
                    f"{element.name} has dry friction twice, that of a URDF included; the scene "
                    "must have one for each"
                )

    def _check_points(self) -> None:
        """Raise `SimulationError` for a contact of a point near A whose motion is round-off."""
        least = NO_LEVER * self.scales.lever
        for element in self.elements:
            if isinstance(element.normal, PointCoordinate):
                link, along, across = element.normal.of(self.scene_chain)
                if link == 1 and 0 < math.hypot(along, across) <= least:
                    raise SimulationError(
                        f"{element.name}: the point must be at A, or at least {least:.2g} m from "
                        f"it; got {math.hypot(along, across):.3g} m"
                    )

    @cached_property
    def places(self) -> tuple[Any, ...]:
        """The place (rad or m) of each contact: the bound of its coordinate."""
        return tuple(element.bound for element in self.elements if element.normal is not None)

    def moved_to(self, places: Sequence[Any]) -> HybridSystem:
        """Return the system whose contacts are in other places (rad or m)."""
        left = iter(places)
        elements: Iterable[Any] = self.elements
        moved = tuple(e if e.normal is None else replace(e, bound=next(left)) for e in elements)
        return replace(self, elements=moved)

    def with_effects(self, effects: tuple[Effect, ...]) -> HybridSystem:
        """Return the system under other effects that have the same elements, in their places."""
        elements = contact_elements(effects, self.chain)
        return replace(self, effects=effects, elements=elements).moved_to(self.places)
