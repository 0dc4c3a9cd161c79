"""A compiled mode: its integrators, its event functions, and the layout of its variables."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from twolink.contact.states import ContactState, EventKind
from twolink.integration.operations import Operations, of_taylor_step
from twolink.simulation.hybrid.kind import Kind
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.pool import IntegratorPool


@dataclass(frozen=True)
class Watched:
    """An event function of a compiled mode: offset + factor × a variable, or × its derivative."""

    trigger: Trigger
    variable: int
    factor: float
    integral: bool


class Layout(NamedTuple):
    """The event functions of a mode, in order: their triggers and variables.

    `variables` is a slice or an array of indices. They are the event functions themselves if the
    layout `is_plain`: none is computed from its integral, or `reversed`, of opposite sign.
    """

    triggers: tuple[Trigger, ...]
    variables: Any
    is_plain: bool
    reversed: frozenset[int]


@dataclass(frozen=True, eq=False)
class CompiledMode:
    """A mode's integrators, lent as a `Stepper`, and the layout of their variables.

    `gaps`, `recovering` and `roots` have the numbers of the elements, in the order of their
    variables after q and u; `moving` are those of the roots that change; `clock` is the
    variable of time, where that is not the independent one. The parameters are the `numbers` of
    effects, dents and frictions, the scale of moments, and, with a clock, the start of the arc (s).
    Modes of one `kind` share the code: they differ in parameters, or in the directions of slides.
    A compiled mode equals only itself, and may be the key of a mapping.
    """

    pool: IntegratorPool
    operations: int
    numbers: int
    watched: tuple[Watched, ...]
    gaps: tuple[int, ...]
    recovering: tuple[int, ...]
    roots: tuple[int, ...]
    moving: tuple[int, ...]
    clock: int | None
    integrals: slice
    number: Any
    kind: Kind
    _turned: dict[Any, CompiledMode] = field(default_factory=dict, init=False, repr=False)
    _terms: dict[Any, tuple[Any, Any]] = field(default_factory=dict, init=False, repr=False)

    def turned(self, states: tuple[ContactState, ...]) -> CompiledMode:
        """Return the compiled mode for the directions in which elements slide: it, or a copy.

        The speed of a slide falls to zero in either direction.
        """
        backward = tuple(state.slips and state.direction < 0 for state in states)
        if not any(backward):
            return self
        if backward not in self._turned:
            watched = tuple(
                replace(w, trigger=replace(w.trigger, sense=-w.trigger.sense), factor=-w.factor)
                if w.trigger.kind is EventKind.STOPS and backward[w.trigger.index]
                else w
                for w in self.watched
            )
            self._turned[backward] = replace(self, watched=watched)
        return self._turned[backward]

    @cached_property
    def step_operations(self) -> Operations:
        """The floating-point operations of a step."""
        return of_taylor_step(self.pool.original)

    @cached_property
    def layout(self) -> Layout:
        """The positions of the event functions among the variables."""
        watched = self.watched
        return Layout(
            triggers=tuple(w.trigger for w in watched),
            variables=_as_slice([w.variable for w in watched]),
            is_plain=not any(w.integral or w.factor < 0 for w in watched),
            reversed=frozenset(place for place, w in enumerate(watched) if w.factor < 0),
        )

    def terms(self, length: int, kind: Any) -> tuple[Any, Any]:
        """Return the places of the coefficients of the event functions, and factors for them.

        Both have shape (m, p + 1), with `length` p + 1; the places are indices into the flattened
        coefficients of a step. The factors are numbers of the type `kind`.
        """
        known = self._terms.get((length, kind))
        if known is None:
            powers = np.arange(length)
            places = np.array([w.variable for w in self.watched])[:, None] * length + powers
            factors = np.array([[w.factor] * length for w in self.watched])
            for row, watched in enumerate(self.watched):
                if watched.integral:
                    # The coefficients of the derivative, whose last one is not known.
                    places[row, :-1] += 1
                    factors[row] *= [*powers[1:], 0]
            known = self._terms[length, kind] = places, factors.astype(kind)
        return known

    @cached_property
    def falling(self) -> tuple[int, ...]:
        """The variables that are themselves event functions."""
        return tuple(w.variable for w in self.watched if not w.integral and w.factor > 0)

    @cached_property
    def shows_events(self) -> bool:
        """Whether all event functions are variables, by whose signs steps show most events."""
        return 0 < len(self.falling) == len(self.watched)


def _as_slice(indices: list[int]) -> Any:
    """Return indices as a slice, which NumPy need not copy, if they follow each other."""
    if indices and indices == list(range(indices[0], indices[0] + len(indices))):
        return slice(indices[0], indices[-1] + 1)
    return np.array(indices, dtype=int)
