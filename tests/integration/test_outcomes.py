"""How runs end: on time, or with a sentence that says where and why they did not."""

import heyoka as hy
import numpy as np
import pytest

from twolink.errors import IntegrationError, SimulationError
from twolink.integration.outcomes import (
    check_arrival,
    check_outcome,
    failed_lanes,
    failure_of,
    last_time,
)

X, Y = hy.make_vars("x", "y")
OUTCOMES = hy.taylor_outcome
# x = 1/(1 - t), which ends at 1 s.
BLOW_UP = [(X, X**2), (Y, hy.expression(0.0))]


def test_the_last_time_is_the_end_of_the_last_step():
    """Times of an integrator are sums of steps, which need not be the end exactly."""
    integrator = hy.taylor_adaptive([(X, Y), (Y, -X)], [0.0, 1.0])
    reached = last_time(integrator, 0.25, [0.0, 1.0], 1.75, 0.1)
    assert reached == pytest.approx(1.75, abs=1e-15)
    assert integrator.state[0] == pytest.approx(np.sin(1.5), abs=1e-14)


def test_the_last_time_of_a_motion_without_an_end_is_before_it():
    integrator = hy.taylor_adaptive(BLOW_UP, [1.0, 0.0])
    assert last_time(integrator, 0.0, [1.0, 0.0], 2.0, 0.5) == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("outcome", [OUTCOMES.time_limit, OUTCOMES.success, OUTCOMES.step_limit])
def test_steps_that_succeed_pass(outcome):
    check_outcome(outcome, 1.0)


def test_a_run_has_arrived_only_at_its_time_limit():
    check_arrival(OUTCOMES.time_limit, 2.0, 2.0)
    with pytest.raises(IntegrationError, match=r"beyond 1\.5 s \(success\); .* until 2 s"):
        check_arrival(OUTCOMES.success, 1.5, 2.0)


def test_a_state_that_is_not_finite_is_named():
    reason = failure_of(OUTCOMES.err_nf_state)
    assert "not finite" in reason
    with pytest.raises(SimulationError, match=rf"failed at 0\.25 s \({reason}\)"):
        check_outcome(OUTCOMES.err_nf_state, 0.25)
    with pytest.raises(IntegrationError, match=reason):
        check_arrival(OUTCOMES.err_nf_state, 0.25, 1.0)


def test_only_the_lane_that_fails_has_failed():
    """heyoka ends all lanes where one fails; the others have another outcome."""
    starts = [[1.0, 1e-3, 0.5, 1e-3], [0.0] * 4]
    integrator = hy.taylor_adaptive_batch(BLOW_UP, starts)
    integrator.propagate_until([1.5] * 4)
    assert failed_lanes(integrator).tolist() == [True, False, False, False]
