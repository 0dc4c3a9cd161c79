"""The contract of a kept quantity: the variables that it adds to the results.

A quantity is a small frozen object of the keys of a sweep file. For runs in lanes it makes an
accumulator, which sees every block of their motions and returns the values at the end. The
quantities that can be kept are registered in `twolink.ensembles.quantities`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Block, Ends, Lanes, Spans
from twolink.ensembles.family import Family

Array = NDArray[np.float64]


class Dimension(NamedTuple):
    """A dimension of a variable beside that of the runs: its name and its length."""

    name: str
    size: int


@dataclass(frozen=True)
class Variable:
    """An array of the results: an entry, or one for each place of `dimensions`, in each run.

    A `flags` variable has small whole numbers, which stand for words; others are float64, with NaN
    where there is no value. A run that ended early has no value of a variable `of_end`: of one with
    flags, no flag of `flags_of_end`, but the first one instead.
    """

    name: str
    words: str
    units: str = ""
    dimensions: tuple[Dimension, ...] = ()
    flags: tuple[str, ...] = field(default=())
    dtype: str = "f8"
    of_end: bool = True
    flags_of_end: tuple[str, ...] = ()

    def needs_end(self, value: Any) -> bool:
        """Return whether a run of this value must have reached its end."""
        if self.flags:
            return self.flags[int(value)] in self.flags_of_end
        return self.of_end

    @property
    def fill(self) -> Any:
        """The value in rows that are not known."""
        return np.nan if self.dtype == "f8" else 0

    def empty(self, runs: int) -> Array:
        """Return an array for runs, without values."""
        shape = (runs, *(dimension.size for dimension in self.dimensions))
        return np.full(shape, self.fill, self.dtype)


class Accumulator(ABC):
    """The values of a quantity in lanes, as far as blocks of their motions have been added."""

    @abstractmethod
    def add(self, block: Block) -> None:
        """Add the next steps of all lanes."""

    @abstractmethod
    def values(self, ends: Ends) -> dict[str, Any]:
        """Return the values by the names of their variables, the lane first."""

    def undecided(self) -> Any:
        """Return which lanes a more precise run could decide, shape (lanes,); none by default."""
        return False

    def rounding(self) -> Any:
        """Return the errors of values beside those of their runs (rad), shape (lanes,), or 0."""
        return 0.0

    def open_spans(self, spans: Spans) -> Any:
        """Return in which intervals steps are needed, shape (m, n); by default in none."""
        return np.zeros(spans.errors.shape, bool)

    def known(self) -> Any:
        """Return which lanes need no more of their motions, shape (lanes,); none by default."""
        return False


class Quantity(ABC):
    """A quantity that is kept of each run."""

    of_state = True
    """Whether its error is that of the state, so that the accuracy of the runs counts."""

    of_steps = True
    """Whether it needs all steps of the motion."""

    of_spans = False
    """Whether it needs the steps in some intervals, as `Accumulator.open_spans` says."""

    @property
    @abstractmethod
    def variables(self) -> tuple[Variable, ...]:
        """The variables that it adds to the results."""

    @abstractmethod
    def accumulator(self, lanes: Lanes) -> Accumulator:
        """Return an accumulator for runs in lanes, at their start."""

    def check(self, family: Family, duration: float) -> None:  # noqa: B027
        """Raise `ParameterError` where it cannot be kept of these scenes; by default nowhere."""
