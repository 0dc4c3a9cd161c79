import os

import numpy as np
import pytest
import zarr

from tests.ensembles.cases import axis, ensemble, starts
from twolink.ensembles import store as stores
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.store import attributes, created, in_use, opened
from twolink.errors import FileError, ParameterError
from twolink.limits import DEFAULT_LIMITS, Limits

ASKED = starts(4, runs={"accuracy": 1e-6, "duration": 0.5})


def test_a_store_is_made_whole_and_without_results(tmp_path):
    store = created(tmp_path / "a.zarr", ASKED, 6)
    assert [file.name for file in tmp_path.iterdir()] == ["a.zarr"]
    assert not store.done().any()
    assert (store.chunks, store.runs(2)) == (3, (12, 16))
    group = zarr.open_group(tmp_path / "a.zarr", mode="r")
    assert group["q"].shape == (16, 2)
    assert group["q"].shards == (6, 2)
    assert group["q"].attrs["units"] == "rad"
    assert group["flip_verdict"].attrs["flag_meanings"] == "undecided happens never"
    about = attributes(tmp_path / "a.zarr")
    assert about["sweep"]["scene"]["chain"]["mass"] == [1.0, 1.0]
    assert about["versions"].keys() >= {"python", "twolink", "heyoka", "numpy"}


def test_a_chunk_is_written_into_its_shards_alone(tmp_path):
    store = created(tmp_path / "a.zarr", ASKED, 6)
    before = {file for file in (tmp_path / "a.zarr").rglob("*") if file.is_file()}
    rows = rows_of(ASKED, *store.runs(1))
    rows.reasons[2] = "it must be …; got …"
    store.write(1, rows)
    new = {file for file in (tmp_path / "a.zarr").rglob("*") if file.is_file()} - before
    arrays = {file.relative_to(tmp_path / "a.zarr").parts[0] for file in new}
    assert {file.relative_to(tmp_path / "a.zarr").parts[1:3] for file in new} == {("c", "1")}
    # Zarr leaves out shards that have only fill values.
    assert {"q", "error", "precision", "reason", "done"} <= arrays
    assert arrays <= {*rows.arrays, *rows.texts, "done"}
    assert store.done().tolist() == [False, True, False]
    group = zarr.open_group(tmp_path / "a.zarr", mode="r")
    assert np.array_equal(group["q"][6:12], rows.arrays["q"])
    assert group["reason"][8] == "it must be …; got …"
    assert np.isnan(group["q"][:6]).all()


def test_a_chunk_that_is_written_again_has_no_old_texts(tmp_path):
    store = created(tmp_path / "a.zarr", ASKED, 6)
    rows = rows_of(ASKED, *store.runs(1))
    rows.reasons[2], rows.notes[3] = "it must be …; got …", "one\ntwo"
    store.write(1, rows)
    group = zarr.open_group(tmp_path / "a.zarr", mode="r")
    assert group["notes"][:].tolist() == [*[""] * 9, "one\ntwo", *[""] * 6]
    rows.reasons[2], rows.notes[3] = "", ""
    store.write(1, rows)
    for name in ("reason", "notes"):
        assert not any(group[name][:])


def test_chunks_with_runs_that_a_smaller_limit_ended_are_made_again(tmp_path):
    store = created(tmp_path / "a.zarr", ASKED, 6)
    for number in range(3):
        rows = rows_of(ASKED, *store.runs(number))
        rows.arrays["limit"][-1] = (10.0, np.nan, 20.0)[number]
        store.write(number, rows)
    assert store.done().all()
    assert store.reopened(Limits(seconds=10.0)).all()
    assert store.reopened(Limits(seconds=20.0)).tolist() == [False, True, True]
    assert store.reopened(DEFAULT_LIMITS).tolist() == [False, True, False]
    # A worker that is killed leaves no rows of two runs.
    assert store.done().tolist() == [False, True, False]


def test_the_store_of_an_older_version_is_read_and_not_continued(tmp_path):
    path = tmp_path / "a.zarr"
    created(path, ASKED, 6)
    zarr.open_group(path, mode="r+").attrs["format"] = "twolink sweep 1"
    assert attributes(path)["shape"] == [4, 4, 1]
    with pytest.raises(FileError, match="must be of this version of twolink to be continued"):
        opened(path, ASKED)


def test_the_store_of_another_sweep_or_of_other_versions_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.zarr"
    created(path, ASKED, 6)
    assert opened(path, ASKED).chunk == 6
    with pytest.raises(
        ParameterError, match="must be the result of this sweep, or not exist; got that"
    ):
        opened(path, ensemble(axes=[axis("start.q.0", 1.0)], title="another"))
    versions = {"python": "3", "twolink": "0", "heyoka": "9"}
    monkeypatch.setattr(stores, "package_versions", lambda *names: versions)
    with pytest.raises(FileError, match=r"must be continued with twolink .*; got twolink 0"):
        opened(path, ASKED)


@pytest.mark.parametrize("kind", ["file", "folder", "nothing", "group", "text"])
def test_paths_without_a_result_are_refused(tmp_path, kind):
    path = tmp_path / "a.zarr"
    if kind == "file":
        path.write_text("x")
    elif kind == "group":
        zarr.create_group(path)
    elif kind != "nothing":
        path.mkdir()
        if kind == "text":
            (path / "zarr.json").write_text("{")
    with pytest.raises(FileError, match=r"a\.zarr: ") as caught:
        attributes(path)
    assert "\n" not in str(caught.value)


def test_two_sweeps_do_not_write_to_one_store(tmp_path):
    path = tmp_path / "a.zarr"
    created(path, ASKED, 6)
    (path / "q" / "x.partial").parent.mkdir(exist_ok=True)
    (path / "q" / "x.partial").write_text("left by a killed worker")
    with in_use(path):
        assert not (path / "q" / "x.partial").exists()
        other = in_use(path)
        with pytest.raises(FileError, match="must not be in use; got one to which another sweep"):
            other.__enter__()
    with in_use(path):
        pass


def test_writing_to_a_removed_store_is_refused(tmp_path):
    store = created(tmp_path / "a.zarr", ASKED, 6)
    rows = rows_of(ASKED, *store.runs(0))
    os.rename(tmp_path / "a.zarr", tmp_path / "b.zarr")
    with pytest.raises(FileError, match="there is no result of a sweep"):
        store.write(0, rows)
    assert not (tmp_path / "a.zarr").exists()
    assert not opened(tmp_path / "b.zarr", ASKED).done().any()


def test_a_full_disk_is_one_sentence_and_leaves_the_chunk_undone(tmp_path, monkeypatch):
    from zarr.storage import _local

    store = created(tmp_path / "a.zarr", ASKED, 6)
    rows = [rows_of(ASKED, *store.runs(number)) for number in (0, 1)]
    store.write(0, rows[0])

    def full(*args, **named):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(_local, "_put", full)
    with pytest.raises(FileError, match=r"cannot be read or written \(No space left on device\)"):
        store.write(1, rows[1])
    monkeypatch.undo()
    assert store.done().tolist() == [True, False, False]
    store.write(1, rows[1])
    assert store.done().tolist() == [True, True, False]
