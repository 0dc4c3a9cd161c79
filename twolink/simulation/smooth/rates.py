"""The rates of a scene's variables at many states, in any precision."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.names import EquationsName
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.values import Content

# Levels of optimisation. It takes 10 ms more for quadruple numbers, and halves the time of a call.
_LEVELS: dict[PrecisionName, int] = {"long double": 1, "quadruple": 3}

Rates = Callable[[Any, Any], Any]
"""A function of states, shape (4, …), and of times (s), shape (…): the rates, shape (4, …)."""


def rates_of(scene: Scene, formulation: EquationsName, precision: PrecisionName) -> Rates:
    """Return the rates of a scene's variables as a function of arrays in a precision.

    In float64 NumPy evaluates the equations at once. In longer numbers it takes four times as long
    as code that heyoka compiles.
    """
    chain = scene.moving_chain
    if precision != "double":
        return _compiled(Content((chain,)), Content(scene.effects), formulation, precision)
    equations, effects = EQUATIONS[formulation], scene.effects

    def rates(states: Any, t: Any) -> Any:
        q, x = (states[0], states[1]), (states[2], states[3])
        found = np.empty_like(states)
        every = (rate for pair in equations.rates(chain, effects, q, x, t) for rate in pair)
        for place, rate in enumerate(every):
            found[place] = rate
        return found

    return rates


@functools.lru_cache(maxsize=64)
def _compiled(
    chain: Content, effects: Content, formulation: EquationsName, precision: PrecisionName
) -> Rates:
    """Return rates that heyoka compiles, cached for scenes that differ only in their start."""
    hy, number = heyoka(), PRECISIONS[precision].number
    (given,) = chain.objects
    q1, q2, x1, x2 = variables = hy.make_vars("q1", "q2", "x1", "x2")
    first, second = EQUATIONS[formulation].rates(
        given.convert(number), effects.objects, (q1, q2), (x1, x2), hy.time
    )
    every = [x if isinstance(x, hy.expression) else hy.expression(x) for x in (*first, *second)]
    function = hy.cfunc(every, variables, fp_type=number, opt_level=_LEVELS[precision])

    def rates(states: Any, t: Any) -> Any:
        flat = np.ascontiguousarray(states.reshape(4, -1))
        moments = np.ascontiguousarray(t.reshape(-1))
        return function(flat, time=moments, batch_parallel=False).reshape(states.shape)

    return rates
