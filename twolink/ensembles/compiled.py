"""One compiled system for all runs of an ensemble, which differ in run-time parameters.

The integrator takes steps of a fixed number of runs at once, in lanes of SIMD registers. A run
whose lane has neighbours with other starts has the same bits (tests/ensembles/test_following.py),
provided that the number of lanes is the same: it is fixed, and lanes without a run repeat another.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Lanes
from twolink.ensembles.numbers import numbers_in, with_numbers
from twolink.errors import SimulationError, TwolinkError
from twolink.integration.expressions import plain
from twolink.integration.precisions import PRECISIONS
from twolink.names import EquationsName
from twolink.optional import heyoka
from twolink.simulation.pool import IntegratorPool
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.values import Content

Array = NDArray[np.float64]

LANES = 32
"""Runs that are integrated at once. The callback that keeps a step costs as much as two lanes."""

FORMULATION: EquationsName = "momenta"
"""The equations of ensembles: those of the least cost."""


@dataclass(frozen=True)
class System:
    """The chain with rotors and the effects of one run, and which of their numbers are parameters.

    `varying` are the places of the parameters among all numbers, in rising order.
    """

    chain: Any
    effects: tuple[Any, ...]
    varying: tuple[int, ...]

    def lanes(self, numbers: Array, q: Array, u: Array, duration: float) -> Lanes:
        """Return runs side by side, with parameters of shape (parameters, lanes)."""
        chain, effects = self._with(list(numbers))
        return Lanes(chain, effects, q, u, duration)

    def integrator(self, order: int) -> IntegratorPool:
        """Return compiled integrators of an order, for `LANES` runs."""
        return _compiled(Content((self.chain,)), Content(self.effects), self.varying, order)

    def rates(self, q: Any, x: Any) -> Any:
        """Return the rates in the symbols of heyoka; raises `TypeError` where there are none."""
        chain, effects = self.with_symbols()
        return EQUATIONS[FORMULATION].rates(chain, effects, q, x, heyoka().time)

    @property
    def depends_on_time(self) -> bool:
        """Whether the rates are functions of the time beside the variables."""
        hy = heyoka()
        flat = [plain(rate) for pair in self.rates(*_symbols()) for rate in pair]
        clock = hy.make_vars("t")
        return "t" in hy.get_variables(hy.subs(flat, {hy.time: clock}))

    def check(self) -> None:
        """Raise `SimulationError` unless the equations can be written with its parameters."""
        try:
            self.rates(*_symbols())
            numbers = np.array(numbers_in((self.chain, self.effects))[0])[list(self.varying)]
            still = np.zeros((2, 2))
            lanes = self.lanes(np.tile(numbers[:, None], (1, 2)), still, still, 1.0)
            pair = still[0], still[1]
            EQUATIONS[FORMULATION].rates(lanes.chain, lanes.effects, pair, pair, 0.0)
        except (TypeError, ValueError, AttributeError, TwolinkError) as error:
            raise SimulationError(
                f"the equations have no form with parameters ({error})"
            ) from error

    def with_symbols(self) -> Any:
        """Return the chain and the effects with heyoka's parameters in place of numbers."""
        return self._with([heyoka().par[k] for k in range(len(self.varying))])

    def _with(self, parameters: list[Any]) -> Any:
        """Return the chain and the effects with parameters in place of numbers."""
        if not self.varying:
            return self.chain, self.effects
        numbers: list[Any] = list(numbers_in((self.chain, self.effects))[0])
        for place, parameter in zip(self.varying, parameters, strict=True):
            numbers[place] = parameter
        return with_numbers((self.chain, self.effects), iter(numbers))


def _symbols() -> tuple[Any, Any]:
    q1, q2, x1, x2 = heyoka().make_vars("q1", "q2", "x1", "x2")
    return (q1, q2), (x1, x2)


@functools.lru_cache(maxsize=32)
def _compiled(
    chain: Content, effects: Content, varying: tuple[int, ...], order: int
) -> IntegratorPool:
    """Return compiled integrators, cached for ensembles of one scene."""
    q, x = _symbols()
    system = System(chain.objects[0], effects.objects, varying)
    first, second = system.rates(q, x)
    integrator = heyoka().taylor_adaptive_batch(
        list(zip((*q, *x), (*first, *second), strict=True)),
        np.zeros((4, LANES)),
        tol=PRECISIONS["double"].step_tolerance(order),
        # Loops, where unrolled code would take seconds to compile, and would be no faster.
        compact_mode=True,
    )
    return IntegratorPool(integrator)
