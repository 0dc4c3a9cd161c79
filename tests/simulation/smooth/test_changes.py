"""The shortest time in which loads change, of pulses of known widths."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.smooth.pulses import (
    DampingPulse,
    Declared,
    Detent,
    Pulse,
    Ripple,
    Rooted,
    Switched,
)
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.simulation.smooth import changes
from twolink.simulation.smooth.changes import longest_for_loads, poses_near

BARS = Chain.uniform_bars()
REST = (0.0, 0.0), (0.0, 0.0)
DURATION = 10.0


def longest(*effects):
    return longest_for_loads(BARS, effects, *REST, DURATION)


@pytest.mark.parametrize("width", [3e-4, 1e-3, 1e-2, 0.1, 0.5])
@pytest.mark.parametrize("kind", [Pulse, DampingPulse])
def test_pulses_are_found_wherever_they_are(kind, width, random):
    for centre in random.uniform(0, DURATION, 10).tolist():
        assert 0.02 * width < longest(kind(5.0, centre, width)) <= 2 * width


def test_a_small_pulse_beside_a_large_load_is_found():
    pulse, ripple = Pulse(1e-6, 4.321, 1e-3), Ripple(0.5)
    assert longest(pulse, ripple) <= 2e-3


def test_smooth_loads_allow_steps_of_their_own_times():
    assert longest(Ripple(0.01)) > 1
    for frequency in (10.0, 300.0):
        assert 0.2 / frequency < longest(Ripple(frequency)) < 4 / frequency


@pytest.mark.parametrize("lanes", [(), (3,)])
def test_poses_near_a_start_begin_with_it(lanes):
    start = np.full((2, *lanes), 0.25), np.full((2, *lanes), -1.0)
    found = [np.array([*q, *u]) for q, u in poses_near(start)]
    assert np.array_equal(found[0], np.concatenate(start))
    assert all(each.shape == (4, *lanes) for each in found)
    assert min(np.abs(each - found[0]).min() for each in found[1:]) > 0.1


def test_loads_without_a_time_are_not_resolved_further():
    assert longest(Detent(5.0, 0.3, 1e-4)) == np.inf


def test_a_declared_time_is_taken(monkeypatch):
    monkeypatch.setattr(changes, "_found", None)
    assert longest(Declared(5.0, 3.0, 1e-9)) == 1e-9


def test_effects_of_the_package_are_not_looked_at(monkeypatch):
    monkeypatch.setattr(changes, "_found", None)
    assert longest(Gravity(), JointTorque((1.0, 0.0), (1.0, 0.0), (1e3, 0.0))) == np.inf


def test_each_piece_is_looked_at_in_its_own_interval():
    slow, quick = Pulse(5.0, 2.0, 0.5), Pulse(5.0, 8.0, 1e-3)
    assert longest(Switched(slow, quick, 5.0)) <= 2e-3
    assert longest(Switched(slow, replace(quick, centre=1.0), 5.0)) > 0.05


def test_pieces_declare_their_times():
    assert longest(Switched(Declared(5.0, 2.0, 1e-3), Pulse(5.0, 8.0, 0.5), 5.0)) == 1e-3


def test_poses_without_a_load_are_left_out():
    """One away from the start has the root of a negative number."""
    assert longest(Rooted(5.0, 3.0, 1e-3)) <= 2e-3


def test_loads_that_never_settle_divide_the_duration_by_a_number():
    assert longest(Pulse(5.0, DURATION / 2, 1e-12)) == DURATION / changes.MOST_STEPS


def test_lanes_have_the_shortest_time_of_all():
    widths = np.array([0.5, 1e-3, 0.1])
    q = u = np.zeros((2, 3))
    found = longest_for_loads(BARS, (Pulse(5.0, 4.0, widths),), tuple(q), tuple(u), DURATION)
    assert found == longest(Pulse(5.0, 4.0, 1e-3))
