"""How runs of heyoka's integrators end: whether a run has arrived, why not, and at which time."""

from __future__ import annotations

from typing import Any

import numpy as np

from twolink.errors import IntegrationError, SimulationError
from twolink.optional import heyoka


def last_time(integrator: Any, time: Any, state: Any, end: Any, cap: Any) -> Any:
    """Return the last time (s) that an integrator reaches from a time and a state to an end."""
    integrator.time, integrator.state[:] = time, state
    reached = time

    def note(stepped: Any) -> bool:
        nonlocal reached
        reached = stepped.time
        return True

    integrator.propagate_until(end, max_delta_t=cap, callback=note)
    return reached


def check_arrival(outcome: Any, reached: float, last: float) -> None:
    """Raise `IntegrationError` unless a run that has reached a time (s) is at its last one."""
    if outcome != heyoka().taylor_outcome.time_limit:
        raise IntegrationError(
            f"the motion could not be integrated beyond {reached:.6g} s ({failure_of(outcome)}); it"
            f" must stay finite, and its loads smooth, until {last:.6g} s"
        )


def failure_of(outcome: Any) -> str:
    """Return in words why a run of heyoka has ended early."""
    if outcome == heyoka().taylor_outcome.err_nf_state:
        return "the state, a load or a derivative of a load by time is not finite there"
    return str(outcome.name)


def check_outcome(outcome: Any, reached: Any) -> None:
    """Raise `SimulationError` unless a step, or steps, that reached a time (s) succeeded."""
    outcomes = heyoka().taylor_outcome
    if outcome not in (outcomes.success, outcomes.time_limit, outcomes.step_limit):
        raise SimulationError(
            f"the motion must stay finite, and its loads smooth; the integration failed at"
            f" {float(reached):.6g} s ({failure_of(outcome)})"
        )


def failed_lanes(integrator: Any) -> Any:
    """Return which lanes of a batch integrator have a state that is not finite, shape (lanes,).

    heyoka ends the other lanes of the batch, too; those have not failed.
    """
    failure = heyoka().taylor_outcome.err_nf_state
    return np.array([result[0] == failure for result in integrator.propagate_res])
