"""The plot of differences: every state, on the correct side of the tolerance."""

from dataclasses import replace

import numpy as np
import pytest

from twolink.verification.differences import Differences
from twolink.viz.plots.style import save
from twolink.viz.plots.verification import bins, histogram, in_rows, verification

STATES = 400


def made_up(seed=3, largest=0.02):
    random = np.random.default_rng(seed)

    def shares(zeros):
        values = largest * 10 ** -random.uniform(0, 3, STATES)
        values[:zeros] = 0.0
        values[-1] = largest
        return values

    pairs = (("Kane", "Pinocchio 4.1.0"), ("Lagrange", "Pinocchio 4.1.0"), ("Kane", "Lagrange"))
    return [
        *(Differences("mass matrix", *pair, shares(100)) for pair in pairs),
        *(Differences("gravity terms", *pair, np.zeros(STATES)) for pair in pairs),
        *(
            Differences(
                f"velocity of {point}", "twolink's kinematics", "Pinocchio 4.1.0", shares(0)
            )
            for point in ("C1", "D")
        ),
    ]


def test_points_share_a_row_in_which_the_largest_counts():
    found = made_up()
    rows = in_rows(found)
    assert list(rows) == ["mass matrix", "gravity terms", "velocity of C1, D"]
    (shares,) = rows["velocity of C1, D"].values()
    assert np.array_equal(shares, np.maximum(found[-2].shares, found[-1].shares))


@pytest.mark.parametrize("largest", [1e-6, 0.02, 3.0, 1e15, np.inf])
def test_every_state_is_counted(largest):
    for each in made_up(largest=largest if np.isfinite(largest) else 1.0):
        shares = each.shares.copy()
        if shares.any():
            shares[-1] = largest
        edges = bins([shares])
        assert edges[0] < 1 < edges[-1]
        assert histogram(shares, edges).sum() + (shares == 0).sum() == STATES


def test_lanes_show_the_counts_the_largest_and_the_zeros():
    found = made_up()
    made = verification(found)
    (axes,) = made.axes
    assert axes.get_xlabel() == "difference / tolerance"
    assert [text.get_text() for text in axes.get_yticklabels()] == list(in_rows(found))
    said = [text.get_text() for text in axes.texts]
    assert said.count("25 % equal") == 3
    assert said.count("100 % equal") == 3
    assert said.count("0 % equal") == 1
    largest = [line.get_xdata()[0] for line in axes.lines if line.get_label() == "_largest"]
    assert largest == pytest.approx([0.02] * 4)
    (tolerance,) = [line for line in axes.lines if line.get_label() == "_tolerance"]
    assert list(tolerance.get_xdata()) == [1.0, 1.0]
    # Heights of a lane's steps are in the ratio of the counts.
    edges = bins(shares for row in in_rows(found).values() for shares in row.values())
    counts = histogram(found[0].shares, edges)
    values, _, baseline = axes.patches[0].get_data()
    heights = baseline - np.asarray(values)
    known = counts[np.flatnonzero(counts)[0] : np.flatnonzero(counts)[-1] + 1]
    assert heights / heights.max() == pytest.approx(known / known.max())
    assert "400 states" in made.get_supxlabel()
    assert "0.02 of its tolerance" in made.get_supxlabel()
    key = {text.get_text() for text in axes.get_legend().get_texts()}
    assert "Lagrange − Pinocchio" in key


def test_a_disagreement_is_beyond_the_line():
    (axes,) = verification(made_up(largest=1e4)).axes
    largest = [line.get_xdata()[0] for line in axes.lines if line.get_label() == "_largest"]
    assert min(largest) > 1
    assert axes.get_xlim()[1] >= 1e4


@pytest.mark.slow_but_first
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_words_keep_clear_of_each_other(theme):
    made = verification(made_up(), theme)
    made.draw_without_rendering()
    (axes,) = made.axes
    boxes = [text.get_window_extent() for text in (*axes.texts, *axes.get_yticklabels())]
    assert not any(one.overlaps(other) for n, one in enumerate(boxes) for other in boxes[n + 1 :])


def test_the_key_is_not_cut():
    long = [replace(each, quantity="inverse dynamics, force on D") for each in made_up()[:3]]
    made = verification([*made_up(), *long])
    made.draw_without_rendering()
    (axes,) = made.axes
    key = axes.get_legend().get_window_extent()
    assert key.x0 >= 0
    assert key.x1 <= made.bbox.x1
    assert key.y1 <= made.bbox.y1


@pytest.mark.slow
def test_the_plot_is_the_same_file_twice(tmp_path):
    for name in ("one", "two"):
        save(verification(made_up()), tmp_path / f"{name}.svg")
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()
