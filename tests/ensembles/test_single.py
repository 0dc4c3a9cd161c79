from dataclasses import replace

import numpy as np
import pytest

from tests.ensembles.cases import axis, ensemble
from twolink.chain import Chain
from twolink.effects import Gravity, PdControl
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.extremes import Extremes
from twolink.ensembles.single import single
from twolink.ensembles.states import Samples
from twolink.limits import DEFAULT_LIMITS, UNLIMITED
from twolink.scene import Scene
from twolink.scene.names import scene_file
from twolink.simulation import simulate
from twolink.simulation.hybrid import measure, tolerances
from twolink.simulation.hybrid.measure import STOPS_SHORT

DROP = Scene.load(scene_file("drop"))


@pytest.mark.slow
def test_first_times_and_extremes_through_impacts_are_those_of_the_trajectory():
    asked = ensemble(
        scene="drop",
        axes=[axis("effects.surface.friction", 0.1, 0.4)],
        keep={
            "extremes": True,
            "first": [
                {"name": "folds", "of": "elbow", "level": -1.0},
                {"name": "rises", "of": "q1", "level": 2.5},
                {"name": "far", "of": "q1", "level": 20.0},
            ],
        },
    )
    rows = rows_of(asked, 0, 2).arrays
    for run, value in enumerate((0.1, 0.4)):
        truth = simulate(asked.family.scene([value]), samples=2001)
        angles = {"folds": truth.q[1] - truth.q[0] + 1.0, "rises": 2.5 - truth.q[0]}
        for name, left in angles.items():
            outside = np.flatnonzero(left < 0)
            assert rows[f"{name}_verdict"][run] == (1 if len(outside) else 2)
            if len(outside):
                time = rows[f"{name}_time"][run]
                assert truth.t[outside[0] - 1] <= time <= truth.t[outside[0]]
                q, _ = truth.at(time)
                exact = q[1, 0] - q[0, 0] + 1.0 if name == "folds" else 2.5 - q[0, 0]
                assert abs(exact) < 1e-9
        assert rows["far_verdict"][run] == 2
        assert (truth.q.max(axis=1) <= rows["largest"][run][:2] + 1e-8).all()
        assert (truth.q.max(axis=1) >= rows["largest"][run][:2] - 1e-3).all()


def test_a_run_that_ends_early_has_a_reason_and_the_times_before_it(monkeypatch):
    """A pendulum with friction has a mode for each half swing: four take about 3 s."""
    monkeypatch.setattr(tolerances, "MANY_JUMPS", 4)
    scene = {
        "chain": {"mass": [1.0, 1.0], "length": [1.0, 1.0]},
        "start": {"q": [1.0, 1.2]},
        "run": {"duration": 1000.0},
        "effects": {"gravity": {}, "joint_friction": {"kinetic": [0.02, 0.02]}},
    }
    first = [{"name": "far", "of": "q1", "level": 50.0}, {"name": "down", "of": "q1", "level": 1.5}]
    rows = rows_of(
        ensemble(scene=scene, keep={"final": True, "impacts": True, "first": first}), 0, 1
    )
    assert "is not followed further" in rows.reasons[0]
    assert rows.arrays["limit"][0] == DEFAULT_LIMITS.seconds
    assert np.isnan(rows.arrays["q"]).all()
    # No number of impacts is known without the end, and no verdict on it.
    assert np.isnan(rows.arrays["impacts"][0])
    assert rows.arrays["impacts_verdict"][0] == 0
    # It has not happened before the end of the run; the time after the end is unknown.
    assert rows.arrays["far_verdict"][0] == 0
    assert rows.arrays["down_verdict"][0] == 1
    assert 0 < rows.arrays["down_time"][0] < 1


@pytest.mark.slow
def test_errors_that_decay_between_distant_places_are_seen():
    """Strong control: after 0.1 s of 1500 s the motion, and the error of each run, have decayed."""
    control = PdControl((0.5, -1.0), (1e5, 3e4), (316.2, 94.9))
    chain, effects = Chain.uniform_bars(), (Gravity(), control)
    found = []
    for duration, accuracy in ((1500.0, 1e-3), (0.3, 1e-12)):
        scene = Scene(chain, (1.0, -2.0), (0.5, 1.0), duration, effects)
        found.append(single(scene, [Extremes()], accuracy, False, DEFAULT_LIMITS))
    ours, truth = found
    for name in ("smallest", "largest"):
        apart = np.abs(ours.values[name] - truth.values[name])
        # The elbow is a difference of two angles.
        assert (apart <= np.array([1, 1, 2]) * (ours.error + truth.error)).all()


@pytest.mark.slow
def test_errors_of_accurate_runs_have_the_rounding_of_extremes_and_samples():
    """A run in long doubles, whose own error is below the rounding of the values in float64."""
    scene = Scene(Chain.uniform_bars(), (1.0, -2.0), (0.5, 1.0), 1.0, (Gravity(),))
    kept = [Extremes(), Samples(101)]
    ours, truth = (single(scene, kept, a, False, DEFAULT_LIMITS) for a in (1e-15, 1e-22))
    apart = {name: np.abs(ours.values[name] - truth.values[name]).max() for name in ours.values}
    assert max(apart.values()) <= ours.error
    bare = single(scene, [], 1e-15, False, DEFAULT_LIMITS)
    # Extremes are found to a few roundings.
    assert bare.error < ours.error < 1e-13


def test_a_run_has_the_notes_of_its_trajectory():
    """The order of two impacts at one time is open: the other one changes u by 3.6 rad/s."""
    scene = ensemble(scene="elbow_and_tip").family.scene([])
    truth = simulate(scene)
    found = single(scene, (), scene.accuracy, False, DEFAULT_LIMITS)
    assert found.outcome == ("", truth.notes, False)
    assert "do not determine the order of simultaneous impacts" in truth.notes[0]


@pytest.mark.parametrize(("limits", "limited"), [(DEFAULT_LIMITS, True), (UNLIMITED, False)])
def test_a_run_that_a_limit_keeps_from_the_accuracy_is_limited(monkeypatch, limits, limited):
    monkeypatch.setattr(measure, "most_work", lambda duration: 10)
    scene = replace(DROP, accuracy=1e-16)
    found = single(scene, (), 1e-16, False, limits)
    truth = simulate(scene, limits=limits)
    assert found.outcome.limited == limited
    assert (STOPS_SHORT in found.outcome.notes) == (STOPS_SHORT in truth.notes) == limited
