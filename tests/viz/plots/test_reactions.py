"""Plots of reactions show those of the trajectory."""

import numpy as np
import pytest

from twolink.viz.plots.reactions import reactions


def test_reactions_are_the_trajectorys(run):
    trajectory = run("free_fall")
    for axes, joint, force in zip(
        reactions(trajectory).axes, "AB", trajectory.reactions(), strict=True
    ):
        lines = {line.get_label(): line for line in axes.lines}
        for component, name in zip(force, "xy", strict=True):
            times, drawn = lines[f"${joint}_{name}$"].get_data()
            assert drawn[np.searchsorted(times, trajectory.t)] == pytest.approx(component)
        assert axes.get_ylabel() == f"force at {joint} (N)"


def test_reactions_of_two_motions_share_axes(run):
    trajectory = run("stick_slip")
    above, _ = reactions(trajectory, "dark", {"again": trajectory}).axes
    assert len(above.lines) == 4
