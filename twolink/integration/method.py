"""The contract of an integration method."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from twolink.errors import SimulationError
from twolink.optional import heyoka

Array = NDArray[np.float64]
Rates = Callable[[float, Array], Array]
"""The rates of the variables, of shape (4,), at a time (s)."""

Parameter = Literal["order", "tolerance", "step"]


@dataclass(frozen=True, kw_only=True)
class Method(ABC):
    """An integration method, with one parameter that trades time for accuracy.

    `order` is None where it varies. `bytes_of_a_sample` is the memory of all runs at a sample and
    between two.
    """

    parameter: ClassVar[Parameter]
    locates_events: ClassVar[bool] = False
    bytes_of_a_sample: ClassVar[int]

    order: int | None = None
    implicit: bool = False
    symplectic: bool = False

    def import_libraries(self) -> None:  # noqa: B027
        """Import the libraries of the method that are installed, which a run imports otherwise."""


@dataclass(frozen=True, kw_only=True)
class TaylorSeries(Method):
    """Taylor series of the equations, which are compiled: in any order and precision."""

    parameter = "order"
    locates_events = True
    # Measured as 6.2 kB, at 100,000 samples.
    bytes_of_a_sample = 6500

    def import_libraries(self) -> None:
        """Import heyoka."""
        with suppress(SimulationError):
            heyoka()


@dataclass(frozen=True, kw_only=True)
class NumericMethod(Method):
    """A method that evaluates only rates, in double precision.

    The setting of its parameter is multiplied by `refinement` until a run is accurate enough.
    """

    refinement: ClassVar[float]
    bytes_of_a_sample = 1000

    @abstractmethod
    def coarsest(self, accuracy: float, duration: float, between_samples: float) -> float:
        """Return the first setting for an accuracy (rad, rad/s); times are in s."""

    @abstractmethod
    def finest(self, duration: float) -> float:
        """Return the least setting for a motion of a duration (s)."""

    def settings(self, accuracy: float, duration: float, between_samples: float) -> Iterator[float]:
        """Yield the settings to try in turn, from the coarsest; times are in s."""
        setting, finest = self.coarsest(accuracy, duration, between_samples), self.finest(duration)
        yield setting
        while setting * self.refinement >= finest:
            setting *= self.refinement
            yield setting

    @abstractmethod
    def integrate(
        self, rates: Rates, times: Array, start: list[float], setting: float
    ) -> tuple[Array, int]:
        """Return the variables at increasing times (s), of shape (4, n), and the number of steps.

        `start` has the variables at the first time. Raises `IntegrationError` if the method fails.
        """

    @abstractmethod
    def beside_rates(self, steps: int, evaluations: int) -> int | None:
        """Return the operations of a run beside its evaluations of the rates, None if unknown."""
