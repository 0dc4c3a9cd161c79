from pathlib import Path

import numpy as np
import pytest
import zarr

from tests.ensembles.cases import axis, ensemble, starts, words_of
from twolink import Results, sweep
from twolink.errors import FileError, ParameterError

URDF = Path("models/import/valid/revolute.urdf").absolute()


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    asked = ensemble(
        title="A few",
        axes=[
            axis("effects.gravity.g", 1.6, 9.81, name="g"),
            {"parameter": "start.u.1", "uniform": {"low": 0.0, "high": 9.0}, "name": "speed"},
            axis("start.q.0", 0.0, 1.0, 2.0, name="q1"),
        ],
        runs={"duration": 2.0, "draws": 4, "accuracy": 1e-6},
        keep={"final": True, "first": [{"name": "flip"}]},
    )
    return sweep(asked, tmp_path_factory.mktemp("results") / "a.zarr", workers=1)


@pytest.mark.slow
def test_a_dataset_has_units_and_coordinates(found):
    flat = found.dataset()
    assert flat.sizes == {"run": 24, "link": 2}
    assert set(flat.coords) == {"g", "speed", "q1"}
    assert flat["u"].attrs["units"] == "rad s-1"
    assert flat["g"].attrs["units"] == found.grid()["g"].attrs["units"] == "m s-2"
    assert flat["g"].values[:4].tolist() == [1.6] * 4


@pytest.mark.slow
def test_a_grid_has_a_dimension_for_each_fixed_axis(found):
    grid = found.grid()
    assert grid["q"].dims == ("g", "q1", "draw", "link")
    chosen = grid.sel(g=9.81, q1=2.0, draw=3)
    flat = found.dataset()
    run = int(np.flatnonzero((flat["g"] == 9.81) & (flat["q1"] == 2.0))[3])
    assert (chosen["q"].values == flat["q"].values[run]).all()
    assert float(chosen["speed"]) == float(flat["speed"][run])


def test_runs_that_miss_the_accuracy_are_counted(found, monkeypatch):
    errors = np.sort(found.array("error"))
    assert found.missed == int((errors > found.accuracy).sum())
    monkeypatch.setattr(Results, "accuracy", float(errors[20]))
    assert found.missed == 3


def test_a_summary_counts_runs_errors_and_verdicts(found):
    summary = Results.load(found.path).summary()
    assert summary.title == "A few"
    rows = words_of(summary)
    assert "runs 24 of 24" in rows
    counts = np.bincount(found.array("flip_verdict"), minlength=3)
    assert f"flip {counts[0]} undecided, {counts[1]} happens, {counts[2]} never" in rows


def test_a_folder_without_results_is_refused(tmp_path):
    with pytest.raises(FileError, match="must be the result of a sweep; got another folder"):
        Results.load(tmp_path)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("eror", r"the name of an array must be one of .*; got 'eror' \(did you mean 'error'"),
        ("", "the name of an array must be one of"),
        (5, "the name of an array must be a string; got 5"),
    ],
)
def test_the_name_of_no_array_is_refused(found, name, sentence):
    with pytest.raises(ParameterError, match=sentence):
        found.array(name)


def test_results_that_are_gone_are_refused(tmp_path):
    gone = Results(tmp_path / "gone")
    for ask in (lambda: gone.array("q"), gone.dataset, gone.grid, gone.summary):
        with pytest.raises(FileError, match="there is no result of a sweep"):
            ask()


def test_a_summary_counts_the_runs_of_unknown_error(tmp_path):
    grid = {"first": -1.0, "last": -0.9, "count": 3}
    axes = [axis("start.q.0", grid=grid), axis("start.q.1", -1.5)]
    asked = ensemble(axes=axes, runs={"duration": 60.0}, keep={"final": True})
    found = sweep(asked, tmp_path / "a.zarr", workers=1)
    assert np.isinf(found.array("error")).all()
    rows = words_of(found.summary())
    assert "global error measured; too large to be known at the end of 3 runs" in rows
    assert any(row.endswith("met by 0 of 3") for row in rows)


def test_the_accuracy_counts_only_where_states_are_kept(tmp_path):
    """Of first times alone, runs are only as accurate as the verdicts require."""
    axes = [axis("start.q.0", 0.5, 3.0)]
    for name, keep in (("times", {}), ("states", {"final": True})):
        asked = ensemble(
            axes=axes, runs={"duration": 2.0}, keep={"first": [{"name": "flip"}], **keep}
        )
        found = sweep(asked, tmp_path / f"{name}.zarr", workers=1)
        words = " ".join(words_of(found.summary()))
        assert ("met by" in words) == (name == "states")
        assert ("as first times require" in words) == (name == "times")


def test_a_summary_has_the_notes_of_runs_and_of_the_scene(tmp_path):
    asked = ensemble(
        scene={
            "chain": {"urdf": str(URDF)},
            "start": {"theta": [0.3, 0.2]},
            "run": {"duration": 0.1},
        },
        axes=[axis("start.theta.0", 0.1, 0.2)],
        keep={"final": True},
    )
    found = sweep(asked, tmp_path / "urdf.zarr", workers=1)
    (note,) = asked.family.scene([0.1]).notes
    assert found.attributes["notes"] == [note]
    assert f"note {note}" in words_of(found.summary())
    assert not any(line.startswith("notes") for line in words_of(found.summary()))
    impacts = ensemble(
        scene="elbow_and_tip", axes=[axis("start.q.0", 0.5, 0.51)], keep={"final": True}
    )
    found = sweep(impacts, tmp_path / "impacts.zarr", workers=1)
    (line,) = [words for words in words_of(found.summary()) if words.startswith("notes")]
    assert line.startswith("notes 1 of the runs; the first: At 0.535")
    assert found.dataset()["notes"].values[1] == ""


def test_results_of_an_older_version_have_a_summary(tmp_path):
    asked = starts(2, keep={"final": True}, runs={"accuracy": 1e-6, "duration": 0.1})
    found = sweep(asked, tmp_path / "a.zarr", workers=1)
    lines = words_of(found.summary())
    group = zarr.open_group(found.path, mode="r+")
    group.attrs["format"] = "twolink sweep 1"
    del group["notes"], group["limit"], group.attrs["notes"]
    assert words_of(found.summary()) == lines
