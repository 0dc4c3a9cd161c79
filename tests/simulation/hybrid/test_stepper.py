"""Steps in quadruple precision against heyoka's own, and beside other threads."""

from threading import Barrier

import pytest

from tests.simulation.hybrid import system_of
from tests.simulation.hybrid.test_compile import compiled
from twolink.effects.gravity import Gravity
from twolink.interruptible import side_by_side
from twolink.optional import heyoka


@pytest.mark.parametrize("longest", [None, 1e-3, 0.5])
def test_quadruple_steps_are_those_of_heyoka(longest):
    """By `step`, which keeps other threads waiting: the same state, length and outcome."""
    mode = compiled(system_of(Gravity(), precision="quadruple"))
    found = []
    for own in (True, False):
        with mode.pool.lend() as stepper:
            number = mode.number
            stepper.state[:] = [number(x) for x in (0.3, -0.2, 1.0, 2.0)]
            stepper.integrator.time = number(0.25)
            step = stepper.step if own else stepper.integrator.step
            given = () if longest is None else (number(longest),)
            outcome, length = step(*given, write_tc=True)
            now = stepper.integrator.time
            found.append([*stepper.state, length, now, *stepper.tc.ravel(), outcome.value])
    own, theirs = found
    complete = heyoka().taylor_outcome
    assert own[:-1] == theirs[:-1]
    assert {own[-1], theirs[-1]} <= {complete.success.value, complete.time_limit.value}


def test_other_threads_run_during_quadruple_steps():
    """A thread that held the interpreter would never see another one's step end in its own."""
    mode = compiled(system_of(Gravity(), precision="quadruple"))
    counts, seen, together = [0, 0], [0, 0], Barrier(2)

    def steps(place):
        def run(go_on):
            with mode.pool.lend() as stepper:
                together.wait()
                for _ in range(100):
                    before = counts[1 - place]
                    stepper.step(write_tc=True)
                    seen[place] += counts[1 - place] > before
                    counts[place] += 1

        return run

    side_by_side(steps(0), steps(1))
    assert sum(seen) > 0
