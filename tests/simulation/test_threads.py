"""Threads: parallel runs give the same bits as sequential ones."""

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from twolink.accuracy.reference import reference
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.urdf import read_planar_urdf
from twolink.verification import verify

THREADS = 8
SMOOTH = Scene(Chain.uniform_bars(), (0.3, 0.5), (0.0, 0.0), 20.0, (Gravity(),), accuracy=1e-6)
EVENTS = replace(
    SMOOTH,
    duration=2.0,
    effects=(Gravity(), JointFriction((0.1, 0.1)), JointStop("B", -1.0, 1.0, 0.5)),
)


@pytest.fixture(autouse=True)
def switching_often():
    """Let threads take turns a thousand times as often as usual."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(5e-6)
    yield
    sys.setswitchinterval(before)


def side_by_side(function, arguments):
    with ThreadPoolExecutor(THREADS) as threads:
        return list(threads.map(function, arguments))


def starts(scene, count=16):
    """Return scenes that share compiled code, and differ in their start."""
    return [replace(scene, q=(0.3 + 0.01 * k, 0.5), u=(0.2, -0.1 * k)) for k in range(count)]


@pytest.mark.parametrize("scene", [SMOOTH, EVENTS], ids=["smooth", "events"])
def test_simulations_race(scene):
    def bits(started):
        found = simulate(started)
        return found.q.tobytes() + found.u.tobytes(), found.error, found.notes

    scenes = starts(scene)
    assert side_by_side(bits, scenes) == [bits(started) for started in scenes]


@pytest.mark.parametrize("scene", [SMOOTH, EVENTS], ids=["smooth", "events"])
def test_dense_output_races(scene):
    found = simulate(scene)
    times = [np.linspace(0, 0.1 * k, 50) for k in range(1, 17)]

    def bits(moments):
        q, u = found.at(moments)
        return q.tobytes() + u.tobytes()

    assert side_by_side(bits, times) == [bits(moments) for moments in times]


def test_verifications_race():
    read = read_planar_urdf(data_path("twolink.urdf"))

    def verdict(seed):
        return verify(read, states=50, seed=seed).comparisons

    assert side_by_side(verdict, range(8)) == [verdict(seed) for seed in range(8)]


def test_references_race():
    short = [replace(scene, duration=0.2) for scene in starts(SMOOTH, 4) + starts(EVENTS, 4)]

    def states(scene):
        return reference(scene, 20).states

    assert side_by_side(states, short) == [states(scene) for scene in short]


def test_a_run_inside_the_progress_of_another():
    """A callback may simulate the very scene that is on its way."""
    scene, expected = replace(EVENTS, duration=1.0), []

    def progress(stage, share):
        if len(expected) < 3:
            expected.append(simulate(replace(scene, q=(0.1, 0.9))).q.tobytes())

    found = simulate(scene, progress=progress)
    assert expected
    assert found.q.tobytes() == simulate(scene).q.tobytes()
    assert set(expected) == {simulate(replace(scene, q=(0.1, 0.9))).q.tobytes()}
