"""The file formats of trajectories: arrays and a description, written and read without loss.

A .npz file has the arrays t, q and u, and `about`, the description as JSON. A .parquet file has the
columns below, and `about` in the metadata of its schema. A .csv file begins with `about`, an entry
a line after `# `; the names of the columns follow, and a line for each sample. For a chain with
joint angles, files also have theta and omega, for other programs.
"""

from __future__ import annotations

import csv
import json
import math
import zipfile
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from twolink.errors import SimulationError
from twolink.files import check_no_mark
from twolink.simulation.run import Array
from twolink.suffixes import TrajectorySuffix
from twolink.text import choice, one_line, quoted

COLUMNS = ("t_s", "q1_rad", "q2_rad", "u1_rad_per_s", "u2_rad_per_s")

JOINT_COLUMNS = ("theta1_rad", "theta2_rad", "omega1_rad_per_s", "omega2_rad_per_s")

LARGEST_FILE = 2**30
"""Bytes of the largest file that is read, and of its arrays: some 25 million samples."""

_COMMENT = "# "
# Characters of a line of comments; the longest is that of events and impacts.
_LONGEST_LINE = 2**28


class Arrays(NamedTuple):
    """The content of a file: t of shape (n,), q and u of shape (2, n), and `About` as JSON has it.

    `joints` are theta and omega, of shape (4, n), where the chain has joint angles.
    """

    t: Array
    q: Array
    u: Array
    about: Any
    joints: Array | None = None

    @property
    def columns(self) -> dict[str, Array]:
        """The columns of a table by name."""
        found = dict(zip(COLUMNS, (self.t, *self.q, *self.u), strict=True))
        if self.joints is not None:
            found |= zip(JOINT_COLUMNS, self.joints, strict=True)
        return found


_ARRAYS = ("t", "q", "u", "about")
_JOINT_ARRAYS = ("theta", "omega")


def _write_npz(file: Path, stored: Arrays) -> None:
    with file.open("wb") as stream:
        arrays = {"t": stored.t, "q": stored.q, "u": stored.u}
        if stored.joints is not None:
            arrays |= {"theta": stored.joints[:2], "omega": stored.joints[2:]}
        np.savez(stream, about=json.dumps(stored.about), **arrays)  # type: ignore[arg-type]


def _read_npz(file: Path) -> Arrays:
    with file.open("rb") as stream:
        if stream.read(6) == b"\x93NUMPY":
            raise SimulationError("the content must be an archive of arrays; got a single array")
        with zipfile.ZipFile(stream) as members:
            _check_members(members)
        stream.seek(0)
        archive = np.load(stream, allow_pickle=False)
        about = json.loads(str(archive["about"]))
        there = all(name in archive for name in _JOINT_ARRAYS)
        joints = np.concatenate([archive[name] for name in _JOINT_ARRAYS]) if there else None
        return Arrays(archive["t"], archive["q"], archive["u"], about, joints)


def _check_members(archive: zipfile.ZipFile) -> None:
    """Refuse arrays that are missing, or that take more memory than their bytes in the archive.

    Their headers are read before anything else: a few bytes may promise terabytes.
    """
    names = {name.removesuffix(".npy"): name for name in archive.namelist()}
    missing = [name for name in _ARRAYS if name not in names]
    if missing:
        raise SimulationError(
            f"the arrays must be {', '.join(_ARRAYS)}; got no {' and no '.join(missing)}"
        )
    for name in _ARRAYS + _JOINT_ARRAYS:
        if name in names:
            _check_member(archive, name, archive.getinfo(names[name]))


def _too_large(size: int) -> str:
    return f"must be at most {LARGEST_FILE / 2**20:.4g} MB; got {size / 2**20:.4g} MB"


def _check_member(archive: zipfile.ZipFile, name: str, info: zipfile.ZipInfo) -> None:
    if info.file_size > LARGEST_FILE:
        raise SimulationError(f"{name} {_too_large(info.file_size)}")
    with archive.open(info) as stream:
        version = np.lib.format.read_magic(stream)
        read = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }.get(version)
        if read is None:
            raise SimulationError(f"{name} is of format {version}; must be (1, 0) or (2, 0)")
        shape, _, dtype = read(stream)
    promised = math.prod(shape) * dtype.itemsize
    if promised > info.file_size:
        raise SimulationError(
            f"{name} has {info.file_size} bytes for {quoted(shape)} numbers; must have all"
        )


def _write_csv(file: Path, stored: Arrays) -> None:
    with file.open("w", newline="", encoding="utf-8") as stream:
        for key, value in stored.about.items():
            stream.write(f"{_COMMENT}{key}: {json.dumps(value)}\n")
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(stored.columns)
        # As Python's floats, since the format of NumPy's depends on its settings.
        columns = [column.tolist() for column in stored.columns.values()]
        writer.writerows(zip(*columns, strict=True))


def _read_csv(file: Path) -> Arrays:
    about = {}
    with file.open("rb") as raw:
        check_no_mark(raw.read(4))
    with file.open(encoding="utf-8") as stream:
        line = stream.readline(_LONGEST_LINE)
        while line.startswith(_COMMENT):
            key, _, value = line.removeprefix(_COMMENT).partition(": ")
            about[key] = json.loads(value)
            line = stream.readline(_LONGEST_LINE)
        names = line.rstrip("\n").split(",")
        _check_columns(names)
        body = stream.read()
    # Of a line that was cut off, the last number may have been longer.
    whole = body[: body.rfind("\n") + 1]
    if not whole.strip():
        return _from_columns(np.empty((len(names), 0)), about)
    rows = np.loadtxt(StringIO(whole), delimiter=",", comments=None, ndmin=2)
    if rows.shape[1] != len(names):
        raise SimulationError(f"each line must have {len(names)} numbers; got {rows.shape[1]}")
    return _from_columns(rows.T, about)


def _write_parquet(file: Path, stored: Arrays) -> None:
    pyarrow = load_pyarrow(file)
    table = pyarrow.table(stored.columns)
    table = table.replace_schema_metadata({"about": json.dumps(stored.about)})
    pyarrow.parquet.write_table(table, file, write_page_checksum=True)


def _read_parquet(file: Path) -> Arrays:
    pyarrow = load_pyarrow(file)
    with file.open("rb") as stream:
        kept = pyarrow.parquet.ParquetFile(
            stream, page_checksum_verification=True, pre_buffer=False
        )
        size = kept.metadata.num_rows * 8 * len(COLUMNS)
        groups = range(kept.metadata.num_row_groups)
        size = max(size, sum(kept.metadata.row_group(n).total_byte_size for n in groups))
        if size > LARGEST_FILE:
            raise SimulationError(f"its columns {_too_large(size)}")
        _check_columns(kept.schema_arrow.names)
        # Threads of pyarrow that still run at the end of a process may abort it.
        table = kept.read(use_threads=False)
    for column in table.itercolumns():
        if column.type != pyarrow.float64() or column.null_count:
            raise SimulationError(
                f"columns must be of float64 without gaps; got {column.type} with "
                f"{column.null_count} gaps"
            )
    metadata = table.schema.metadata or {}
    if b"about" not in metadata:
        raise SimulationError("the schema must have the metadata `about`; got none")
    columns = np.array([column.to_numpy() for column in table.itercolumns()])
    return _from_columns(columns, json.loads(metadata[b"about"]))


def load_pyarrow(file: Path) -> Any:
    """Return the package that reads and writes .parquet files, or say how to install it."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise SimulationError(
            f"{file}: pyarrow must be installed for .parquet files "
            '(pip install "twolink[parquet]"); .npz and .csv need nothing'
        ) from error
    return pyarrow


def _check_columns(names: list[str]) -> None:
    if tuple(names) not in (COLUMNS, COLUMNS + JOINT_COLUMNS):
        raise SimulationError(
            f"columns must be {', '.join(COLUMNS)}; got {one_line(', '.join(names), 200)}"
        )


def _from_columns(columns: Array, about: Any) -> Arrays:
    """Return the content of columns, of shape (5, n) or (9, n), laid out as in a simulation."""
    t, q, u = (np.ascontiguousarray(part) for part in (columns[0], columns[1:3], columns[3:5]))
    return Arrays(t, q, u, about, columns[5:] if len(columns) > 5 else None)


def _nothing(file: Path) -> None:
    """Require no package."""


class Format(NamedTuple):
    """How arrays are written to files of a kind, and read from them.

    `require` raises `SimulationError` if a package for them is not installed.
    """

    write: Callable[[Path, Arrays], None]
    read: Callable[[Path], Arrays]
    require: Callable[[Path], object] = _nothing


FORMATS: dict[TrajectorySuffix, Format] = {
    ".npz": Format(_write_npz, _read_npz),
    ".csv": Format(_write_csv, _read_csv),
    ".parquet": Format(_write_parquet, _read_parquet, load_pyarrow),
}
"""The formats by the suffixes of files."""


def format_of(file: Path) -> Format:
    """Return the format of a file, or raise `SimulationError` for a suffix that has none."""
    for suffix, found in FORMATS.items():
        if suffix == file.suffix:
            return found
    raise SimulationError(f"{one_line(file, 300)}: {choice('the suffix', file.suffix, FORMATS)}")
