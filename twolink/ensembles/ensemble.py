"""An ensemble: the scenes of its runs, the quantities to keep, and the required accuracy.

It is plain data: every worker receives it, and it determines every run.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from typing import Any

from twolink.ensembles.axes import Array, Runs
from twolink.ensembles.family import Family
from twolink.ensembles.quantity import Quantity, Variable
from twolink.errors import ParameterError
from twolink.text import quoted


@dataclass(frozen=True)
class Ensemble:
    """The runs of a family of scenes, and the quantities that are kept of each.

    `accuracy` (rad, rad/s) is the global error allowed for states. With `refine` a run that is not
    accurate enough, or has an undecided verdict, is repeated in longer precision. Equal
    `document`s describe equal ensembles, unless they name different URDFs.
    """

    family: Family
    runs: Runs
    kept: tuple[Quantity, ...]
    accuracy: float
    duration: float
    refine: bool = False
    title: str = "untitled"
    document: dict[str, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        """Require quantities that can be kept, each variable once."""
        known = [axis.name for axis in self.runs.axes]
        for quantity in self.kept:
            quantity.check(self.family, self.duration)
            known += [variable.name for variable in quantity.variables]
        twice = next((name for name in known if known.count(name) > 1), None)
        if twice is not None:
            raise ParameterError(
                "the names of axes and kept quantities must be different; got"
                f" {quoted(twice)} twice"
            )
        self._check_names(known)

    def _check_names(self, known: list[str]) -> None:
        """Raise `ParameterError` if an axis has the name of another array or dimension."""
        dimensions = {place.name for own in self.variables for place in own.dimensions}
        reserved = (*RESERVED, *sorted(dimensions))
        taken = next((name for name in known if name in reserved), None)
        if taken is not None:
            raise ParameterError(
                f"the names of axes must not be those of results ({', '.join(reserved)}); got"
                f" {quoted(taken)}"
            )

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The variables of the kept quantities, and those of every result."""
        own = tuple(variable for quantity in self.kept for variable in quantity.variables)
        return (*own, *_OF_EVERY_RUN)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on properties of a URDF that are assumed or not simulated in any run."""
        return self.family.scene(self.family.values).notes

    @property
    def fingerprint(self) -> str:
        """A hash (SHA-256) of all that determines the results, and of the text of a URDF."""
        text = json.dumps(self.document, sort_keys=True) + self.family.urdf
        return hashlib.sha256(text.encode()).hexdigest()

    def values(self, first: int, last: int) -> Array:
        """Return the value of each axis in the runs from `first` to before `last`: (n, axes)."""
        return self.runs.values(first, last)


PRECISIONS_OF_RUNS = ("none", "double", "long double", "quadruple")

_OF_EVERY_RUN = (
    Variable("error", "largest global error of q (rad) and u (rad/s), measured", "rad"),
    Variable("precision", "precision of the run", flags=PRECISIONS_OF_RUNS, dtype="u1"),
    Variable("limit", "limit of work that ended the run or kept it from the accuracy", "s"),
)

TEXTS = {
    "reason": "why a run failed, empty if it did not",
    "notes": "what the laws of contact or the work leave open in a run, one sentence a line",
}
"""The arrays of texts, and their descriptions."""

RESERVED = (*(variable.name for variable in _OF_EVERY_RUN), *TEXTS, "done", "run", "draw")
"""Names of arrays and dimensions in results that no axis may have."""
