"""Mistakes that implementations make: for each, the answer of an engine that makes just that one.

A mistake changes the model, the states, the equations or the answer, and the rest is computed
rightly in float64. `twolink.conformance.diagnosis` compares these answers with an engine's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.conformance.quantities import Quantity
from twolink.conformance.spatial import FLOATS, SpatialModel, SpatialState

Array = NDArray[np.float64]
States = Mapping[str, Array]
Names = tuple[str, ...]


@dataclass(frozen=True)
class Question:
    """A question to an engine: a quantity of a model (in float64) in states.

    `certified` is its certified answer, if there is one.
    """

    quantity: Quantity
    model: SpatialModel
    states: States
    certified: Array | None = None

    @cached_property
    def truth(self) -> Array:
        """The certified answer, or else that in float64."""
        return self.answer() if self.certified is None else self.certified

    def answer(
        self,
        *,
        model: SpatialModel | None = None,
        states: States | None = None,
        system: type[SpatialState] = SpatialState,
    ) -> Array:
        """Return the answer with another model, other states or other equations."""
        with np.errstate(all="ignore"):
            values = self.quantity.values(
                self.model if model is None else model,
                self.states if states is None else states,
                FLOATS,
                system,
            )
        found = np.array(values, dtype=float)
        return found - found[0] if self.quantity.up_to_constant else found

    def at(self, where: list[int]) -> Question:
        """Return the question in some of the states, the first of which stays the first."""
        states = {name: rows[where] for name, rows in self.states.items()}
        return replace(self, states=states, certified=self.truth[where])

    @cached_property
    def name(self) -> str:
        """The name of the quantity."""
        return self.quantity.name


Wrong = Callable[[Question], Array]
"""The wrong answer to a question. It may divide by zero."""

Variants = Callable[[Question], Iterable[Wrong]]
"""The variants of a mistake that apply to the model and the quantity of a question."""


@dataclass(frozen=True)
class Mistake:
    """A mistake: its name, a sentence, its variants, and the quantities that show it.

    The variants are the same in all states of a model. `quantities` are all by default.
    """

    name: str
    sentence: str
    variants: Variants
    quantities: frozenset[str] | None = None

    def applied(self, question: Question) -> Iterator[Wrong]:
        """Yield the variants that apply to a question."""
        if self.quantities is None or question.name in self.quantities:
            yield from self.variants(question)

    def wrong(self, question: Question) -> Iterator[Array]:
        """Yield the wrong answers to a question."""
        for variant in self.applied(question):
            try:
                yield variant(question)
            except ZeroDivisionError:
                continue


def of_questions(name: str, sentence: str, *variants: Wrong, quantities: Names = ()) -> Mistake:
    """Return a mistake of which all variants apply to every question."""
    return Mistake(name, sentence, lambda question: variants, frozenset(quantities) or None)


def of_models(
    name: str,
    sentence: str,
    change: Callable[[SpatialModel], Iterator[SpatialModel]],
    *quantities: str,
) -> Mistake:
    """Return a mistake in the model: `change` yields the wrong models."""

    def variants(question: Question) -> Iterator[Wrong]:
        for model in change(question.model):
            if model != question.model:
                yield partial(Question.answer, model=model)

    return Mistake(name, sentence, variants, frozenset(quantities) or None)


def of_states(
    name: str, sentence: str, *changes: Callable[[States], States], quantities: Names = ()
) -> Mistake:
    """Return a mistake in the states: functions that return the wrong states."""

    def variant(change: Callable[[States], States]) -> Wrong:
        return lambda question: question.answer(states=change(question.states))

    return of_questions(name, sentence, *map(variant, changes), quantities=quantities)


def of_systems(
    name: str, sentence: str, *systems: type[SpatialState], quantities: Names = ()
) -> Mistake:
    """Return a mistake in the equations: classes with wrong methods."""
    variants = (partial(Question.answer, system=system) for system in systems)
    return of_questions(name, sentence, *variants, quantities=quantities)


def of_answers(name: str, sentence: str, change: Callable[[Array], Array], *names: str) -> Mistake:
    """Return a mistake in the answer: `change` returns the wrong answer of a right one."""
    return of_questions(name, sentence, lambda question: change(question.truth), quantities=names)


def with_bodies(model: SpatialModel, change: Callable[[Any], Any]) -> SpatialModel:
    """Return a model with each body changed; bodies that become None are left out."""
    changed = (change(body) for body in model.bodies)
    return replace(model, bodies=tuple(body for body in changed if body is not None))
