import multiprocessing
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from tests.ensembles.cases import axis, ensemble, starts, words_of
from twolink import Results, sweep
from twolink.ensembles import executing, run
from twolink.errors import FileError, ParameterError, SceneError
from twolink.limits import Limits

KEEP = {"final": True, "extremes": True, "extreme_speeds": True, "first": [{"name": "flip"}]}
RUNS = {"accuracy": 1e-6, "duration": 2.0}


def same(one, other):
    names = (
        *("q", "u", "largest", "smallest", "error", "flip_time", "flip_bound", "flip_verdict"),
        *("largest_speed", "smallest_speed_time", "largest_speed_bound"),
        "smallest_speed_time_bound",
    )
    return all(
        np.array_equal(one.array(name), other.array(name), equal_nan="verdict" not in name)
        for name in names
    )


@pytest.mark.slow
def test_bits_are_the_same_for_any_number_of_workers_and_any_chunks(tmp_path):
    asked = starts(12, keep=KEEP, runs={"accuracy": 1e-6, "duration": 8.0})
    found = [
        sweep(asked, tmp_path / "one.zarr", workers=1),
        sweep(asked, tmp_path / "two.zarr", workers=2),
        sweep(asked, tmp_path / "odd.zarr", workers=3, chunk=7),
    ]
    assert all(same(found[0], other) for other in found[1:])
    assert found[0].runs_done.all()


@pytest.mark.parametrize("field", ["accuracy", "duration", "refine", "runs", "kept", "document"])
def test_an_ensemble_that_its_document_does_not_describe_is_refused(field, tmp_path):
    asked = starts(2, keep=KEEP, runs=RUNS)
    other = starts(
        3, keep={"final": True}, runs={"accuracy": 1e-3, "duration": 1.0, "refine": True}
    )
    changed = replace(asked, **{field: getattr(other, field)})
    with pytest.raises(ParameterError, match="ensemble must be as its document describes it"):
        sweep(changed, tmp_path / "a.zarr", workers=1)
    assert not (tmp_path / "a.zarr").exists()


@pytest.mark.slow
def test_a_rerun_computes_only_the_missing_chunks(tmp_path, monkeypatch):
    asked = starts(5, keep=KEEP, runs=RUNS)
    made = []
    rows_of = executing.rows_of

    def interrupted(ensemble, first, last, limits):
        if len(made) == 2:
            raise KeyboardInterrupt
        made.append(first)
        return rows_of(ensemble, first, last, limits)

    monkeypatch.setattr(executing, "rows_of", interrupted)
    with pytest.raises(KeyboardInterrupt):
        sweep(asked, tmp_path / "a.zarr", workers=1, chunk=6)
    monkeypatch.setattr(executing, "rows_of", lambda *a: made.append(a[1]) or rows_of(*a))
    seen = []
    found = sweep(
        asked, tmp_path / "a.zarr", workers=1, chunk=99, progress=lambda *a: seen.append(a)
    )
    assert made == [0, 6, 12, 18, 24]
    assert seen == [(12, 25), (18, 25), (24, 25), (25, 25)]
    assert same(found, sweep(asked, tmp_path / "b.zarr", workers=1))
    made.clear()
    sweep(asked, tmp_path / "a.zarr", workers=1)
    assert made == []


@pytest.mark.slow
def test_rows_that_fail_have_reasons_and_the_others_results(tmp_path):
    found = sweep(
        {
            "scene": "free_fall",
            "axes": [axis("chain.mass.0", 1.0, -1.0), axis("effects.gravity.g", 1.0, 2.0)],
            "runs": {"duration": 0.5},
            "keep": {"final": True},
        },
        tmp_path / "a.zarr",
    )
    reasons = found.array("reason")
    assert [bool(reason) for reason in reasons] == [False, False, True, True]
    assert np.isnan(found.array("q")[2:]).all()
    rows = words_of(found.summary())
    assert "2 failed link 1: mass must be a positive number of kg; got -1.0" in rows


def test_a_folder_that_is_no_result_is_left_as_it_is(tmp_path):
    (tmp_path / "a.zarr").mkdir()
    (tmp_path / "a.zarr" / "mine.txt").write_text("x")
    with pytest.raises(FileError, match="must be the result of a sweep; got another folder"):
        sweep(starts(2, runs=RUNS), tmp_path / "a.zarr")
    assert [file.name for file in (tmp_path / "a.zarr").iterdir()] == ["mine.txt"]
    with pytest.raises(FileError, match="cannot be made"):
        sweep(starts(2, runs=RUNS), tmp_path / "none" / "a.zarr")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"workers": 0}, "workers must be a whole number of 1 or more; got 0"),
        ({"chunk": 0}, "chunk must be a whole number of 1 or more; got 0"),
        ({"executor": 3}, "executor must be one of concurrent.futures, or None; got 3"),
        ({"progress": 3}, "progress must be a function of done and count, or None; got 3"),
        ({"limits": 3}, "limits must be a Limits; got 3"),
        ({"ensemble": 3}, "ensemble must be an Ensemble, a sweep file, or its tables; got 3"),
        ({"out": 3}, "out must be a path; got 3"),
    ],
)
def test_arguments_of_another_kind_are_refused(options, sentence, tmp_path):
    given = {"ensemble": ensemble(keep={"final": True}), "out": tmp_path / "a.zarr", **options}
    with pytest.raises(ParameterError, match=sentence):
        sweep(given.pop("ensemble"), given.pop("out"), **given)
    assert not list(tmp_path.iterdir())


def test_chunks_are_whole_groups_of_lanes_and_their_results_fit_the_memory():
    assert run._chunk(starts(100, keep={"final": True})) == 1280
    assert run._chunk(starts(2000, keep={"final": True})) == 4096
    many = run._chunk(starts(2000, keep={"samples": 100_000}))
    assert many == 64
    assert run._chunk(starts(2, keep={"final": True})) == 32
    modes = ensemble(scene="drop", axes=[axis("start.q.0", grid=GRID)], keep={"final": True})
    assert run._chunk(modes) == 1


GRID = {"first": 0.0, "last": 0.1, "count": 9}


def test_a_file_that_is_missing_is_refused(tmp_path):
    with pytest.raises(SceneError, match="there is no file of this name"):
        sweep(tmp_path / "none.toml", tmp_path / "a.zarr")


PATIENT = starts(24, keep=KEEP, runs={"accuracy": 1e-6, "duration": 10.0})


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """The results of `PATIENT` by one process."""
    return sweep(PATIENT, tmp_path_factory.mktemp("alone") / "a.zarr", workers=1)


def killer(processes):
    """Return a callback of progress that kills the first of some processes in mid-run."""
    killed = []

    def progress(done, count):
        if 0 < done < count and not killed:
            killed.append(next(iter(processes())))
            os.kill(killed[0], signal.SIGKILL)

    return progress, killed


@pytest.mark.slow
def test_one_of_two_workers_of_dask_is_killed_and_nothing_is_lost(tmp_path, alone):
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        progress, killed = killer(client.run(os.getpid).values)
        found = sweep(
            PATIENT,
            tmp_path / "a.zarr",
            executor=client.get_executor(),
            chunk=32,
            progress=progress,
        )
    assert killed
    assert found.runs_done.all()
    assert same(found, alone)


@pytest.mark.slow
def test_one_of_two_processes_is_killed_and_nothing_is_lost(tmp_path, alone):
    def processes():
        return (process.pid for process in multiprocessing.active_children())

    progress, killed = killer(processes)
    found = sweep(PATIENT, tmp_path / "a.zarr", workers=2, chunk=32, progress=progress)
    assert killed
    assert found.runs_done.all()
    assert same(found, alone)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_an_interrupted_command_is_continued_by_the_next(tmp_path, alone, number):
    file, out = tmp_path / "sweep.toml", tmp_path / "a.zarr"
    file.write_text(TOML)
    command = [sys.executable, "-m", "twolink.cli", "sweep", file, "--out", out, "--workers", "2"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    while not (out / "done" / "c").exists():
        time.sleep(0.02)
        assert process.poll() is None, process.stderr.read()
    process.send_signal(number)
    _, said = process.communicate()
    assert process.returncode == (-9 if number == signal.SIGKILL else 128 + number)
    if number != signal.SIGKILL:
        # Python's own tracker of semaphores says that a killed process has left some.
        assert said == ""
    assert 0 < Results.load(out).runs_done.sum() < 576
    again = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "576 of 576" in again.stdout
    assert same(Results.load(out), alone)
    assert not list(out.rglob("*.partial"))


TOML = """
scene = "free_fall"
[[axes]]
parameter = "start.q.0"
grid = {first = -3.0, last = 3.0, count = 24}
[[axes]]
parameter = "start.q.1"
grid = {first = -3.0, last = 3.0, count = 24}
[runs]
accuracy = 1e-6
duration = 10.0
[keep]
final = true
extremes = true
extreme_speeds = true
first = [{name = "flip"}]
"""


def test_a_refused_executor_is_described_in_one_short_line(tmp_path):
    class Loud:
        def __repr__(self):
            return "a\nb\x1b[31m" * 1000

    with pytest.raises(ParameterError, match="executor must be one of") as said:
        sweep(starts(2, runs=RUNS), tmp_path / "a.zarr", executor=Loud())
    assert len(str(said.value)) < 400
    assert "\n" not in str(said.value)
    assert not (tmp_path / "a.zarr").exists()


def test_runs_that_a_smaller_limit_has_ended_are_made_again(tmp_path):
    """And those of other chunks are not."""
    asked = ensemble(scene="drop", axes=[axis("start.q.0", 0.0, 0.1)], keep={"final": True})
    short = sweep(asked, tmp_path / "a.zarr", workers=1, limits=Limits(seconds=1e-9))
    assert all("(--force lifts it" in reason for reason in short.array("reason"))
    assert (short.array("limit") == 1e-9).all()
    made = []
    sweep(
        asked, tmp_path / "a.zarr", workers=1, limits=Limits(seconds=1e-9),
        progress=lambda n, of: made.append(n),
    )  # fmt: skip
    assert made == [2]
    made.clear()
    again = sweep(asked, tmp_path / "a.zarr", workers=1, progress=lambda n, of: made.append(n))
    whole = sweep(asked, tmp_path / "b.zarr", workers=1)
    assert made[0] == 0
    for name in ("q", "u", "error", "reason", "notes"):
        assert np.array_equal(again.array(name), whole.array(name))
    assert np.isnan(again.array("limit")).all()
    made.clear()
    sweep(asked, tmp_path / "a.zarr", workers=1, progress=lambda n, of: made.append(n))
    assert made == [2]
