"""A trajectory of a method without polynomials, and of one that replaces another."""

import sys

import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink.effects.gravity import Gravity
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation import simulate

SCENE = Scene(
    chain=GENERAL, q=(0.3, -0.4), u=(1.1, -0.7), duration=2.0, effects=(Gravity(),), accuracy=1e-11
)


def test_methods_without_polynomials_have_samples_alone():
    trajectory = simulate(SCENE, accuracy=1e-3, method="rk4")
    with pytest.raises(SimulationError, match="known only at its samples"):
        trajectory.at(0.5)
    with pytest.raises(SimulationError, match="known only at its samples"):
        trajectory.work()


def test_a_time_outside_of_a_run_is_told_from_its_end():
    trajectory = simulate(SCENE, accuracy=1e-3)
    with pytest.raises(SimulationError) as caught:
        trajectory.at([1.5, 2.0000001])
    assert str(caught.value) == "times must be 0 to 2 s; got times from 1.5 to 2.0000001 s"


def test_without_heyoka_scipy_is_used_and_noted(monkeypatch):
    exact = simulate(SCENE)
    monkeypatch.setitem(sys.modules, "heyoka", None)
    trajectory = simulate(SCENE, accuracy=1e-8)
    assert trajectory.method == "DOP853"
    assert "heyoka is not installed here" in trajectory.notes[0]
    assert trajectory.met
    assert np.abs(trajectory.q - exact.q).max() <= 1e-8
