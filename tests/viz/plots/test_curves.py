"""Curves of several motions, and axes on which none is flat."""

from dataclasses import replace

import numpy as np
import pytest

from twolink.viz.plots.angles import angles
from twolink.viz.plots.curves import flat, line_style
from twolink.viz.plots.energy import energy
from twolink.viz.plots.style import PALETTES


def test_flat_curves_are_found():
    t = np.linspace(0, 1, 50)
    assert flat([1.1 + 1e-3 * t, 1.3 - 1e-3 * t])
    assert flat([t, 1e-2 * t])
    assert not flat([t, -0.5 * t])
    # A constant is flat on every axis, and a single curve on none.
    assert not flat([t, 0 * t])
    assert not flat([1e-9 * t])
    assert not flat([t, 1e-2 * t], every=True)
    assert flat([17.8 + 1e-2 * t, 1e-2 * t], every=True)


def test_motions_share_a_colour_and_differ_in_dashes():
    one, two = (line_style(PALETTES["light"], 0, motion) for motion in (0, 1))
    assert one["color"] == two["color"]
    assert one["linestyle"] != two["linestyle"]


def test_angles_that_would_be_flat_have_axes_of_their_own(run):
    trajectory = run("painleve")
    *angle_axes, speeds = angles(trajectory).axes
    assert [axes.get_ylabel() for axes in angle_axes] == ["angle (rad)"] * 2
    assert speeds.get_ylabel() == "speed (rad/s)"
    for axes, q in zip(angle_axes, trajectory.q, strict=True):
        low, high = axes.get_ylim()
        assert np.ptp(q) > 0.5 * (high - low)


def test_energies_that_would_be_flat_are_changes(run):
    trajectory = run("painleve")
    axes = energy(trajectory).axes[0]
    assert axes.get_ylabel() == "change of energy (J)"
    lines = {line.get_label(): line for line in axes.lines}
    V = lines["$V$, potential"].get_ydata()
    assert V[0] == 0
    assert V[-1] == pytest.approx(trajectory.potential_energy[-1] - trajectory.potential_energy[0])
    assert energy(run("free_fall")).axes[0].get_ylabel() == "energy (J)"


def test_several_motions_in_one_plot(run):
    one = run("free_fall")
    two = replace(one, q=one.q + 0.25)
    above, _ = angles(one, "light", {"nearby": two}).axes
    lines = {line.get_label(): line for line in above.lines}
    assert set(lines) == {"$q_1$", "$q_2$", "$q_1$, nearby", "$q_2$, nearby"}
    kept = trajectory_values(lines["$q_1$"], one)
    assert np.array_equal(kept, one.q[0])


def trajectory_values(line, trajectory):
    times, values = line.get_data()
    return values[np.searchsorted(times, trajectory.t)]
