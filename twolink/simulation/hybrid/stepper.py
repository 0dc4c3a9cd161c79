"""An integrator of a mode as the loop of an arc uses it: its steps, and views of its memory."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from twolink.optional import heyoka


class Stepper(NamedTuple):
    """An integrator with views of its own memory, which take longer to make than a step to begin.

    `state`, `tc` and `pars` are its variables, their Taylor coefficients in the last step, and its
    parameters. `values` has the variables one by one, in numbers of Python where there are such.
    """

    integrator: Any
    step: Callable[..., tuple[Any, Any]]
    state: Any
    tc: Any
    pars: Any
    values: Any

    @classmethod
    def of(cls, integrator: Any) -> Stepper:
        """Return the views of an integrator."""
        tc, pars = integrator.tc, integrator.pars
        is_long = tc.dtype not in (np.float64, np.longdouble)
        step = functools.partial(_step, integrator) if is_long else integrator.step
        state = integrator.state
        # A number of Python is read and compared twice as fast as one of NumPy.
        values = state.data if state.dtype == np.float64 else state
        return cls(integrator, step, state, tc, pars, values)


# Later (s) than the end of any step.
_NEVER = 1e300


def _step(integrator: Any, longest: Any = None, write_tc: bool = True) -> tuple[Any, Any]:
    """Take a step of at most `longest` (s), and return its outcome and length, as `step` does.

    Other threads run meanwhile, as they do not in heyoka's own `step`: in quadruple precision a
    step takes a millisecond.
    """
    hy = heyoka()
    if longest is None:
        outcome, _, length, *_ = integrator.propagate_until(
            type(integrator.time)(_NEVER), max_steps=1, write_tc=write_tc
        )
    else:
        outcome, _, length, *_ = integrator.propagate_until(
            integrator.time + 2 * longest, max_delta_t=longest, max_steps=1, write_tc=write_tc
        )
        # heyoka counts no step that was cut.
        length = length if length > 0 else longest
    complete = outcome == hy.taylor_outcome.step_limit
    return hy.taylor_outcome.success if complete else outcome, length
