"""The methods of SciPy's `solve_ivp`."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from twolink.errors import IntegrationError
from twolink.integration.method import Array, NumericMethod, Rates
from twolink.integration.operations import Beside

SciPyName = Literal["DOP853", "RK45", "Radau", "LSODA"]

# The least tolerance that SciPy accepts is near 2.3e-14.
_FINEST_TOLERANCE = 1e-13


@dataclass(frozen=True, kw_only=True)
class SciPyMethod(NumericMethod):
    """A method of SciPy by its name there; the setting of its parameter is both rtol and atol.

    `beside` has the operations of its attempts at steps beside the rates, None if they are unknown.
    """

    parameter = "tolerance"
    refinement = 0.1

    name: SciPyName
    beside: Beside | None = None

    def import_libraries(self) -> None:
        """Import SciPy's integrators."""
        importlib.import_module("scipy.integrate")

    def coarsest(self, accuracy: float, duration: float, between_samples: float) -> float:
        """Return the accuracy itself, within the tolerances that are of use."""
        return max(min(1e-3, accuracy), _FINEST_TOLERANCE)

    def finest(self, duration: float) -> float:
        """Return the least tolerance."""
        return _FINEST_TOLERANCE

    def integrate(
        self, rates: Rates, times: Array, start: list[float], setting: float
    ) -> tuple[Array, int]:
        """Return the variables at the times, and the number of steps or of evaluations."""
        from scipy import integrate

        solve_ivp: Any = integrate.solve_ivp
        span = (float(times[0]), float(times[-1]))
        # SciPy interpolates values between the ends, and does not report its steps.
        inside = times if len(times) > 2 else None
        # Numbers that overflow are refused below or by the caller, in a sentence.
        with np.errstate(all="ignore"):
            solution = solve_ivp(
                rates, span, start, method=self.name, t_eval=inside, rtol=setting, atol=setting
            )
        if not solution.success:
            raise IntegrationError(f"SciPy's {self.name} gives up: {solution.message}")
        if inside is not None:
            return solution.y, int(solution.nfev)
        return solution.y[:, [0, -1]], len(solution.t) - 1

    def beside_rates(self, steps: int, evaluations: int) -> int | None:
        """Return the operations beside the rates of a run without samples, None if unknown."""
        # A run with samples reports its evaluations as steps, some of them for the samples.
        if self.beside is None or steps == evaluations:
            return None
        return self.beside(steps, evaluations)
