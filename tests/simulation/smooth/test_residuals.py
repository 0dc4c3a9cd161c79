"""Steps that passed a change of the loads."""

import numpy as np
import pytest

from tests.simulation.smooth.pulses import Detent, Pulse
from tests.simulation.smooth.test_measure import HARD, TIMES, measured, true_errors
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.scene import Scene
from twolink.simulation.smooth import changes, measure
from twolink.simulation.smooth.residuals import Residuals, residuals_of
from twolink.simulation.smooth.taylor import taylor_run

BARS = Chain.uniform_bars()


def acting(*effects, q=(0.0, 0.0)):
    return Scene(BARS, q, (0.0, 0.0), 3.0, effects)


SHORT = np.linspace(0.0, 3.0, 31)
PULSE = acting(Pulse(5.0, 1.3, 2e-3))
DETENT = acting(Gravity(), Detent(30.0, 1.0, 0.006), q=(0.3, 1.5))


@pytest.mark.parametrize("order", [9, 13, 21])
@pytest.mark.parametrize("name", HARD)
def test_steps_of_smooth_motions_have_the_residuals_of_their_series(name, order):
    for formulation in ("momenta", "kane"):
        residuals = Residuals(HARD[name], formulation)
        taylor_run(HARD[name], TIMES, formulation=formulation, order=order, observe=residuals)
        assert residuals.longest_step == np.inf


@pytest.mark.parametrize("order", [9, 21])
def test_a_step_over_a_change_is_seen(order):
    for scene, cap, passed in ((DETENT, 1.0, True), (DETENT, 2e-4, False)):
        residuals = Residuals(scene, "momenta")
        taylor_run(
            scene, SHORT, formulation="momenta", order=order, longest_step=cap, observe=residuals
        )
        assert (residuals.longest_step < cap) == passed


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("scene", [PULSE, DETENT], ids=["in time", "in an angle"])
def test_the_error_of_motions_with_pulses_is_bounded(scene, accuracy):
    exact = taylor_run(scene, SHORT, formulation="kane", precision="long double", longest_step=1e-3)
    found = measured(scene, accuracy, SHORT)
    assert found.worst <= accuracy
    assert np.all(true_errors(found.kept, exact) <= found.errors)


def test_a_run_that_passes_a_change_for_all_steps_has_no_error(monkeypatch):
    monkeypatch.setattr(changes, "_found", lambda *given: np.inf)
    monkeypatch.setattr(measure, "_REPETITIONS", 1)
    assert measured(DETENT, 1e-6, SHORT).worst == np.inf


def test_scenes_of_built_in_effects_have_no_observer():
    assert residuals_of(acting(Gravity()), "momenta") is None
    assert residuals_of(PULSE, "momenta") is not None
