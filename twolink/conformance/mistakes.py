"""Mistakes that implementations make: for each, the answer of an engine that makes just that one.

A mistake changes the model, the states, the equations or the answer, and the rest is computed
rightly in float64. `twolink.conformance.diagnosis` compares these answers with an engine's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.conformance.quantities import Quantity
from twolink.conformance.spatial import FLOATS, SpatialModel, SpatialState

Array = NDArray[np.float64]
States = Mapping[str, Array]


@dataclass(frozen=True)
class Question:
    """A question to an engine: a quantity of a model (in float64) in states, and its truth."""

    quantity: Quantity
    model: SpatialModel
    states: States
    truth: Array

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
        truth = self.truth[where]
        return replace(self, states=states, truth=truth)

    @cached_property
    def name(self) -> str:
        """The name of the quantity."""
        return self.quantity.name


Candidates = Callable[[Question], Iterator[Array]]


@dataclass(frozen=True)
class Mistake:
    """A mistake: its name, a sentence, the wrong answers, and the quantities that show it.

    `answers` yields the answers to a question, one for each variant; none where the mistake does
    not apply. `quantities` are all by default.
    """

    name: str
    sentence: str
    answers: Candidates
    quantities: frozenset[str] | None = None

    def wrong(self, question: Question) -> Iterator[Array]:
        """Return the wrong answers to a question."""
        if self.quantities is None or question.name in self.quantities:
            yield from self.answers(question)


def of_models(
    name: str,
    sentence: str,
    change: Callable[[SpatialModel], Iterator[SpatialModel]],
    *quantities: str,
) -> Mistake:
    """Return a mistake in the model: `change` yields the wrong models."""

    def answers(question: Question) -> Iterator[Array]:
        for model in change(question.model):
            if model != question.model:
                try:
                    yield question.answer(model=model)
                except ZeroDivisionError:
                    continue

    return Mistake(name, sentence, answers, frozenset(quantities) or None)


def of_states(
    name: str, sentence: str, change: Callable[[States], Iterator[States]], *quantities: str
) -> Mistake:
    """Return a mistake in the states: `change` yields the wrong states."""

    def answers(question: Question) -> Iterator[Array]:
        for states in change(question.states):
            yield question.answer(states=states)

    return Mistake(name, sentence, answers, frozenset(quantities) or None)


def of_systems(
    name: str, sentence: str, *systems: type[SpatialState], quantities: tuple[str, ...] = ()
) -> Mistake:
    """Return a mistake in the equations: classes with wrong methods."""

    def answers(question: Question) -> Iterator[Array]:
        for system in systems:
            yield question.answer(system=system)

    return Mistake(name, sentence, answers, frozenset(quantities) or None)


def of_answers(
    name: str, sentence: str, change: Callable[[Array], Iterator[Array]], *quantities: str
) -> Mistake:
    """Return a mistake in the answer: `change` yields the wrong answers of a right one."""
    return Mistake(
        name,
        sentence,
        lambda question: change(question.truth),
        frozenset(quantities) or None,
    )


def with_bodies(model: SpatialModel, change: Callable[[Any], Any]) -> SpatialModel:
    """Return a model with each body changed; bodies that become None are left out."""
    changed = (change(body) for body in model.bodies)
    return replace(model, bodies=tuple(body for body in changed if body is not None))
