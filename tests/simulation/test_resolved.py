"""Single runs over pulses of an effect of a user, against runs of short steps."""

import numpy as np
import pytest

from tests.simulation.smooth.pulses import Detent, Kink
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.surface import Surface
from twolink.scene import Scene
from twolink.simulation.motion import motion_run
from twolink.simulation.resolved import resolved_run
from twolink.simulation.shortened import UnseenError

FLOOR = Surface((0.0, 1.5), (0.0, -1.0), restitution=0.5)
TIMES = np.linspace(0.0, 1.0, 11)


def scene(*effects):
    return Scene(Chain.uniform_bars(), (0.3, 0.2), (0.0, 0.0), 1.0, (Gravity(), *effects))


@pytest.mark.parametrize("others", [(), (FLOOR,)], ids=["smooth", "with impacts"])
@pytest.mark.parametrize("precision", ["double", pytest.param("quadruple", marks=pytest.mark.slow)])
def test_pulses_are_resolved(precision, others):
    given = scene(Detent(2000.0, 0.9, 1e-3), *others)
    exact = motion_run(given, TIMES, formulation="kane", precision=precision, longest_step=2e-4)
    found = resolved_run(given, TIMES, formulation="lagrange", precision=precision)
    passed = motion_run(given, TIMES, formulation="lagrange", precision=precision)
    assert np.abs(found.q - exact.q).astype(float).max() < 1e-9
    assert np.abs(passed.q - exact.q).astype(float).max() > 1e-3
    assert len(found.log) == len(exact.log)


@pytest.mark.parametrize("others", [(), (FLOOR,)], ids=["smooth", "with impacts"])
def test_a_motion_without_pulses_is_that_of_its_scene(others):
    one = resolved_run(scene(*others), TIMES, formulation="kane", order=15)
    other = motion_run(scene(*others), TIMES, formulation="kane", order=15)
    assert np.array_equal(one.q, other.q)
    assert one.order == other.order == 15
    assert one.longest_resolving_step == np.inf


@pytest.mark.parametrize("others", [(), (FLOOR,)], ids=["smooth", "with impacts"])
def test_a_change_that_no_step_sees_is_an_error(monkeypatch, others):
    monkeypatch.setattr("twolink.simulation.resolved.MOST_STEPS_TO_RESOLVE", 500)
    with pytest.raises(UnseenError, match=r"steps of .* s pass a change of the loads"):
        resolved_run(scene(Kink(3.0, 0.5, 1e-12), *others), TIMES, formulation="lagrange")
