"""Rates at many states in all precisions, against the equations in single numbers."""

from contextlib import closing

import mpmath
import numpy as np
import pytest

from tests.simulation.smooth.test_measure import GENERAL, scene
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.compilation_thread import CompilationThread
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.rates import (
    compile_jacobians_ahead,
    jacobians_of,
    rates_of,
    wait_for_jacobians,
)

DAMPED = scene((0.3, -0.4), (0.1, 0.2), effects=(Gravity(), JointDamping((0.3, 0.2))))
STATES = np.array([[[0.3, 1.4]], [[-0.4, 2.0]], [[0.7, -0.1]], [[0.2, 0.5]]])


@pytest.mark.parametrize("formulation", EQUATIONS)
@pytest.mark.parametrize("precision", PRECISIONS)
def test_rates_have_the_digits_of_the_precision(precision, formulation):
    own = PRECISIONS[precision]
    states = own.lengthened(STATES)
    found = rates_of(DAMPED, formulation, precision)(states, own.lengthened(np.zeros((1, 2))))
    assert found.shape == states.shape
    assert found.dtype == states.dtype
    with mpmath.workdps(50):
        exact = EQUATIONS[formulation]
        for k in range(2):
            q1, q2, x1, x2 = (mpmath.mpf(float(x)) for x in STATES[:, 0, k])
            chain = GENERAL.convert(mpmath.mpf)
            rates = exact.rates(chain, DAMPED.effects, (q1, q2), (x1, x2), mpmath.mpf(0))
            for value, rate in zip(found[:, 0, k], [*rates[0], *rates[1]], strict=True):
                missed = abs(mpmath.mpf(str(value)) - rate)
                assert missed <= 64 * own.rounding * max(1, abs(rate))


def test_derivatives_are_compiled_in_a_thread_once():
    """A caller that waits for them finds them there."""
    own = scene((0.3, -0.4), (0.1, 0.2), effects=(Gravity(9.123),))
    asked = []

    class Noting(CompilationThread):
        def request(self, key, work):
            asked.append(key)
            super().request(key, work)

    with closing(Noting()) as thread:
        compile_jacobians_ahead(thread, own, "momenta")
        wait_for_jacobians(thread, own, "momenta")
        found = jacobians_of(own, "momenta")(STATES, np.zeros((1, 2)))
        compile_jacobians_ahead(thread, own, "momenta")
    assert len(asked) == 1
    assert found.shape == (4, 4, 1, 2)
