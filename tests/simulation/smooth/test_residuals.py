"""Steps that passed a change of the loads."""

import numpy as np
import pytest

from tests.simulation.smooth.pulses import Detent, Kink, Logistic, Pulse
from tests.simulation.smooth.test_measure import HARD, TIMES, assert_measured, measured
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth import residuals as residuals_module
from twolink.simulation.smooth import runs
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


@pytest.mark.slow_but_first
@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("scene", [PULSE, DETENT], ids=["in time", "in an angle"])
def test_the_error_of_motions_with_pulses_is_bounded(scene, accuracy):
    exact = taylor_run(scene, SHORT, formulation="kane", precision="long double", longest_step=1e-3)
    assert_measured(scene, accuracy, SHORT, exact)


SMALL = Chain.uniform_bars((1e-6, 1e-6), (1e-3, 1e-3))


@pytest.mark.parametrize("order", [9, 13, 21])
@pytest.mark.parametrize("effects", [(), (Gravity(),)], ids=["free", "gravity"])
def test_steps_of_a_small_chain_have_the_residuals_of_their_series(effects, order):
    scene = Scene(SMALL, (0.3, -1.0), (5.0, 2.0), 0.3, effects)
    for formulation in ("momenta", "kane"):
        residuals = Residuals(scene, formulation)
        taylor_run(scene, [0.0, 0.3], formulation=formulation, order=order, observe=residuals)
        assert residuals.longest_step == np.inf


@pytest.mark.parametrize("accuracy", [1e-4, 1e-6, 1e-8])
def test_a_pulse_in_an_angle_of_a_small_chain_is_seen(accuracy):
    """Momenta of 1e-12 kg m²/s are small beside angles: only their speeds show the pulse."""
    times = np.linspace(0.0, 1.0, 31)
    scene = Scene(SMALL, (0.0, 0.0), (5.0, 5.0), 1.0, (Detent(1e-10, 1.0, 0.02),))
    exact = taylor_run(scene, times, formulation="kane", precision="long double", longest_step=1e-3)
    free = taylor_run(
        Scene(SMALL, (0.0, 0.0), (5.0, 5.0), 1.0, ()), times, formulation="kane", order=21
    )
    assert np.abs(exact.q - free.q).max() > 0.05
    assert_measured(scene, accuracy, times, exact)


@pytest.mark.slow
def test_steps_on_a_steep_load_have_the_residuals_of_their_series():
    """A load of 2000 N m in 1e-3 rad: round-off of the angle counts in the rates."""
    steep = acting(Gravity(), Detent(2000.0, 0.9, 1e-3), q=(0.3, 0.2))
    for formulation in ("momenta", "lagrange"):
        residuals = Residuals(steep, formulation)
        taylor_run(
            steep, SHORT, formulation=formulation, precision="quadruple", order=35,
            longest_step=1e-3, observe=residuals,
        )  # fmt: skip
        assert residuals.longest_step == np.inf


def test_a_pulse_is_seen_where_its_round_off_is_unknown(monkeypatch):
    """The rates are no numbers at states that are changed by roundings."""
    residuals = Residuals(DETENT, "momenta")
    rates, calls = residuals._rates, []

    def unknown_when_changed(values, times):
        calls.append(len(calls) % 2)
        return rates(values, times) if calls[-1] == 0 else np.full_like(values, np.nan)

    monkeypatch.setattr(residuals, "_rates", unknown_when_changed)
    taylor_run(DETENT, SHORT, formulation="momenta", order=13, observe=residuals)
    assert 1 in calls
    assert residuals.longest_step < 1


def test_loads_of_unknown_size_do_not_shorten_steps():
    """The slope of 1/exp(x) overflows where x is below −340."""
    logistic = acting(Gravity(), Logistic(400.0, 1.5), q=(0.3, 1.5))
    exact = taylor_run(
        logistic, SHORT, formulation="kane", precision="long double", longest_step=1e-3
    )
    found = assert_measured(logistic, 1e-9, SHORT, exact)
    assert found.kept.steps < 5000


def test_a_kink_that_no_step_resolves_ends_the_search(monkeypatch):
    """Its error is unknown, and the sentence names the remedy."""
    kinked = acting(Gravity(), Kink(0.1, 1.0, 1e-12), q=(0.3, 1.5))
    monkeypatch.setattr(runs, "MOST_STEPS", 2000)
    found = measured(kinked, 1e-6, SHORT)
    assert found.worst == np.inf
    assert "pass a change of the loads" in found.why_unknown
    assert len(found.runs) < 8
    trajectory = simulate(kinked, accuracy=1e-6)
    assert not trajectory.met
    assert "must declare its shortest_time" in trajectory.notes[-1]


def test_many_steps_are_checked_in_portions(monkeypatch):
    scene = acting(Gravity(), Detent(30.0, 1.0, 0.006), q=(0.3, 1.5))
    found = []
    for most in (10**6, 7):
        monkeypatch.setattr(residuals_module, "_AT_ONCE", most)
        residuals = Residuals(scene, "momenta")
        taylor_run(scene, SHORT, formulation="momenta", order=13, observe=residuals)
        found.append(residuals.longest_step)
    assert found[0] == found[1] < 1


def test_scenes_of_built_in_effects_have_no_observer():
    assert residuals_of(acting(Gravity()), "momenta") is None
    assert residuals_of(PULSE, "momenta") is not None


def test_roundings_of_two_large_angles_do_not_cancel_in_their_difference():
    """The error was unknown: equal roundings of both angles changed no load."""
    scene = Scene(BARS, (515.2, 514.9), (2e4, 4e3), 2e-3, (Pulse(0.0, 0.0, 1.0),))
    for order in (19, 21):
        residuals = Residuals(scene, "momenta")
        taylor_run(scene, [0.0, 2e-3], formulation="momenta", order=order, observe=residuals)
        assert residuals.longest_step == np.inf
