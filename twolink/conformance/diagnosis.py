"""Diagnosis: the mistakes whose answers are an engine's answers, and those that explain most."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.conformance.answer_mistakes import ANSWER_MISTAKES
from twolink.conformance.bounds import EPSILONS, ROUNDINGS
from twolink.conformance.mistakes import Mistake, Question
from twolink.conformance.model_mistakes import MODEL_MISTAKES
from twolink.conformance.quantities import QUANTITIES
from twolink.conformance.spatial import FLOATS, SpatialModel
from twolink.conformance.urdf_model import model_of_parameters, model_of_urdf
from twolink.conformance.vectors import Group, Vector
from twolink.engines.messages import Precision
from twolink.verification.tolerance import EPSILON

Array = NDArray[np.float64]

MISTAKES: dict[str, Mistake] = {
    mistake.name: mistake for mistake in (*MODEL_MISTAKES, *ANSWER_MISTAKES)
}

BINARY32: Precision = "binary32"
SENTENCES = {
    **{name: mistake.sentence for name, mistake in MISTAKES.items()},
    BINARY32: "the engine computes in binary32, and declares binary64",
    "late-output": "the values of a motion are late by one time",
    "springs-dropped": "the springs of the joints do not act",
}
"""A sentence for each diagnosis, by its name."""

# A mistake must leave so little of an engine's error unexplained, or no more than the rounding of
# the mistaken engine: its numbers may be larger than the right ones.
_UNEXPLAINED = 0.01
_ROUNDING = 8.0


def causes(
    vector: Vector,
    group: Group,
    answer: Array,
    *,
    from_urdf: bool,
    precision: Precision,
    single: bool = False,
) -> tuple[str, ...]:
    """Return the names of the mistakes whose answers are an engine's answer.

    `answer` has its components in the chain's frame; `single` states that the engine's numbers are
    numbers of binary32. A right answer has no causes.
    """
    if not np.isfinite(answer).all():
        return ()
    question = _question(vector, group, from_urdf=from_urdf)
    epsilon = EPSILONS[precision]
    allowed = np.array(vector.bound, dtype=float) * (epsilon / EPSILON)
    error = np.abs(answer - question.truth)
    if (error <= allowed).all():
        return ()
    in_single = np.array(vector.bound, dtype=float) * (EPSILONS[BINARY32] / EPSILON)
    if single and precision != BINARY32 and (error <= in_single).all():
        return (BINARY32,)
    tried = _Answer(
        answer, error, allowed, epsilon, nothing=bool((np.abs(answer) <= allowed).all())
    )
    # Most mistakes are ruled out by the worst state alone.
    where = _where_worst(error, first_too=question.quantity.up_to_constant)
    screen, part = question.at(where), tried.at(where)
    return tuple(
        mistake.name
        for mistake in MISTAKES.values()
        if any(map(part.is_explained_by, mistake.wrong(screen)))
        and any(map(tried.is_explained_by, mistake.wrong(question)))
    )


def explanation(found: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    """Return one cause for each test, so that few causes explain all tests.

    `found` has the names of possible causes by test. The cause that explains most tests is taken
    first; of equal ones, the first in `SENTENCES`.
    """
    left = {test: names for test, names in found.items() if names}
    chosen: dict[str, str] = {}
    while left:
        counts = {name: sum(name in names for names in left.values()) for name in SENTENCES}
        best = max(counts, key=lambda name: counts[name])
        chosen |= {test: best for test, names in left.items() if best in names}
        left = {test: names for test, names in left.items() if best not in names}
    return chosen


def flat_model(group: Group, *, from_urdf: bool) -> SpatialModel:
    """Return the model of a group in float64."""
    if from_urdf:
        assert group.urdf is not None
        assert group.frame is not None
        return model_of_urdf(
            group.urdf,
            FLOATS,
            plane=(group.frame.x, group.frame.y),
            origin=group.frame.origin,
            gravity=group.gravity,
        )
    assert group.parameters is not None
    return model_of_parameters(group.parameters.model_dump(), FLOATS)


def _question(vector: Vector, group: Group, *, from_urdf: bool) -> Question:
    states: dict[str, Any] = vector.states.model_dump(exclude_none=True)
    return Question(
        QUANTITIES[vector.quantity],
        flat_model(group, from_urdf=from_urdf),
        {name: np.array(rows, dtype=float) for name, rows in states.items()},
        np.array(vector.values, dtype=float),
    )


@dataclass(frozen=True)
class _Answer:
    """An answer, its error and bound, and ε of the engine.

    `nothing` states that all of the answer is zero within its bound.
    """

    values: Array
    error: Array
    allowed: Array
    epsilon: float
    nothing: bool

    def at(self, where: list[int]) -> _Answer:
        """Return the answer in some of the states."""
        return replace(
            self, values=self.values[where], error=self.error[where], allowed=self.allowed[where]
        )

    def is_explained_by(self, wrong: Array) -> bool:
        """Return whether a wrong answer is this one, within rounding and far within the error.

        An answer that cannot be distinguished from zero is that of mistakes that give zero, and not
        of all that give something small.
        """
        if not np.isfinite(wrong).all():
            return False
        if self.nothing and (np.abs(wrong) > self.allowed * (EPSILON / self.epsilon)).any():
            return False
        rest = np.abs(self.values - wrong)
        # A wrong answer may be far larger than the right one, and so is its rounding.
        size = ROUNDINGS * self.epsilon * np.abs(wrong).max()
        rounding = _ROUNDING * (self.allowed + size)
        return bool((rest <= rounding).all() and rest.max() <= _UNEXPLAINED * self.error.max())


def _where_worst(error: Array, *, first_too: bool) -> list[int]:
    """Return the state of the largest error, after the first one if that is needed."""
    worst = int(error.reshape(len(error), -1).max(axis=1).argmax())
    return [0, worst] if first_too and worst else [worst]
