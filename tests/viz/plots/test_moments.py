"""The times of a plot: events at the start are visible, and a long rest is not drawn."""

import numpy as np

from twolink.viz.plots.angles import angles
from twolink.viz.plots.contact import contact
from twolink.viz.plots.moments import at_rest_from, time_limits


def test_a_long_rest_is_not_drawn_and_the_axis_says_so(run):
    trajectory = run("painleve")
    rest = at_rest_from(trajectory)
    assert rest == trajectory.events[-1].entered
    assert np.all(trajectory.u[:, trajectory.t > rest] == 0)
    start, end = time_limits(trajectory)
    assert rest < end < 0.1 * trajectory.t[-1]
    assert start < 0
    label = angles(trajectory).axes[-1].get_xlabel()
    assert label == "time (s), at rest from 0.06237 s to 1 s"


def test_motions_that_go_on_are_drawn_to_the_end(run):
    for name in ("free_fall", "slide_and_stop"):
        trajectory = run(name)
        assert time_limits(trajectory) == (0.0, trajectory.t[-1])
    assert at_rest_from(run("free_fall")) is None
    assert angles(run("free_fall")).axes[-1].get_xlabel() == "time (s)"


def test_an_impulse_at_the_start_is_beside_the_axis(run):
    trajectory = run("painleve")
    assert trajectory.impacts[0].time == 0.0
    for axes in contact(trajectory).axes:
        left, right = axes.get_xlim()
        assert left < -0.01 * (right - left)
