"""File formats: each gives back the numbers and the description that were written."""

import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from twolink.errors import SimulationError
from twolink.simulation import formats
from twolink.simulation.formats import COLUMNS, FORMATS, JOINT_COLUMNS, Arrays, format_of
from twolink.suffixes import TRAJECTORIES

# Numbers at the ends of the format, and one with 17 digits.
T = np.array([0.0, 5e-324, 0.1 + 0.2, 1.7976931348623157e308])
Q = np.array([T[::-1], -T])
U = np.array([T / 3, np.full(4, -0.0)])
ABOUT = {"title": "Ärger,\n# 'and' \"quotes\"", "notes": [], "scene": None}
JOINTS = np.arange(16.0).reshape(4, 4)


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("joints", [None, JOINTS])
def test_each_bit_is_kept(suffix, joints, tmp_path):
    file = tmp_path / f"run{suffix}"
    FORMATS[suffix].write(file, Arrays(T, Q, U, ABOUT, joints))
    back = FORMATS[suffix].read(file)
    assert back.about == ABOUT
    for kept, written in zip(back[:3], (T, Q, U), strict=True):
        assert kept.tobytes() == written.tobytes()
        assert kept.flags.c_contiguous
    assert (back.joints is None) == (joints is None)
    assert joints is None or np.array_equal(back.joints, joints)


@pytest.mark.parametrize("suffix", FORMATS)
def test_files_without_samples_are_read(suffix, tmp_path):
    file = tmp_path / f"run{suffix}"
    FORMATS[suffix].write(file, Arrays(T[:0], Q[:, :0], U[:, :0], ABOUT))
    back = FORMATS[suffix].read(file)
    assert back.t.shape == (0,)
    assert back.q.shape == back.u.shape == (2, 0)


def test_columns_are_named():
    assert tuple(Arrays(T, Q, U, ABOUT).columns) == COLUMNS
    assert tuple(Arrays(T, Q, U, ABOUT, JOINTS).columns) == COLUMNS + JOINT_COLUMNS


def test_a_table_that_was_cut_off_loses_its_last_line(tmp_path):
    file = tmp_path / "run.csv"
    FORMATS[".csv"].write(file, Arrays(T, Q, U, ABOUT))
    file.write_bytes(file.read_bytes()[:-3])
    assert np.array_equal(FORMATS[".csv"].read(file).t, T[:-1])


@pytest.mark.parametrize("suffix", [".npz", ".parquet"])
def test_large_arrays_are_refused_before_they_are_read(suffix, tmp_path, monkeypatch):
    file = tmp_path / f"run{suffix}"
    FORMATS[suffix].write(file, Arrays(T, Q, U, ABOUT))
    monkeypatch.setattr(formats, "LARGEST_FILE", 40)
    with pytest.raises(SimulationError, match=r"must be at most .* MB; got"):
        FORMATS[suffix].read(file)


def test_an_array_that_promises_more_than_its_bytes_is_refused(tmp_path):
    file = tmp_path / "run.npz"
    FORMATS[".npz"].write(file, Arrays(T, Q, U, ABOUT))
    with zipfile.ZipFile(file) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members["t.npy"] = members["t.npy"].replace(b"(4,), }   ", b"(4000,), }")
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    with pytest.raises(SimulationError, match=r"t has 160 bytes for \(4000,\) numbers"):
        FORMATS[".npz"].read(file)


def test_every_suffix_of_trajectories_has_a_format():
    assert tuple(FORMATS) == TRAJECTORIES


def test_a_suffix_without_a_format_is_refused():
    with pytest.raises(SimulationError, match=r"got '\.parket' \(did you mean '\.parquet'\?\)"):
        format_of(Path("run.parket"))


_THREADS = """
import os, sys
from pathlib import Path
import numpy as np
import pyarrow.parquet
from twolink.simulation.formats import COLUMNS, FORMATS, Arrays
file, t = Path(sys.argv[1]), np.linspace(0.0, 1.0, 4)
threads = lambda: len(os.listdir("/proc/self/task"))
before = threads()
FORMATS[".parquet"].write(file, Arrays(t, np.array([t, t]), np.array([t, t]), {}))
FORMATS[".parquet"].read(file)
ours = threads()
pyarrow.parquet.read_table(file)
print(before, ours, threads())
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads are counted by Linux")
def test_parquet_files_start_no_threads(tmp_path):
    """Threads of pyarrow that still ran at the end of a process have aborted it."""
    command = [sys.executable, "-c", _THREADS, str(tmp_path / "run.parquet")]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    before, ours, read_table = map(int, result.stdout.split())
    assert before == ours
    # pyarrow's own defaults start some: the count is able to fail.
    assert read_table > ours
