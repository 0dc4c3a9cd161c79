from dataclasses import replace

import numpy as np
import pytest

from tests.viz.films import trajectory_of
from twolink.errors import PictureError
from twolink.simulation import Trajectory
from twolink.viz.motion import resolution, states_of
from twolink.viz.run import Run


def kept(trajectory, tmp_path):
    """The trajectory as a file gives it back: its samples, and no dense output."""
    replace(trajectory, recipe=None).save(tmp_path / "kept.npz")
    return Trajectory.load(tmp_path / "kept.npz")


def test_states_are_those_of_the_dense_output():
    trajectory = trajectory_of("free_fall", 2.0)
    times = np.linspace(0, 2, 37)
    for found, exact in zip(states_of(trajectory)(times), trajectory.at(times), strict=True):
        assert (found == exact).all()


@pytest.mark.parametrize(("name", "largest"), [("free_fall", 1e-6), ("bounce_to_rest", 2e-4)])
def test_cubics_interpolate_between_samples(name, largest, tmp_path):
    trajectory = trajectory_of(name, 2.0)
    loaded = kept(trajectory, tmp_path)
    times = np.linspace(0, 2, 1999)
    q, _ = states_of(loaded)(times)
    exact, _ = trajectory.at(times)
    assert np.abs(q - exact).max() < largest


def test_an_impact_between_samples_breaks_the_speeds_there(tmp_path):
    trajectory = trajectory_of("bounce_to_rest", 0.6)
    impact = trajectory.impacts[0]
    states = states_of(kept(trajectory, tmp_path))
    _, before = states(np.array([impact.time - 1e-9]))
    _, after = states(np.array([impact.time + 1e-9]))
    # Without the knot the speeds there are off by half of the impact's change, 2 rad/s.
    assert before[:, 0] == pytest.approx(impact.u[0], abs=0.02)
    assert after[:, 0] == pytest.approx(impact.u[1], abs=0.02)


def test_the_resolution_between_samples_is_reported(tmp_path):
    trajectory = trajectory_of("free_fall", 2.0, samples=101)
    loaded = kept(trajectory, tmp_path)
    times = np.linspace(0, 2, 1999)
    off = np.abs(states_of(loaded)(times)[0] - trajectory.at(times)[0]).max()
    assert resolution(trajectory) == 0
    assert off / 2 < resolution(loaded) < 10 * off
    run = Run("kept", loaded)
    assert run.resolution(float(loaded.t[3])) == 0
    assert run.resolution(float(loaded.t[3]) + 1e-3) == pytest.approx(2 * resolution(loaded))


def test_samples_too_far_apart_are_refused(tmp_path):
    coarse = trajectory_of("free_fall", 2.0, samples=11)
    with pytest.raises(PictureError, match=r"11 samples.*at most 0\.5 rad; got"):
        states_of(kept(coarse, tmp_path))
    single = replace(coarse, t=coarse.t[:1], q=coarse.q[:, :1], u=coarse.u[:, :1], _dense=None)
    with pytest.raises(PictureError, match="1 samples"):
        states_of(single)
