"""Steps in multiple precision, of pulses that they pass or see."""

import numpy as np
import pytest

from tests.simulation.smooth.pulses import Detent, Pulse
from twolink.accuracy.multiprecision import precise_motion
from twolink.accuracy.precise_steps import PreciseSteps
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.scene import Scene
from twolink.simulation.smooth.residuals import Residuals


def followed(scene, equations, digits, longest):
    """Return the steps of a run, and their number."""
    steps, count = PreciseSteps(scene, equations), 0
    motion = precise_motion(scene, equations, digits)
    while motion.integrator.time < scene.duration:
        left = motion.number(scene.duration) - motion.integrator.time
        motion.step(min(motion.number(longest), left))
        steps.add(motion.integrator)
        count += 1
    return steps, count


def scene(*effects):
    return Scene(Chain.uniform_bars(), (0.3, 0.2), (0.0, 0.0), 1.0, (Gravity(), *effects))


@pytest.mark.slow_but_first
@pytest.mark.parametrize("equations", ["momenta", "lagrange"])
@pytest.mark.parametrize(("digits", "longest", "passes"), [(20, 1.0, True), (20, 2.5e-4, False)])
def test_steps_that_pass_a_pulse_are_found(equations, digits, longest, passes):
    steps, count = followed(scene(Detent(2000.0, 0.9, 1e-3)), equations, digits, longest)
    assert steps.are_checked
    # Those of some hundred steps are looked at together.
    assert (count < 256) == passes
    needed = steps.longest_resolving_step()
    assert needed < 0.03 if passes else needed == np.inf


@pytest.mark.parametrize("digits", [20, pytest.param(200, marks=pytest.mark.slow)])
@pytest.mark.parametrize("equations", ["momenta", "lagrange"])
def test_steps_of_a_slow_load_have_the_residuals_of_their_series(equations, digits):
    """The coefficients of a series of order 230 alone leave the range of float64."""
    steps, _ = followed(scene(Pulse(3.0, 0.5, 0.3)), equations, digits, 1.0)
    assert steps.longest_resolving_step() == np.inf


def test_polynomials_are_those_of_the_steps(monkeypatch):
    seen = []
    monkeypatch.setattr(Residuals, "look", lambda self, *given: seen.append(given))
    given = scene(Pulse(3.0, 0.5, 0.3))
    steps, count = followed(given, "momenta", 20, 1.0)
    steps.longest_resolving_step()
    ((scaled, starts, lengths),) = seen
    assert scaled.shape[:2] == (count, 4)
    assert starts[1:] == pytest.approx((starts + lengths)[:-1], rel=1e-15)
    assert scaled[0, :2, 0].tolist() == [0.3, 0.2]
    assert scaled[1:, :, 0] == pytest.approx(scaled.sum(axis=2)[:-1], abs=1e-14)


def test_built_in_effects_are_not_looked_at():
    steps, _ = followed(scene(), "momenta", 20, 1.0)
    assert not steps.are_checked
    assert steps.longest_resolving_step() == np.inf
