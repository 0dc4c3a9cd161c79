"""The result of one integration, with events or without, and its cost."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from twolink.integration.operations import Operations
from twolink.integration.precisions import PrecisionName
from twolink.names import EquationsName
from twolink.scene import Scene

if TYPE_CHECKING:
    from twolink.simulation.hybrid.mode import Event, Impact

Array = NDArray[np.float64]

ENDS_EARLY = "the run that measures it ends early"
"""Why the error of a run is unknown from a time on, if nothing else is said."""


@dataclass(frozen=True)
class Statistics:
    """The cost of a simulation: of the run whose result is returned, and of all runs.

    `steps` of that run; `evaluations` of the rates, or of a series' terms, those of lanes side by
    side at once; times in s, that of the measurement of errors in `run_seconds`. Runs waited
    `compile_seconds` for compilation, which goes on beside them.
    """

    steps: int
    evaluations: int
    runs: int
    compile_seconds: float
    run_seconds: float


@dataclass(frozen=True)
class Lane:
    """The number of a lane of a bundle, and the size of the state of the first one."""

    number: int
    size: float


@dataclass(frozen=True)
class Recipe:
    """The order and the longest step (s) with which a run by Taylor series can be repeated.

    A corrected run has the precision in which the defects of its steps were evaluated, and one by a
    bundle its lane.
    """

    order: int
    longest_step: float
    evaluated_in: PrecisionName | None = None
    lane: Lane | None = None


@dataclass(frozen=True, kw_only=True)
class MotionRun(ABC):
    """A motion by Taylor series, at the requested times.

    `q` (rad) and `u` (rad/s) have shape (2, n), in the numbers of the precision. `steps` of the
    given order, none longer than `longest_step` (s), were taken, with `operations` for a term of
    the series. The run waited `compile_seconds` for compilation (0 if a similar scene was compiled
    before), and `run_seconds` were spent on integration.
    """

    scene: Scene
    formulation: EquationsName
    precision: PrecisionName
    longest_step: float
    q: Any
    u: Any
    steps: int
    order: int
    operations: int
    compile_seconds: float
    run_seconds: float

    @property
    def events(self) -> tuple[Event, ...]:
        """The starts of modes, empty for a smooth motion."""
        return ()

    @property
    def log(self) -> tuple[Impact, ...]:
        """The impacts, empty for a smooth motion."""
        return ()

    def decided(self, times: Any, errors: Any) -> MotionRun:
        """Return the run without notes on events that its judge has decided; it has none."""
        return self

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences that qualify the result."""
        return ()

    @property
    def longest_resolving_step(self) -> float:
        """The longest step (s) that would resolve a change which one of its steps passed.

        It is infinite if none did, or if the steps were not looked at.
        """
        return math.inf

    @property
    def evaluations(self) -> int:
        """The evaluated terms of the series."""
        return self.steps * self.order * self.operations

    @property
    def recipe(self) -> Recipe:
        """The settings that repeat the run."""
        return Recipe(self.order, float(self.longest_step))

    @property
    @abstractmethod
    def arithmetic(self) -> Operations:
        """The floating-point operations of the steps; without those of events and of samples."""

    @abstractmethod
    def step_times(self) -> Any:
        """Return the boundaries (s) of the steps, in float64 or long double.

        They are in long double if the rounding of states to float64 may change the forces by more
        than a rounding, as in a slide that jams.
        """

    @abstractmethod
    def dense(self) -> Callable[..., tuple[Any, Any]]:
        """Return q and u as functions of time (s): the polynomials of the steps of this run.

        A second argument, `side`, "left" or "right", selects the values at a jump.
        """
