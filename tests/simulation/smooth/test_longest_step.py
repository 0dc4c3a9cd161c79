"""No step passes a later event: a series whose last terms vanish suggests an endless step."""

import numpy as np
import pytest

from tests.simulation.smooth.pulses import Logistic
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.sampled_torque import SampledTorque
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid import configurations, judged, measure
from twolink.simulation.smooth.longest_step import default_longest_step

# t³ at the elbow of a straight chain at rest: q begins as t⁵, and goes on with t¹⁵.
SOFT = SampledTorque((0.0, 1.0, 2.0, 3.0, 4.0), (0.0,) * 5, (0.0, 1.0, 8.0, 27.0, 64.0), "cubic")


def scene(effects: tuple, u: tuple[float, float] = (0.0, 0.0)) -> Scene:
    return Scene(Chain.uniform_bars(), (0.0, 0.0), u, 4.0, effects)


def test_a_torque_that_grows_later_caps_the_steps():
    """At 4 s the torque is 64 N m: M⁻¹ (−64, 64) is 603 rad/s²."""
    assert default_longest_step(scene((SOFT,))) == pytest.approx(603.43**-0.5, rel=1e-4)


def test_steps_are_capped_by_the_start_if_loads_are_constant():
    assert default_longest_step(scene((Gravity(9.81),))) < 1
    assert default_longest_step(scene((), u=(4.0, 0.0))) == 0.25
    assert default_longest_step(scene(())) == 4.0


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9])
def test_accuracy_is_met_for_a_torque_that_begins_slowly(accuracy):
    """At low orders, too, the accuracy that is claimed is kept: against SciPy's, step by step."""
    rough = simulate(scene((SOFT,)), accuracy=accuracy, samples=5)
    other = simulate(scene((SOFT,)), accuracy=1e-8, samples=5, method="DOP853")
    assert np.abs(rough.q - other.q).max() <= accuracy + 1e-8


def test_without_the_cap_the_motion_is_silently_wrong(monkeypatch):
    monkeypatch.setattr(measure, "default_longest_step", lambda scene: scene.duration)
    monkeypatch.setattr(configurations, "_LOWEST_ORDER", 7)
    monkeypatch.setattr(judged, "differences", lambda first, second, times, accuracy: 0 * times)
    trajectory = simulate(scene((SOFT,)), accuracy=1e-3, samples=5)
    assert trajectory.met
    assert abs(trajectory.q[0, -1] - -29.364678) > 0.1


def test_a_chain_at_rest_has_no_shorter_step_than_its_duration():
    """A step of 1e300 s was taken 1e8 times."""
    at_rest = Scene(Chain.uniform_bars(), (0.0, 0.0), (0.0, 0.0), 1.7e308, ())
    assert default_longest_step(at_rest) > 1.6e308


def test_a_formula_that_overflows_inside_is_named():
    effect = Logistic(-2000.0, 1.0)
    with pytest.raises(SimulationError, match=r"got OverflowError \(.*\) from their formula at q"):
        default_longest_step(scene((effect,)))
