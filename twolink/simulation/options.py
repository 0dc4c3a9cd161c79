"""The options of a simulation, as one value."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from twolink.errors import SimulationError
from twolink.inputs import (
    as_count,
    as_number,
    as_word,
    check_callback,
    check_instance,
    nearest_float,
)
from twolink.integration.methods import MethodName, method_named
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.names import EquationsName
from twolink.simulation.smooth.equations import equations_named


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """The options of `simulate`.

    `accuracy` (rad and rad/s) and `method` default to those of the scene. `samples` is the number
    of evenly spaced samples. `progress` receives the name of the current run and its completed
    share. Each run respects `limits` of time and memory. Raises `ParameterError` for a value of the
    wrong kind, and `SimulationError` for one that no scene can be simulated with.
    """

    accuracy: float | None = None
    method: MethodName | None = None
    formulation: EquationsName = "momenta"
    samples: int = 501
    progress: Callable[[str, float], None] | None = None
    limits: Limits = DEFAULT_LIMITS

    def __post_init__(self) -> None:
        """Require values of the right kind."""
        check_callback("progress", self.progress, ("name", "share"))
        check_instance("limits", self.limits, Limits)
        if self.accuracy is not None:
            given = as_number("accuracy", self.accuracy)
            accuracy = nearest_float(given)
            if not 0 < accuracy < math.inf:
                raise SimulationError(f"accuracy must be positive and finite; got {given!r}")
            object.__setattr__(self, "accuracy", accuracy)
        if self.method is not None:
            method_named(as_word("method", self.method))
        equations_named(as_word("formulation", self.formulation))
        object.__setattr__(self, "samples", as_count("samples", self.samples, 2))
