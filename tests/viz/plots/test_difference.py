"""Differences of two motions: where they are known, in their units."""

from dataclasses import replace

import numpy as np
import pytest

from twolink.errors import PictureError
from twolink.simulation import simulate
from twolink.viz.plots.difference import difference


@pytest.mark.slow
def test_the_difference_of_neighbours_grows_from_their_start(run):
    one = run("free_fall")
    two = simulate(replace(one.scene, q=(1e-6, 0.0)), samples=200)
    made = difference(one, "light", {"nearby": two})
    q, u, D = (axes.lines[0].get_data() for axes in made.axes)
    assert q[1][0] == pytest.approx(1e-6)
    assert q[1][-1] > 100 * q[1][0]
    at = one.at(q[0])[0] - two.at(q[0])[0]
    assert q[1] == pytest.approx(np.abs(at).max(axis=0))
    assert len(u[0]) == len(D[0]) == len(q[0])
    assert [axes.get_ylabel() for axes in made.axes] == [
        "difference of q (rad)",
        "difference of u (rad/s)",
        "distance of D (m)",
    ]


def test_a_note_states_that_motions_are_equal(run):
    made = difference(run("free_fall"), "light", {"again": run("free_fall")})
    assert "Equal at all times." in made.get_supxlabel()


def test_samples_at_the_same_times_suffice(run):
    one = replace(run("free_fall"), _dense=None)
    two = replace(one, q=one.q + 1e-3)
    times, values = difference(one, "light", {"off": two}).axes[0].lines[0].get_data()
    assert np.array_equal(times, one.t)
    assert values == pytest.approx(1e-3)


def test_motions_that_cannot_be_compared_are_refused(run):
    one = replace(run("free_fall"), _dense=None)
    other = replace(one, t=one.t * 0.999, q=one.q, u=one.u)
    with pytest.raises(PictureError, match="must have samples at the same times"):
        difference(one, "light", {"other": other})
    with pytest.raises(PictureError, match="must be that of 2 motions; got 1"):
        difference(one)
