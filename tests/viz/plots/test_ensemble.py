"""Pictures of ensembles: which pixels have a time, and which say that there is none."""

import numpy as np
import pytest

from tests.ensembles.cases import axis, ensemble
from tests.viz.plots.svg import as_svg
from twolink import sweep
from twolink.ensembles.results import Results
from twolink.errors import PictureError
from twolink.viz.plots.ensemble import ensemble_plot

GRID = {"first": -1.4, "last": 4.2, "count": 5}
KEEP = {"first": [{"name": "flip", "of": "either"}]}
RUNS = {"duration": 2.0, "accuracy": 1e-6}


def swept(folder, **tables):
    return sweep(ensemble(runs=RUNS, **{"keep": KEEP, **tables}), folder / "a.zarr", workers=1)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("map")
    masses = axis("chain.mass.0", 1.0, 2.0, -1.0, name="m1")
    return swept(folder, title="A map", axes=[axis("start.q.0", grid=GRID, name="q1"), masses])


@pytest.mark.slow
def test_a_map_has_a_pixel_of_the_right_kind_for_each_run(found):
    drawn = ensemble_plot(found)
    axes = drawn.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("q1 (rad)", "m1 (kg)")
    labels = {tick.get_text() for tick in drawn.axes[1].get_yticklabels(which="both")}
    assert any(labels)
    # 0.2, and not a formula such as $2 \times 10^{-1}$.
    assert not any("$" in label for label in labels)
    kinds, times = (np.ma.filled(mesh.get_array(), np.nan) for mesh in axes.collections)
    grid = found.grid().sortby("m1")
    expected = grid["flip_time"].transpose("m1", "q1").values
    assert np.array_equal(times, expected, equal_nan=True)
    verdicts = grid["flip_verdict"].transpose("m1", "q1").values
    failed = grid["reason"].transpose("m1", "q1").values != ""
    assert failed.sum() == 5
    assert (kinds[failed] == 2).all()
    assert (kinds[~failed & (verdicts == 2)] == 0).all()
    assert np.isnan(kinds[~failed & (verdicts == 1)]).all()
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert words == ["never", "failed"]


@pytest.mark.parametrize("theirs", [1e-300, 1.0])
def test_a_picture_says_how_many_motions_miss_the_accuracy(found, monkeypatch, theirs):
    monkeypatch.setattr(Results, "accuracy", theirs)
    monkeypatch.setattr(Results, "keeps_states", True)
    words = " ".join(text.get_text() for text in ensemble_plot(found).texts)
    assert ("miss the accuracy 1e-300" in words) == (theirs < 1)


@pytest.mark.slow
def test_other_ensembles_have_a_distribution_of_times(tmp_path):
    angle = {"parameter": "start.q.0", "uniform": {"low": -1.5, "high": 0.0}}
    found = sweep(
        ensemble(runs={**RUNS, "draws": 40}, keep=KEEP, axes=[angle]),
        tmp_path / "a.zarr",
        workers=1,
    )
    (axes,) = ensemble_plot(found).axes
    (line,) = axes.lines
    times = np.sort(found.array("flip_time")[found.array("flip_verdict") == 1])
    x, y = line.get_data()
    assert x[1:-1].tolist() == times.tolist()
    assert y[-1] == len(times) / 40
    assert x[-1] == 2.0


@pytest.mark.slow
def test_results_without_times_have_no_picture(tmp_path):
    found = swept(tmp_path, keep={"final": True})
    with pytest.raises(PictureError, match=r"must have first times for a picture .*; got none"):
        ensemble_plot(found)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_picture_is_the_same_bytes_again(found, theme):
    assert as_svg(ensemble_plot(found, theme)) == as_svg(ensemble_plot(found, theme))
